"""The resolved field: room, team, target and behaviour, as every process gets them."""

from typing import Annotated, Literal, Self

from pydantic import Field as Constraint
from pydantic import model_validator

from groundstation.settings.behaviour import (
    Bus,
    Console,
    EstimatorSettings,
    PlannerSettings,
    RecordingSettings,
    SafetySettings,
)
from groundstation.settings.drones import Drone
from groundstation.settings.level_heights import LevelRows, derived_heights
from groundstation.settings.motion_capture import MotionCaptureSettings, VolumeSettings
from groundstation.settings.ranging import RangingSettings
from groundstation.settings.room import RoomSettings, WorldCameraSettings
from groundstation.settings.target import OneOfTargets, TargetSettings, TrackedBody
from groundstation.settings.values import Name, SettingsSection

SCHEMA_VERSION: Literal[1] = 1


class Field(SettingsSection):
    """A field file after its three levels are merged and its calibrations read in; it has a `target` or `targets`.

    Travels to other processes as JSON: `Field.model_validate_json(field.model_dump_json())` is the same field, but for
    the passwords of camera sources, which are in no dump.
    """

    schema_version: Literal[1] = SCHEMA_VERSION
    """Version of the file format."""
    site: Name
    """Name of the place. It is part of every key on the bus and of every run folder."""
    room: RoomSettings
    """The room and its fence."""
    cameras: dict[Name, WorldCameraSettings] = Constraint(default_factory=dict)
    """Cameras fixed in the world, by name. Every sensing topology starts from what is fixed in the world: a camera, a
    motion capture system or a ranging system at least."""
    motion_capture: dict[Name, MotionCaptureSettings] = Constraint(default_factory=dict)
    """Motion capture systems, by name."""
    ranging: dict[Name, RangingSettings] = Constraint(default_factory=dict)
    """Ranging systems (UWB and other radios), by name."""
    truth: dict[Literal["from"], Name] = Constraint(default_factory=dict)
    """The truth that judges a flight: `from`, the name of a motion capture system. It is recorded, reports have the
    estimate's errors against it, and the tracker does not receive it."""
    drones: Annotated[dict[Name, Drone], Constraint(min_length=1)]
    """The drones, by name."""
    target: TargetSettings | None = None
    """The one target; for several, targets."""
    targets: dict[Name, OneOfTargets] = Constraint(default_factory=dict)
    """Several targets by name, in place of target."""
    estimator: EstimatorSettings = EstimatorSettings()
    """The joint estimator."""
    planner: PlannerSettings = PlannerSettings()
    """How the planner searches for the topology and the velocities."""
    safety: SafetySettings = SafetySettings()
    """Least distances, and how long a drone flies on without setpoints or sightings."""
    recording: RecordingSettings = RecordingSettings()
    """What is recorded of a run."""
    console: Console = Console()
    """The operator's web page."""
    bus: Bus = Bus()
    """The router of the run's messages."""

    @model_validator(mode="after")
    def _with_level_heights(self) -> Self:
        """Write down the heights that follow from room and targets, so that every reader of the field has them."""
        if not self.planner.level_heights_m:
            object.__setattr__(self, "planner", self.planner.model_copy(update={"level_heights_m": self._heights()}))
        return self

    def _heights(self) -> LevelRows:
        team = sum(drone.enabled for drone in self.drones.values())
        return derived_heights(self.room.fence.z_m[1], self.highest_target_m, self.planner.planned_range_m, team)

    @property
    def highest_target_m(self) -> float:
        """Return the height of the highest target's marker [m]."""
        return max((one.marker.height_m for one in self.tracked.values()), default=0.0)

    @property
    def volumes(self) -> dict[str, VolumeSettings]:
        """Return the box of each motion capture system and ranging system by name."""
        boxes = {name: one.volume_m for name, one in self.motion_capture.items()}
        return boxes | {name: one.volume_m for name, one in self.ranging.items()}

    @property
    def tracked(self) -> dict[str, TrackedBody]:
        """Return the targets by name, in the file's order."""
        return dict(self.targets) if self.target is None else {self.target.name: self.target}
