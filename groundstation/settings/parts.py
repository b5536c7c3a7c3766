"""The sections of a field file without errors of their own, and the findings of checks between them."""

from dataclasses import dataclass, field

from groundstation.settings.behaviour import Bus, EstimatorSettings, PlannerSettings, SafetySettings
from groundstation.settings.document import KeyPath
from groundstation.settings.drones import Drone
from groundstation.settings.motion_capture import MotionCaptureSettings
from groundstation.settings.ranging import RangingSettings
from groundstation.settings.room import RoomSettings, WorldCameraSettings
from groundstation.settings.target import OneOfTargets, TargetSettings, TrackedBody

Finding = tuple[KeyPath, str]
"""The path at fault, and the fault."""


@dataclass(frozen=True, slots=True)
class Parts:
    """The sections without errors of their own; a check is left out if one that it needs is missing.

    truth: the sensor that judges; given, bodies: the names of all sensors fixed in the world, and of all drones and
    targets, faulty entries included.
    """

    room: RoomSettings | None = None
    cameras: dict[str, WorldCameraSettings] = field(default_factory=dict)
    motion_capture: dict[str, MotionCaptureSettings] = field(default_factory=dict)
    ranging: dict[str, RangingSettings] = field(default_factory=dict)
    truth: str | None = None
    given: frozenset[str] = frozenset()
    bodies: frozenset[str] = frozenset()
    drones: dict[str, Drone] = field(default_factory=dict)
    target: TargetSettings | None = None
    targets: dict[str, OneOfTargets] = field(default_factory=dict)
    estimator: EstimatorSettings | None = None
    planner: PlannerSettings | None = None
    safety: SafetySettings | None = None
    bus: Bus | None = None

    @property
    def tracked(self) -> dict[KeyPath, tuple[str, TrackedBody]]:
        """Return name and settings of each target by its path in the file."""
        several: dict[KeyPath, tuple[str, TrackedBody]] = {("targets", n): (n, one) for n, one in self.targets.items()}
        return several if self.target is None else {("target",): (self.target.name, self.target), **several}

    @property
    def flying(self) -> dict[str, Drone]:
        """Return the drones that are enabled."""
        return {name: drone for name, drone in self.drones.items() if drone.enabled}
