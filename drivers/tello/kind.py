"""Tellos as a kind of vehicle."""

from collections.abc import Iterator, Mapping, Sequence

from drivers.tello.settings import FASTEST_M_S, TelloDriverSettings, TelloSection
from drivers.tello.wire.text import CENTRED, COMMAND_PORT, LAND, VIDEO_PORT
from drivers.vehicle_settings import a_process_each, values_of
from groundstation.vehicles import ErrorHabits, Finding, KindSection, Offer, StopDatagrams, VehicleKind, VehicleOrder

_WIDTH_PX, _HEIGHT_PX = 960, 720  # WIRE (docs/reference/tello.md 4)


def _settings(order: VehicleOrder) -> TelloDriverSettings:
    return TelloDriverSettings(**values_of(order), tello=order.section("tello", TelloSection()))


def _stop(orders: Sequence[VehicleOrder]) -> StopDatagrams:
    # Sticks in the middle never lift one that stands. The vehicle obeys every sender.
    transport, way = "drivers.tello.failsafe_transport:TelloFailsafe", orders[0].drone.interface
    return StopDatagrams(COMMAND_PORT, CENTRED, LAND, transport, way)


def _moved(local_address: str, sections: Mapping[str, KindSection]) -> dict[str, dict[str, object]]:
    return {"tello": {"local_address": local_address}}


def _check(orders: Sequence[VehicleOrder]) -> Iterator[tuple[str, Finding]]:
    """Yield a finding where a drone's own video has another size than its calibration, or is never asked for."""
    for order in orders:
        camera = order.drone.camera
        if not camera.source.startswith("tello://"):
            continue
        found = camera.calibration.width_px, camera.calibration.height_px
        if found != (_WIDTH_PX, _HEIGHT_PX):
            text = f"must be for {_WIDTH_PX} x {_HEIGHT_PX} pixels, as a Tello sends them (got {found[0]} x {found[1]})"
            yield order.name, (("camera", "calibration"), text)
        if not order.section("tello", TelloSection()).video:
            yield (
                order.name,
                (("tello", "video"), f"must be true for camera.source {camera.source}: else no picture comes"),
            )


_OFFER = """\
    tello: {}
    camera:
      calibration: cameras/tello_front.yaml   # a Tello's, 960 x 720; measure yours: groundstation calibrate camera
      position_m: [0.04, 0.0, 0.0]
      tilt_down_deg: 45          # as you mount it: as sold, it looks ahead, where markers are not seen from above
"""

KIND = VehicleKind(
    name="tello",
    summary="Ryze Tello and RoboMaster TT",
    driver="drivers.tello.driver:run",
    # Its velocity is the optical flow's, in steps of 0.1 m/s, its climb rate likewise.
    habits=ErrorHabits(
        0.5, 5.0, 0.7, 0.05, 0.0, reports_climb=True, tells_attitude=True, tells_steps=True, fastest_m_s=FASTEST_M_S
    ),
    processes=a_process_each(_settings),
    stop=_stop,
    sections={"tello": TelloSection},
    required=frozenset({"tello"}),
    camera="tello",
    camera_port=VIDEO_PORT,
    reader="drivers.tello.video:TelloReader",
    has_interface=True,
    moved=_moved,
    check=_check,
    emulator="sim_bridge.devices.tello:EMULATION",
    flight_time_s=13 * 60.0,
    example={"tello": {}},
    offers={"tello": Offer("Tello", _OFFER, pictures="tello://{address}", address="192.168.10.1")},
)
