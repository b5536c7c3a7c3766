"""The resolved field: room, team, targets and behaviour."""

from collections.abc import Mapping
from typing import Any, Literal

import msgspec

from groundstation.field.behaviour import (
    BusValues,
    ConsoleValues,
    EstimatorValues,
    PlannerValues,
    RecordingValues,
    SafetyValues,
)
from groundstation.field.drones import FieldDrone, camera_name, gathered
from groundstation.field.room import LensCalibration, MotionCapture, Ranging, Room, Volume, WorldCamera, ranging_link
from groundstation.field.targets import SingleTarget, Target, WeightedTarget, odometry_name


class ResolvedField(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A fully merged field: all its drones fly; it has a `target` or `targets`."""

    schema_version: Literal[1] = 1
    site: str
    room: Room
    cameras: dict[str, WorldCamera] = {}
    motion_capture: dict[str, MotionCapture] = {}
    ranging: dict[str, Ranging] = {}
    truth: dict[Literal["from"], str] = {}
    drones: dict[str, FieldDrone]
    target: SingleTarget | None = None
    targets: dict[str, WeightedTarget] = {}
    estimator: EstimatorValues = EstimatorValues()
    planner: PlannerValues
    safety: SafetyValues = SafetyValues()
    recording: RecordingValues = RecordingValues()
    console: ConsoleValues = ConsoleValues()
    bus: BusValues = BusValues()

    @property
    def tracked(self) -> Mapping[str, Target]:
        """Return the targets by name, in the file's order."""
        return self.targets if self.target is None else {self.target.name: self.target}

    @property
    def reporting(self) -> tuple[str, ...]:
        """Return the names on the bus of the drivers of targets' own odometry."""
        return tuple(odometry_name(name) for name, target in self.tracked.items() if target.odometry is not None)

    @property
    def sensing_capture(self) -> Mapping[str, MotionCapture]:
        """Return the motion capture systems that are sensors of the tracker: all but the truth."""
        return {name: one for name, one in self.motion_capture.items() if name != self.truth.get("from")}

    @property
    def volumes(self) -> dict[str, Volume]:
        """Return the box of each motion capture system and ranging system by name."""
        boxes = {name: one.volume_m for name, one in self.motion_capture.items()}
        return boxes | {name: one.volume_m for name, one in self.ranging.items()}

    @property
    def ranging_links(self) -> dict[str, str]:
        """Return the ranging system of each pair of an anchor and a robot, by the estimator's name of the pair."""
        return {
            ranging_link(name, anchor, robot): name
            for name, system in self.ranging.items()
            for anchor in system.anchors
            for robot in self.drones
        }

    @property
    def world_sensors(self) -> tuple[str, ...]:
        """Return the names of the sensors fixed in the world: cameras, motion capture, ranging."""
        return (*self.cameras, *self.sensing_capture, *self.ranging)

    @property
    def calibrations(self) -> dict[str, LensCalibration]:
        """Return the lens of each camera by its name on the bus."""
        fixed = {name: camera.calibration for name, camera in self.cameras.items()}
        return fixed | {camera_name(name): drone.camera.calibration for name, drone in self.drones.items()}


def field_from_json(content: bytes) -> ResolvedField:
    """Return a resolved field from JSON; keys newer than the text have their defaults.

    Raises msgspec.DecodeError that names the key at fault.
    """
    return field_from_values(msgspec.json.decode(content))


def field_from_values(content: Any) -> ResolvedField:
    """Return a resolved field from decoded JSON; raises msgspec.ValidationError that names the key at fault."""
    drones = content.get("drones") if isinstance(content, dict) else None
    if isinstance(drones, dict):
        content = {**content, "drones": {name: gathered(drone) for name, drone in drones.items()}}
    return msgspec.convert(content, ResolvedField)
