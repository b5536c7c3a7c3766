"""Interfaces of a kind of vehicle to the simulator: its body, its sensors, its emulator at the wire."""

from collections.abc import Callable
from pkgutil import resolve_name
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from groundstation.errors import SettingsError
from groundstation.vectors import Vector3
from groundstation.vehicles import kind_named
from sim_bridge.launch_spec import LaunchSpec
from sim_bridge.own_video import OwnVideo
from sim_bridge.scenario import Scenario
from sim_bridge.site import SiteDrone
from sim_bridge.world.airframe import Airframe


class Motors(Protocol):
    """The part that turns the propellers."""

    @property
    def motors_on(self) -> bool:
        """Return whether they turn."""


class Body(Protocol):
    """A vehicle of the room. battery: share of the full charge; wind: push of a fault's wind [m/s^2; world].

    A method `sense`, if it has one, is called after each step, with walls applied, to take its readings. Bodies
    with the same `ultrasound_code` disturb each other's ultrasound.
    """

    airframe: Airframe
    battery: float
    wind: tuple[float, float]

    @property
    def autopilot(self) -> Motors:
        """Return the part that turns its propellers."""

    @property
    def airborne(self) -> bool:
        """Return whether it has no contact with the floor."""

    def step(self, wake: Vector3) -> None:
        """Advance by one tick under the wake of the others [m/s^2; world]."""

    def wake_on(self, other: Airframe) -> Vector3 | None:
        """Return the acceleration of a body below by its downwash, None out of its reach."""


class Emulator(Protocol):
    """A vehicle at its sockets: `receive`, a step of the world, then `send`, once per tick of 5 ms.

    silent: sends nothing; deaf: obeys nothing (faults).
    """

    silent: bool
    deaf: bool

    def fileno(self) -> int:
        """Return the descriptor that becomes readable when input arrives."""

    def receive(self) -> None:
        """Take all waiting input, without blocking."""

    def send(self) -> None:
        """End a tick: send due output."""

    def close(self) -> None:
        """Close the ports."""


class Emulation(Protocol):
    """How one kind of vehicle is emulated; `groundstation.vehicles.VehicleKind.emulator` names it.

    Optional: `video(name, scenario)`, the `sim_bridge.own_video.OwnVideo` of a kind that has its own (its
    emulators then have `video_settings`, a tuple of its configuration's settings), and the methods of
    `KeepsSensors`.
    """

    def body(self, drone: SiteDrone, scenario: Scenario, tick_s: float, rng: np.random.Generator) -> Body:
        """Return a vehicle that stands on its pad."""

    def open(self, name: str, body: Any, onboard: Any, order: LaunchSpec) -> Emulator:
        """Return the listening emulator of a body that `body` made; raises GroundStationError for a taken port.

        onboard: its sensors, if the world keeps them, else None.
        """


def emulation_of(kind: str) -> Emulation:
    """Return the emulation of a kind of vehicle; raises SettingsError naming a kind without one."""
    reference = kind_named(kind).emulator
    if not reference:
        raise SettingsError([f"kind: {kind} has no emulator: it cannot be simulated"])
    try:
        emulation: Emulation = resolve_name(reference)
    except (ImportError, AttributeError, ValueError) as error:
        raise SettingsError([f"kind: {kind}: its emulator {reference} cannot be loaded: {error}"]) from error
    return emulation


class Around(NamedTuple):
    """Disturbances of a vehicle's sensors in this tick.

    crosstalk: another vehicle's ultrasound of this rate is in reach; flow_bias: by the floor below [m/s; world], and
    below_m: height of the surface there; None if the scenario has no such thing.
    """

    crosstalk: bool = False
    flow_bias: tuple[float, float] | None = None
    below_m: float | None = None


@runtime_checkable
class KeepsSensors(Protocol):
    """An emulation whose sensors the world keeps, beside their bodies, in `onboard`."""

    def sensors(self, name: str, body: Any, scenario: Scenario, tick_s: float, rng: np.random.Generator) -> Any:
        """Return the sensors of a body that `body` made."""

    def sense(self, body: Any, onboard: Any, around: Around) -> None:
        """Take their readings, after each step."""


def video_of(kind: str, name: str, scenario: Scenario) -> OwnVideo | None:
    """Return the own video of one vehicle, None if its emulation has none."""
    video: Callable[[str, Scenario], OwnVideo] | None = getattr(emulation_of(kind), "video", None)
    return None if video is None else video(name, scenario)


def video_settings_of(emulator: Emulator) -> tuple[object, ...] | None:
    """Return the settings of a vehicle's own video by its configuration, None if there are none."""
    settings: tuple[object, ...] | None = getattr(emulator, "video_settings", None)
    return settings


def senses_of(body: Body) -> Callable[[], None] | None:
    """Return the method by which a body takes its readings, None if the world keeps its sensors."""
    return getattr(body, "sense", None)
