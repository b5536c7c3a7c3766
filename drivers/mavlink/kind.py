"""Vehicles with a MAVLink autopilot as a kind of vehicle: PX4 and ArduPilot."""

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Literal

from pydantic import Field

from drivers.mavlink.settings import (
    FASTEST_M_S,
    Forward,
    LinkSettings,
    MavlinkDriverSettings,
    ParameterName,
    VehicleSettings,
    VisionFeedback,
)
from drivers.vehicle_settings import Address, Shape, silence_limits, vehicle_limits
from groundstation.adapters import with_zone
from groundstation.errors import SettingsError
from groundstation.vehicles import (
    DriverProcess,
    ErrorHabits,
    Finding,
    KindCommands,
    KindSection,
    Offer,
    StopDatagrams,
    VehicleKind,
    VehicleOrder,
)

_TRANSPORT = "drivers.mavlink.failsafe_transport:MavlinkFailsafe"


class Mavlink(KindSection):
    """A MAVLink vehicle and the link to it.

    By default the driver opens the link to address:port over UDP; `listen` and `serial` replace that.
    """

    flavour: Literal["px4", "ardupilot"]
    """The autopilot's firmware; the driver refuses a vehicle that reports another one."""
    system_id: Annotated[int, Field(ge=1, le=250)]
    """MAVLink system id of the vehicle; each its own."""
    link: Literal["pymavlink", "mavsdk"] = "pymavlink"
    """Library on our side of the link. Signed links need pymavlink."""
    port: Annotated[int, Field(ge=1024, le=65535)] = 14550
    """UDP port: the vehicle's, or ours with listen."""
    listen: bool = False
    """true: the vehicle opens the connection to local_address:port. Vehicles that share a port share one driver
    process. When the driver is dead, others speak to the vehicle from another port than the one it called."""
    local_address: Address = "0.0.0.0"
    """IPv4 address that the driver listens on, with listen."""
    serial: Annotated[str, Shape(r"^(/dev/[^:]+:\d{1,7})?$", "must be DEVICE:BAUD, such as /dev/ttyUSB0:921600")] = ""
    """Serial radio DEVICE:BAUD instead of UDP, such as /dev/ttyUSB0:921600; empty: UDP. `config check` compares BAUD
    with what the vehicle needs."""
    key_file: str = ""
    """File with the signing key (32 bytes, or 64 hex digits), kept outside the field file; empty: frames are not
    signed."""
    take_off_m: Annotated[float, Field(ge=0.4, le=3)] = 0.8
    """Height [m] that a take-off climbs to."""
    vision_hz: Annotated[float, Field(ge=5, le=50)] = 30.0
    """Rate [Hz] at which the vehicle's position estimate is sent to its autopilot."""
    parameters: dict[ParameterName, float] = Field(default={})
    """Parameters of the autopilot that this drone needs otherwise than `groundstation mavlink setup` proposes, or
    besides, by name; the driver warns of the former."""
    forward: Forward = ""
    """A second ground station that sees the vehicle, such as udp:127.0.0.1:14550 for QGroundControl. It may stop the
    vehicle and ask it questions, never fly it. Empty: none."""
    forward_allows: tuple[Literal["parameters", "missions"], ...] = ()
    """What that ground station may read and write besides."""


def _own(order: VehicleOrder) -> Mavlink:
    section = order.sections.get("mavlink")
    if not isinstance(section, Mavlink):
        raise SettingsError([f"kind: {order.drone.kind} has no mavlink section"])
    return section


def _processes(orders: Sequence[VehicleOrder]) -> list[DriverProcess]:
    links: dict[object, list[VehicleOrder]] = {}  # those that call the same port share a process
    for order in orders:
        mavlink = _own(order)
        shared = (mavlink.port, order.drone.interface)
        links.setdefault(shared if mavlink.listen else order.name, []).append(order)
    return [
        DriverProcess(tuple(one.name for one in group), _settings(group).model_dump_json()) for group in links.values()
    ]


def _settings(orders: Sequence[VehicleOrder]) -> MavlinkDriverSettings:
    first, mavlink = orders[0], _own(orders[0])
    return MavlinkDriverSettings(
        link=LinkSettings(kind=mavlink.link, target=_target(first, mavlink), key_file=mavlink.key_file),
        vehicles=tuple(_vehicle(order) for order in orders),
        safety=silence_limits(first),
        vision=VisionFeedback(rate_hz=mavlink.vision_hz),
        raw_datagrams=first.raw_datagrams,
    )


def _target(order: VehicleOrder, mavlink: Mavlink) -> str:
    if mavlink.serial:
        return f"serial:{mavlink.serial}"
    if mavlink.listen:
        return f"udpin:{with_zone(mavlink.local_address, order.drone.interface)}:{mavlink.port}"
    return f"udpout:{with_zone(order.drone.address, order.drone.interface)}:{mavlink.port}"


def _vehicle(order: VehicleOrder) -> VehicleSettings:
    drone, mavlink = order.drone, _own(order)
    return VehicleSettings(
        name=order.name,
        system_id=mavlink.system_id,
        flavour=mavlink.flavour,
        serial_number=drone.serial_number,
        pad_m=drone.pad_m,
        pad_yaw_rad=drone.pad_yaw_rad,
        limits=vehicle_limits(drone.limits),
        take_off_m=mavlink.take_off_m,
        parameters=mavlink.parameters,
        forward=mavlink.forward,
        forward_allows=mavlink.forward_allows,
        velocity_std_m_s=drone.odometry.velocity_std_m_s,
        attitude_std_rad=drone.odometry.attitude_std_rad,
    )


def _stop(orders: Sequence[VehicleOrder]) -> StopDatagrams:
    # Only here: pymavlink's dialect is slow to load.
    from drivers.mavlink.failsafe import HOVERS_S, heartbeat, hover_and_land

    mavlink = _own(orders[0])
    signed = bool(mavlink.key_file)
    hover, land = hover_and_land([_own(order).system_id for order in orders], signed=signed)
    places = {"serial": mavlink.serial, "key_file": mavlink.key_file, "interface": orders[0].drone.interface}
    way = json.dumps(places | {"heartbeat": heartbeat(signed=signed).hex()})
    return StopDatagrams(mavlink.port, hover, land, _TRANSPORT, way, mavlink.listen, HOVERS_S)


def _check(orders: Sequence[VehicleOrder]) -> Iterator[tuple[str, Finding]]:
    systems: dict[int, str] = {}
    shared: dict[tuple[int, str], tuple[str, tuple[str, str, str]]] = {}
    for order in orders:
        name, mavlink = order.name, _own(order)
        wrong = list(_way(order.drone.address, mavlink))
        yield from ((name, (("mavlink", key), text)) for key, text in wrong)
        if mavlink.serial and order.drone.interface:
            yield name, (("interface",), "has no meaning on a serial line")
        if mavlink.serial and not wrong and (text := _of_line(order, "fault")):
            yield name, (("mavlink", "serial"), text)
        if (other := systems.setdefault(mavlink.system_id, name)) != name:
            yield name, (("mavlink", "system_id"), f"system id {mavlink.system_id} is already that of {other}")
        how = (mavlink.link, mavlink.key_file, mavlink.local_address)
        port = (mavlink.port, order.drone.interface)
        if mavlink.listen and shared.setdefault(port, (name, how))[1] != how:
            text = f"is shared with {shared[port][0]}, which is reached otherwise"
            yield name, (("mavlink", "port"), text)


def _cautions(orders: Sequence[VehicleOrder]) -> Iterator[tuple[str, Finding]]:
    for order in orders:
        if _own(order).serial and (text := _of_line(order, "caution")):
            yield order.name, (("mavlink", "serial"), text)


def _of_line(order: VehicleOrder, judged: Literal["fault", "caution"]) -> str:
    # Only here: pymavlink's dialect is slow to load.
    from drivers.mavlink import line_load

    settings = _settings([order])
    return line_load.fault(settings) if judged == "fault" else line_load.caution(settings)


def _way(address: str, mavlink: Mavlink) -> Iterator[tuple[str, str]]:
    hosts = ("127.0.0.1", mavlink.local_address) if mavlink.listen else (address,)
    if not mavlink.serial and mavlink.forward in {f"udp:{host}:{mavlink.port}" for host in hosts}:
        yield "forward", "is the vehicle's own link, which would hear itself: give the second ground station its own"
    if mavlink.key_file and mavlink.link == "mavsdk":
        yield "link", "must be pymavlink for a signed link: MAVSDK cannot sign"
    elif mavlink.serial and mavlink.listen:
        yield "listen", "has no meaning on a serial line"


def _moved(local_address: str, sections: Mapping[str, KindSection]) -> dict[str, dict[str, object]]:
    # Vehicles that call us do so within the simulated network; there are no serial lines in it.
    return {"mavlink": {"local_address": local_address, "serial": ""}}


def _offer(flavour: str, title: str) -> Offer:
    odometry = "velocity_std_m_s: 0.05, velocity_delay_ms: 10, attitude_std_deg: 0.3, yaw_rate_std_deg_s: 0.07"
    of_type = f"    mavlink: {{flavour: {flavour}}}\n    odometry: {{{odometry}}}\n"
    return Offer(title, of_type, "    mavlink: {system_id: {id}}\n")


# The error of a PX4's velocity changes by 0.09 m/s per axis in half a second, by 0.15 in one and by 0.19 in two
# (docs/reference/mavlink.md 2.1).
_HABITS = ErrorHabits(
    5.0,
    10.0,
    2.0,
    0.05,
    0.0,
    reports_climb=True,
    tells_attitude=True,
    flies_on_estimate=True,
    velocity_walk=0.15,
    fastest_m_s=FASTEST_M_S,
)
# It flies on our estimate: it has no height of its own to report; its velocity follows our errors with its filter's
# time constant.
KIND = VehicleKind(
    name="mavlink",
    summary="vehicles with a PX4 or ArduPilot autopilot",
    driver="drivers.mavlink.driver:run",
    habits=_HABITS,
    processes=_processes,
    stop=_stop,
    sections={"mavlink": Mavlink},
    required=frozenset({"mavlink"}),
    has_serial_number=True,
    has_interface=True,
    take_off=("mavlink", "take_off_m"),
    blink="drivers.mavlink.blink:blink",
    check=_check,
    cautions=_cautions,
    moved=_moved,
    emulator="sim_bridge.devices.mavlink_emulation:EMULATION",
    scenario={"mavlink": "sim_bridge.mavlink_scenario:CopterScenario"},
    true_pose="sim_bridge.real.mavlink_truth:of_drone",
    example={"mavlink": {"flavour": "px4", "system_id": 1}},
    offers={"px4": _offer("px4", "PX4"), "ardupilot": _offer("ardupilot", "ArduPilot")},
    commands=KindCommands(
        "groundstation.cli.mavlink:mavlink", "Probe MAVLink vehicles, check and set them.", ("probe", "setup")
    ),
)
