"""Paths of simulated targets: sections of a scenario."""

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from sim_bridge.section import Section

Place = Annotated[float, Field(ge=-100, le=100)]
Speed = Annotated[float, Field(gt=0, le=5)]


def rising(interval: tuple[float, float]) -> tuple[float, float]:
    """Return a range; raises PydanticCustomError where its ends are exchanged."""
    if interval[0] > interval[1]:
        raise PydanticCustomError("rising", "the first number of a range must not exceed the second")
    return interval


Side = Annotated[tuple[Place, Place], AfterValidator(rising)]
Turn = Annotated[float, Field(ge=0, le=180)]
Duration = Annotated[float, Field(ge=0, le=600)]


class FigureEight(Section):
    """A figure of eight (lemniscate) along world x, driven at constant speed."""

    shape: Literal["figure_eight"] = "figure_eight"
    """Form of the path."""
    half_length_m: Annotated[float, Field(gt=0, le=50)] = 3.2
    """Half of its length along world x [m]."""
    half_width_m: Annotated[float, Field(gt=0, le=50)] = 0.8
    """Half of its width along world y [m]."""
    speed_m_s: Speed = 0.2
    """Speed along the path [m/s]."""
    start_phase: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Where the target starts [turns]; 0: at the centre, heading to +x and +y."""
    centre_m: tuple[Place, Place] = (0.0, 0.0)
    """Centre of the path [x, y in m; world]."""


class Standstill(Section):
    """A target that stands still until it is steered over `@sim`."""

    shape: Literal["none"] = "none"
    """Form of the path."""
    position_m: tuple[Place, Place] = (0.0, 0.0)
    """Where the target stands [x, y in m; world]."""
    yaw_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0
    """Its heading [deg; world], counter-clockwise."""


class Anywhere(Section):
    """A target that stands still somewhere on the floor: where, and which way it looks, is drawn from the seed."""

    shape: Literal["anywhere"] = "anywhere"
    """Form of the path."""
    clear_m: Annotated[float, Field(ge=0, le=10)] = 0.5
    """Least distance of its centre from walls, pads and obstacles that stand [m]."""


class Waypoints(Section):
    """From point to point in straight lines, turning on the spot at each."""

    shape: Literal["waypoints"] = "waypoints"
    """Form of the path."""
    points_m: Annotated[tuple[tuple[Place, Place], ...], Field(min_length=2)]
    """The points [x, y in m; world]; the target starts at the first, heading for the second."""
    speed_m_s: Speed = 0.3
    """Speed towards each point [m/s]."""
    speeds_m_s: tuple[Speed, ...] = ()
    """Speed towards each single point [m/s], in their order; none: speed_m_s."""
    pause_s: Duration = 0.0
    """How long the target stands at each point [s]."""
    after_last: Literal["stop", "first", "back"] = "first"
    """After the last point: stop, go on to the first, or go back through them all."""

    @model_validator(mode="after")
    def _one_speed_each(self) -> Self:
        if self.speeds_m_s and len(self.speeds_m_s) != len(self.points_m):
            raise PydanticCustomError("speeds", "speeds_m_s needs one speed for each of points_m")
        return self


class RandomWalk(Section):
    """A wandering heading at constant speed, within an area."""

    shape: Literal["random_walk"] = "random_walk"
    """Form of the path."""
    speed_m_s: Speed = 0.3
    """Speed [m/s]."""
    turn_rate_std_deg_s: Annotated[float, Field(gt=0, le=360)] = 45.0
    """Standard deviation of the turn rate [deg/s]."""
    turn_correlation_s: Annotated[float, Field(gt=0, le=100)] = 1.5
    """Correlation time of the turn rate [s]."""
    start_m: tuple[Place, Place] = (0.0, 0.0)
    """Where the target starts [x, y in m; world]; its heading is random."""
    x_m: Side = (-2.8, 2.8)
    """Area along world x [m]."""
    y_m: Side = (-1.8, 1.8)
    """Area along world y [m]."""


class Sprint(Section):
    """Straight legs at full speed with sharp turns on the spot between them, within an area."""

    shape: Literal["sprint"] = "sprint"
    """Form of the path."""
    speed_m_s: Speed = 0.5
    """Speed on the legs [m/s]."""
    leg_s: Annotated[tuple[Duration, Duration], AfterValidator(rising)] = (1.5, 4.0)
    """How long a leg lasts [s], drawn from this range."""
    turn_deg: Annotated[tuple[Turn, Turn], AfterValidator(rising)] = (60.0, 150.0)
    """By how much the target turns between legs [deg], to either side."""
    reverse_share: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Share of the legs that it backs out of the last one instead of turning."""
    pause_s: Duration = 0.0
    """How long it stands between legs [s]."""
    start_m: tuple[Place, Place] = (0.0, 0.0)
    """Where the target starts [x, y in m; world]; its heading is random."""
    x_m: Side = (-2.8, 2.8)
    """Area along world x [m]."""
    y_m: Side = (-1.8, 1.8)
    """Area along world y [m]."""


class AlongWalls(Section):
    """Round the room along its walls."""

    shape: Literal["along_walls"] = "along_walls"
    """Form of the path."""
    speed_m_s: Speed = 0.3
    """Speed [m/s]."""
    from_wall_m: Annotated[float, Field(gt=0, le=10)] = 0.5
    """Distance from the walls [m]."""
    start_corner: Annotated[int, Field(ge=0, le=3)] = 0
    """In which corner the target starts; 0: that of +x and +y, then counter-clockwise."""


class Kidnap(Section):
    """Somebody carries the target away: it is elsewhere from one moment to the next, at rest, and drives on there."""

    at_s: Annotated[float, Field(ge=0, le=86_400)]
    """When [s after it departed]."""
    to_m: tuple[Place, Place] | None = None
    """Where to [x, y in m; world]; none: `distance_m` in a random direction."""
    distance_m: Annotated[float, Field(gt=0, le=100)] = 2.0
    """How far without `to_m` [m]; it stays 0.5 m or more from walls."""


Path = FigureEight | Standstill | Anywhere | Waypoints | RandomWalk | Sprint | AlongWalls
