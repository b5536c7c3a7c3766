"""The team of a forecast: its drones and cameras, also without those that fail."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from groundstation.field.resolved import ResolvedField
from groundstation.forecast.ranged_places import RangedPlaces
from groundstation.planning.parameters import PlannerParameters, parameters_from_field
from groundstation.sensing.from_field import sensors_from_field
from groundstation.sensing.models import SensorSuite

Place = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Team:
    """Drones with their cameras, and the target that all track.

    others: the field's other targets; ranging: the places that each ranging system tells, by its name.
    """

    robots: tuple[str, ...]
    target: str
    others: tuple[str, ...]
    sensors: SensorSuite
    planner: PlannerParameters
    ranging: Mapping[str, RangedPlaces] = field(default_factory=dict)

    def without_sensor(self, name: str) -> "Team":
        """Return the team when one camera, of a drone or fixed in the room, shows nothing."""
        world = {one: model for one, model in self.sensors.world.items() if one != name}
        onboard = {one: model for one, model in self.sensors.onboard.items() if one != name}
        return replace(self, sensors=replace(self.sensors, world=world, onboard=onboard))

    def without_robot(self, name: str) -> "Team":
        """Return the team when one drone has landed."""
        left = self.without_sensor(name)
        return replace(left, robots=tuple(one for one in self.robots if one != name))


def team_of(resolved: ResolvedField, target: str = "") -> Team:
    """Return the whole team of a field, with one of its targets ("": the first)."""
    target = target or next(iter(resolved.tracked))
    others = tuple(name for name in resolved.tracked if name != target)
    ranging = {name: RangedPlaces(system) for name, system in resolved.ranging.items()}
    sensors, planner = sensors_from_field(resolved), parameters_from_field(resolved)
    return Team(tuple(resolved.drones), target, others, sensors, planner, ranging)
