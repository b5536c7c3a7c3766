"""The description of a kind of vehicle: one object for settings, supervisor, estimator and simulator.

The object is light: drivers and emulators are named as "module:attribute" and loaded by the process that runs them.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TypeVar

from pydantic import BaseModel, ConfigDict

from groundstation.field.behaviour import SafetyValues
from groundstation.field.drones import FieldDrone
from groundstation.field.room import Fence

# Path of keys below the drone in the field file, and the fault there.
Finding = tuple[tuple[str | int, ...], str]


class KindSection(BaseModel):
    """Base of a kind's own section in the field file: frozen, strict, closed; text below a key is its description."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, use_attribute_docstrings=True
    )


_Section = TypeVar("_Section", bound=KindSection)
_NONE: Mapping[str, KindSection] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class ErrorHabits:
    """Time constants of a kind's errors [s], and the error of its climb rate [m/s; of its highest: share].

    tells_attitude: its own attitude is better than ours from its IMU. flies_on_estimate: it flies on our
    estimate, which the tracker must have before it lifts off. tells_steps: its velocities and angles come in steps
    so coarse that they repeat while it hovers; its driver must find frozen ones. velocity_walk: by how much the
    error of its velocity changes while no camera sees it [m/s per root second]. fastest_m_s: faster reports are no
    measurement, and not used.
    """

    velocity_s: float
    attitude_s: float
    climb_s: float
    climb_m_s: float
    climb_share: float
    reports_climb: bool
    tells_attitude: bool
    flies_on_estimate: bool = False
    tells_steps: bool = False
    velocity_walk: float = 0.0
    fastest_m_s: float = math.inf


@dataclass(frozen=True, slots=True)
class VehicleOrder:
    """The order that a kind gets for one drone of a field.

    index: its place among all drones; sections: those keys of the field file that only its kind has, None left out;
    top_m: of the fence; raw_datagrams: whether they are recorded. fence: that of the field; None: that is unknown.
    """

    name: str
    index: int
    drone: FieldDrone
    safety: SafetyValues
    top_m: float
    raw_datagrams: bool
    sections: Mapping[str, KindSection] = field(default_factory=lambda: _NONE)
    fence: Fence | None = None

    def section(self, key: str, default: _Section) -> _Section:
        """Return a section of the kind's own, or the default if the field file has none."""
        own = self.sections.get(key)
        return own if isinstance(own, type(default)) else default


@dataclass(frozen=True, slots=True)
class DriverProcess:
    """A driver process: its vehicles (it is named after the first), and its section as JSON."""

    vehicles: tuple[str, ...]
    section: str


@dataclass(frozen=True, slots=True)
class StopDatagrams:
    """Datagrams that stop and land vehicles whose driver is dead, in their own protocol, and their port.

    hover must never lift a standing vehicle. transport, way, called: as in supervisor.process_spec.FailsafeDatagrams.
    hovers_s: for how long it can hover without its driver [s]; land is sent after that at the latest.
    """

    port: int
    hover: bytes
    land: bytes
    transport: str = ""
    way: str = ""
    called: bool = False
    hovers_s: float = math.inf


@dataclass(frozen=True, slots=True)
class Offer:
    """Text of `groundstation new` for a type of this kind and for each drone of it, beside the keys of all drones.

    title: its name for people, "" to use its word. of_type, of_drone: YAML, indented by four; pictures: the
    address of its camera's. {address} is the drone's own, {id} a number that no other drone has. address: that of a
    new vehicle of the type, if it is an access point and a team has one of them.
    """

    title: str = ""
    of_type: str = ""
    of_drone: str = ""
    pictures: str = "http://{address}:8080/video.mjpg"
    address: str = ""


@dataclass(frozen=True, slots=True)
class KindCommands:
    """A kind's own commands, `groundstation NAME ...`: "module:attribute" of a click group, and its line in the help.

    words: names of its commands that people look for one level up.
    """

    target: str
    summary: str
    words: tuple[str, ...] = ()


def _no_findings(orders: Sequence[VehicleOrder]) -> Iterator[tuple[str, Finding]]:
    return iter(())


def _nothing_moves(local_address: str, sections: Mapping[str, KindSection]) -> dict[str, dict[str, object]]:
    return {}


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleKind:
    """One kind of vehicle.

    name: the word for `kind` in the field file. summary: a line for people. driver: "module:function" of the driver
    process. sections: keys of the field file that only this kind has; required: those that must be given.
    processes: vehicles that share a driver process, with its settings; stop: datagrams to vehicles of one dead process.
    check: (drone, finding) for each fault between the sections of this kind; cautions: likewise for what is permitted
    but unwise, of vehicles without faults. standing_m: height of the base above the
    floor before take-off, and its deviation; the default suits small vehicles. camera: scheme of the vehicle's own
    video, "" if it has none; camera_port: its usual port; reader: "module:attribute" of its
    source, called with address and interface like the sources of `drivers.camera`. has_serial_number: the
    driver knows the vehicle's own. has_interface: driver and failsafe datagrams use the drone's network adapter
    and no other. shares_address: its vehicles may have one address, and `check` tells them apart. moved: changes of
    sections in a simulated network, where this computer has the local address. emulator: "module:attribute" of a
    sim_bridge.world.emulation.Emulation, "" if there is none. example: content of a field file for one in its
    sections; the conformance kit flies that one. offers: types of it by name for `groundstation new`; none: one
    with the sections of the example. commands: its own part of the command line. emulated_faults: faults of a
    scenario that its emulator can have and others cannot; emulated_firmwares: names that a scenario may give its
    firmware; scenario: sections of a scenario file that only its emulator reads, each as "module:class" of a
    sim_bridge.section.Section. true_pose: "module:function" of a receiver of true poses from the simulator behind a
    real firmware (a sim_bridge.real.followers.PoseFeed), "" if there is none. blink: "module:function" that
    makes a standing vehicle visible or audible, called with its driver's section and its name, returns a text on it and
    raises DriverError; "" if it cannot. take_off: height of its take-off [m]: (section, key) where the field file says
    it, a number where its firmware does, None if nobody knows. flight_time_s: longest flight time with a new battery of
    the usual size, None where vehicles of one kind differ or it is unknown.
    """

    name: str
    summary: str
    driver: str
    habits: ErrorHabits
    processes: Callable[[Sequence[VehicleOrder]], list[DriverProcess]]
    stop: Callable[[Sequence[VehicleOrder]], StopDatagrams]
    sections: Mapping[str, type[KindSection]] = field(default_factory=dict)
    required: frozenset[str] = frozenset()
    check: Callable[[Sequence[VehicleOrder]], Iterator[tuple[str, Finding]]] = _no_findings
    cautions: Callable[[Sequence[VehicleOrder]], Iterator[tuple[str, Finding]]] = _no_findings
    standing_m: tuple[float, float] = (0.08, 0.04)
    camera: str = ""
    camera_port: int = 0
    reader: str = ""
    has_serial_number: bool = False
    has_interface: bool = False
    shares_address: bool = False
    moved: Callable[[str, Mapping[str, KindSection]], dict[str, dict[str, object]]] = _nothing_moves
    emulator: str = ""
    example: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    offers: Mapping[str, Offer] = field(default_factory=dict)
    commands: KindCommands | None = None
    emulated_faults: frozenset[str] = frozenset()
    emulated_firmwares: tuple[str, ...] = ()
    scenario: Mapping[str, str] = field(default_factory=dict)
    true_pose: str = ""
    blink: str = ""
    take_off: tuple[str, str] | float | None = None
    flight_time_s: float | None = None
