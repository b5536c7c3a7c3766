"""The team of a forecast: its drones and cameras, also without those that fail."""

from dataclasses import dataclass, replace

from groundstation.field.resolved import ResolvedField
from groundstation.planning.parameters import PlannerParameters, parameters_from_field
from groundstation.sensing.from_field import sensors_from_field
from groundstation.sensing.models import SensorSuite

Place = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Team:
    """Drones with their cameras, and the target that all track; others: the field's other targets."""

    robots: tuple[str, ...]
    target: str
    others: tuple[str, ...]
    sensors: SensorSuite
    planner: PlannerParameters

    def without_sensor(self, name: str) -> "Team":
        """Return the team when one camera, of a drone or fixed in the room, shows nothing."""
        world = {one: model for one, model in self.sensors.world.items() if one != name}
        onboard = {one: model for one, model in self.sensors.onboard.items() if one != name}
        return replace(self, sensors=replace(self.sensors, world=world, onboard=onboard))

    def without_robot(self, name: str) -> "Team":
        """Return the team when one drone has landed."""
        left = self.without_sensor(name)
        return replace(left, robots=tuple(one for one in self.robots if one != name))


def team_of(field: ResolvedField, target: str = "") -> Team:
    """Return the whole team of a field, with one of its targets ("": the first)."""
    target = target or next(iter(field.tracked))
    others = tuple(name for name in field.tracked if name != target)
    return Team(tuple(field.drones), target, others, sensors_from_field(field), parameters_from_field(field))
