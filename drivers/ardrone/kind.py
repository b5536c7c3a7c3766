"""AR.Drones as a kind of vehicle."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Literal

from pydantic import Field

from drivers.ardrone.settings import FASTEST_M_S, ArDroneDriverSettings, ArDroneLimits, FlightConfiguration, Video
from drivers.ardrone.wire import at
from drivers.ardrone.wire.tags import OPTION_SIZES
from drivers.vehicle_settings import Port, a_process_each, values_of, vehicle_limits
from groundstation.vehicles import (
    ErrorHabits,
    Finding,
    KindCommands,
    KindSection,
    Offer,
    StopDatagrams,
    VehicleKind,
    VehicleOrder,
)

_VIDEO_WIDTHS = {"h264_360p": 640, "h264_720p": 1280}


class ArDroneVideo(KindSection):
    """Video settings that are written to an AR.Drone."""

    codec: Literal["h264_360p", "h264_720p"] = "h264_360p"
    """Video that the drone sends over TCP 5555: 640x360 or 1280x720 pixels. The calibration must have the same size."""
    channel: Literal["front", "bottom"] = "front"
    """Which of the drone's cameras sends."""
    bitrate: Annotated[int, Field(ge=250, le=4000)] | None = None
    """Constant bit rate [kbit/s]; none: the drone chooses."""


# WIRE (docs/reference/ardrone.md 5.4): values of pic:ultrasound_freq.
_ULTRASOUND: dict[int, Literal[7, 8]] = {22: 7, 25: 8}


class ArDroneOwn(KindSection):
    """How an AR.Drone is set up for its room, and where it is reached."""

    hull: Literal["indoor", "outdoor"] = "indoor"
    """Which hull it wears; the outdoor one has no rings around the propellers."""
    outdoor: bool = False
    """true: it flies outdoors, with another set of limits, over which those of the field file are written."""
    flat_trim: Literal["at_connect", "on_order"] = "at_connect"
    """When its attitude is taken for level. at_connect: by the driver whenever it connects to a drone that stands;
    on_order: only by `groundstation ardrone trim`, for pads that are not level."""
    ultrasound_hz: Literal[22, 25] | None = None
    """Rate of its ultrasound [Hz]; none: 22 and 25 in turn, in the order of the drones, so that neighbours differ."""
    strict_checksum: bool = True
    """Whether navdata with a wrong checksum is refused; false for firmwares and bridges that send none."""
    navdata_port: Port = 5554
    """UDP port of its navdata."""
    at_port: Port = 5556
    """UDP port that it takes commands at."""
    control_port: Port = 5559
    """TCP port of its configuration."""
    ftp_port: Port = 5551
    """TCP port of its version."""


_PORTS = ("navdata_port", "at_port", "control_port", "ftp_port")


def _own(order: VehicleOrder) -> ArDroneOwn:
    return order.section("ardrone", ArDroneOwn())


def _settings(order: VehicleOrder) -> ArDroneDriverSettings:
    drone, own = order.drone, _own(order)
    # WIRE: neighbours must not receive each other's ultrasound: 22.22 Hz (7) and 25 Hz (8) in turn.
    rate_hz = own.ultrasound_hz or (25 if order.index % 2 else 22)
    limits = ArDroneLimits(**vehicle_limits(drone.limits).model_dump(), max_tilt_deg=drone.limits.max_tilt_deg)
    return ArDroneDriverSettings(
        **values_of(order) | {"limits": limits},
        serial_number=drone.serial_number,
        flight=FlightConfiguration(
            altitude_max_m=max(0.5, order.top_m),
            outdoor=own.outdoor,
            without_shell=own.hull == "outdoor",
            ultrasound_freq=_ULTRASOUND[rate_hz],
            flat_trim=own.flat_trim == "at_connect",
        ),
        video=_video(order),
        strict_checksum=own.strict_checksum,
        **{name: getattr(own, name) for name in _PORTS},
    )


def _video(order: VehicleOrder) -> Video | None:
    video = order.sections.get("video")
    if not isinstance(video, ArDroneVideo):
        return None
    return Video(codec=video.codec, channel=video.channel, bitrate=video.bitrate)


def _stop(orders: Sequence[VehicleOrder]) -> StopDatagrams:
    # WIRE: sequence number 1 resets the drone's count, so it obeys the next sender after its driver. Hovering is
    # PCMD without flags, and no REF: a start bit would lift a drone that stands.
    hover = at.encode_datagram([at.pcmd(at.ProgressiveMotion())], 1)
    land = at.encode_datagram([at.ref(start=False), at.pcmd(at.ProgressiveMotion())], 1)
    return StopDatagrams(_own(orders[0]).at_port, hover, land)


def _check(orders: Sequence[VehicleOrder]) -> Iterator[tuple[str, Finding]]:
    """Yield a finding where the calibration of a drone's own video has another size than its settings."""
    for order in orders:
        if not order.drone.camera.source.startswith("ardrone://"):
            continue
        codec = order.section("video", ArDroneVideo()).codec
        wanted, found = _VIDEO_WIDTHS[codec], order.drone.camera.calibration.width_px
        if found != wanted:
            text = f"must be for pictures {wanted} wide, as video codec {codec} sends them (got {found})"
            yield order.name, (("camera", "calibration"), text)


def _moved(_local_address: str, _sections: Mapping[str, KindSection]) -> dict[str, dict[str, object]]:
    # An emulated one has the ports of a new one.
    return {"ardrone": {name: ArDroneOwn.model_fields[name].default for name in _PORTS}}


_OFFER = """\
    odometry:                    # calibrated figures of this vehicle's navdata
      velocity_scale: 1.18       # true speed = scale x reported speed
      velocity_std_m_s: 0.05
      velocity_delay_ms: 30
      height_std_m: 0.04
      height_delay_ms: 85
      attitude_std_deg: 1.0
      yaw_rate_std_deg_s: 1.0
"""

# An AR.Drone reports no climb rate: climbs come from heights and cameras. Its navdata report a level attitude for a
# drone that leans into moving air.
KIND = VehicleKind(
    name="ardrone",
    summary="Parrot AR.Drone 1.0 and 2.0",
    driver="drivers.ardrone.driver:run",
    habits=ErrorHabits(0.4, 5.0, 0.7, 0.0, 0.2, reports_climb=False, tells_attitude=False, fastest_m_s=FASTEST_M_S),
    processes=a_process_each(_settings),
    stop=_stop,
    sections={"video": ArDroneVideo, "ardrone": ArDroneOwn},
    moved=_moved,
    check=_check,
    # WIRE (docs/reference/ardrone.md 7): of a recorded take-off, with its overshoot.
    take_off=0.82,
    flight_time_s=12 * 60.0,
    standing_m=(0.06, 0.015),  # on its feet
    camera="ardrone",
    camera_port=5555,
    reader="drivers.ardrone.video:ArDroneReader",
    has_serial_number=True,
    has_interface=True,
    blink="drivers.ardrone.blink:blink",
    emulator="sim_bridge.devices.ardrone_emulation:EMULATION",
    emulated_faults=frozenset({"propeller_blocked", "uniform_floor", "obstacle_below"}),
    emulated_firmwares=tuple(OPTION_SIZES),
    offers={"ardrone": Offer("AR.Drone 2", _OFFER, pictures="ardrone://{address}")},
    commands=KindCommands("groundstation.cli.ardrone:ardrone", "Probe an AR.Drone without flying it.", ("probe",)),
)
