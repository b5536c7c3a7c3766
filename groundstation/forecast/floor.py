"""Forecasts a target's uncertainty all over the floor, and the reasons for blind places."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from groundstation.arrays import Array
from groundstation.estimation.motion import DIFFUSE_M2
from groundstation.field.resolved import ResolvedField
from groundstation.forecast.flown_filter import FlownFilter
from groundstation.forecast.stands import StandSearch, TeamStand
from groundstation.forecast.team import Place, Team
from groundstation.forecast.views import Obstruction

_SETTLED_S = 1.5  # time until the covariance of places seen by cameras is constant
# Initial variances of x, y, z, yaw: heights and headings are near their final values, places unknown, since a direction
# that no sensor tells would keep what it began with.
_BEFORE = (DIFFUSE_M2, DIFFUSE_M2, 0.04**2, 0.05**2)
OBSTACLE = "an obstacle stands there"

_WORDS = {
    Obstruction.NO_CAMERA: "no camera looks at targets",
    Obstruction.OUT_OF_SIGHT: "no drone sees a marker from where it flies",
    Obstruction.OUT_OF_FENCE: "the fence: no drone can stand where it sees it",
    Obstruction.HIDDEN: "hidden by an obstacle wherever a drone stands",
}


@dataclass(frozen=True, slots=True)
class PlaceForecast:
    """Forecast of a target at a place.

    std_m: of its place in the floor plan, root of the trace, in the filter; None if it is not seen, for the reason
    in words. stand: the team's; None if it has none, or no drone.
    """

    place: Place
    std_m: float | None
    reason: str = ""
    stand: TeamStand | None = None


@dataclass(frozen=True, slots=True)
class Spread:
    """Median and worst deviation where a target is seen [m], and the share of the places where it is not."""

    median_m: float | None
    worst_m: float | None
    blind: float


def left_of(places: Iterable[PlaceForecast]) -> int:
    """Return how many places are seen from stands only that the planner alone would leave."""
    return sum(one.std_m is not None and one.stand is not None and one.stand.is_left for one in places)


@dataclass(frozen=True, slots=True)
class Region:
    """Connected places that are blind for one reason: bounds with their cells [m; world], share of the floor."""

    reason: str
    x_m: tuple[float, float]
    y_m: tuple[float, float]
    share: float


@dataclass(frozen=True, slots=True)
class FloorMap:
    """A grid over the floor: middles of its cells along x and y [m; world], and rows of places, the lowest y first."""

    xs: Array
    ys: Array
    rows: tuple[tuple[PlaceForecast, ...], ...]

    @property
    def places(self) -> list[PlaceForecast]:
        """Return the places at which a target can be."""
        return [one for row in self.rows for one in row if one.reason != OBSTACLE]

    @property
    def std_m(self) -> Array:
        """Return the deviations (rows, columns), NaN where a target is not seen."""
        return np.array([[math.nan if one.std_m is None else one.std_m for one in row] for row in self.rows])

    def every_second(self) -> list[Place]:
        """Return the places of every second row and column."""
        return [one.place for row in self.rows[::2] for one in row[::2] if one.reason != OBSTACLE]

    def regions(self) -> list[Region]:
        """Return the blind regions, the largest first."""
        left = {
            (j, i): one.reason
            for j, row in enumerate(self.rows)
            for i, one in enumerate(row)
            if one.std_m is None and one.reason != OBSTACLE
        }
        found = []
        while left:
            cells, reason = _taken(left)
            found.append(self._region(cells, reason))
        return sorted(found, key=lambda one: -one.share)

    def _region(self, cells: Sequence[tuple[int, int]], reason: str) -> Region:
        rows, columns = zip(*cells, strict=True)
        half_x, half_y = 0.5 * (self.xs[1] - self.xs[0]), 0.5 * (self.ys[1] - self.ys[0])
        return Region(
            reason,
            (float(self.xs[min(columns)] - half_x), float(self.xs[max(columns)] + half_x)),
            (float(self.ys[min(rows)] - half_y), float(self.ys[max(rows)] + half_y)),
            len(cells) / max(1, len(self.places)),
        )


class PlaceForecaster:
    """Forecasts single places for one team."""

    def __init__(self, field: ResolvedField, team: Team) -> None:
        self.search, self._filter, self.team = StandSearch(team), FlownFilter(field, team), team

    def at(self, place: Place) -> PlaceForecast:
        """Return the forecast of a target at a place; raises EstimatorFault if it is not finite."""
        views = self.search.views
        if views.in_box(place):
            return PlaceForecast(place, None, OBSTACLE)
        if not self.team.sensors.world:
            return PlaceForecast(place, None, "no fixed camera tells where drones are")
        if not self.team.robots and not views.placed_by(views.ground(place), is_target=True):
            return PlaceForecast(place, None, "no drone flies, and no fixed camera sees it")
        stand = self.search.at(place) if self.team.robots else None
        if isinstance(stand, Obstruction):
            return PlaceForecast(place, None, _WORDS.get(stand) or self._unplaced(place))
        belief = self._filter.belief({} if stand is None else stand.poses, place, _SETTLED_S, _BEFORE)
        if self.team.target not in belief.layout:
            return PlaceForecast(place, None, "the filter takes no sighting of it", stand)
        return PlaceForecast(place, math.sqrt(np.trace(belief.covariance_of(self.team.target)[:2, :2])), "", stand)

    def _unplaced(self, place: Place) -> str:
        return f"whoever sees it is {self.search.views.why_unplaced(place)}"


def floor_map(
    field: ResolvedField, forecaster: PlaceForecaster, cells: int, told: Callable[[], None] = lambda: None
) -> FloorMap:
    """Return the map of a field's floor; cells: about the number of its square cells; told: called after each."""
    width, depth, _ = field.room.size_m
    side = math.sqrt(width * depth / cells)
    xs, ys = _middles(width, side), _middles(depth, side)

    def forecast(place: Place) -> PlaceForecast:
        told()
        return forecaster.at(place)

    return FloorMap(xs, ys, tuple(tuple(forecast((x, y)) for x in xs.tolist()) for y in ys.tolist()))


def spread_of(places: Iterable[PlaceForecast]) -> Spread:
    """Return median, worst and blind share of some places."""
    chosen = list(places)
    known = [one.std_m for one in chosen if one.std_m is not None]
    blind = 1.0 - len(known) / max(1, len(chosen))
    return Spread(median(known), max(known), blind) if known else Spread(None, None, blind)


def _middles(length: float, side: float) -> Array:
    count = max(2, round(length / side))
    return (np.arange(count) + 0.5) * length / count - length / 2


def _taken(left: dict[tuple[int, int], str]) -> tuple[list[tuple[int, int]], str]:
    """Remove the cells of one region from those left; return them with their reason."""
    first = next(iter(left))
    reason, queue, cells = left.pop(first), [first], []
    while queue:
        j, i = queue.pop()
        cells.append((j, i))
        for near in ((j + 1, i), (j - 1, i), (j, i + 1), (j, i - 1)):
            if left.get(near) == reason:
                del left[near]
                queue.append(near)
    return cells, reason
