"""The resolved field: what every process may know of the room, the team and how it is to behave."""

from typing import Annotated, Literal

from pydantic import Field as Constraint

from groundstation.settings.behaviour import Console, Estimator, Planner, Recording, Safety
from groundstation.settings.drones import Drone
from groundstation.settings.room import Room, WorldCamera
from groundstation.settings.target import OneOfTargets, Target, TrackedBody
from groundstation.settings.values import Name, Section

SCHEMA_VERSION: Literal[1] = 1


class Field(Section):
    """A field file after its three levels are merged and its calibrations read in; it has a `target` or `targets`.

    Travels to other processes as JSON: `Field.model_validate_json(field.model_dump_json())` is the same field.
    """

    schema_version: Literal[1] = SCHEMA_VERSION
    site: Name
    room: Room
    cameras: Annotated[dict[Name, WorldCamera], Constraint(min_length=1)]
    drones: Annotated[dict[Name, Drone], Constraint(min_length=1)]
    target: Target | None = None
    targets: dict[Name, OneOfTargets] = Constraint(default_factory=dict)
    estimator: Estimator = Estimator()
    planner: Planner
    safety: Safety = Safety()
    recording: Recording = Recording()
    console: Console = Console()

    @property
    def tracked(self) -> dict[str, TrackedBody]:
        """Return the targets by name, in the file's order."""
        return dict(self.targets) if self.target is None else {self.target.name: self.target}
