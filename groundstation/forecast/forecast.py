"""The whole forecast of a field: its parts in the order of their computation, with progress."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from groundstation.field.resolved import ResolvedField
from groundstation.forecast.endurance import Endurance, endurance_of
from groundstation.forecast.failures import Failure, failures, teams_without_one
from groundstation.forecast.floor import FloorMap, PlaceForecast, PlaceForecaster, Spread, floor_map, spread_of
from groundstation.forecast.observability import Observability, observe, topologies_of
from groundstation.forecast.paths import spaced
from groundstation.forecast.team import Place, Team, team_of

_CELLS, _PATH_PLACES = 110, 24


@dataclass(frozen=True, slots=True)
class Forecast:
    """The forecast of a field: places along the path (none: no path is known) and over the floor, and its basis.

    watched: place of the target for the observability; base: the spread without a failure over the places at which
    failures are judged.
    """

    team: Team
    watched: Place
    observability: tuple[Observability, ...]
    floor: FloorMap
    path: tuple[PlaceForecast, ...]
    endurance: tuple[Endurance, ...]
    base: Spread
    failures: tuple[Failure, ...]


def forecast(
    field: ResolvedField, path: Sequence[Place] = (), told: Callable[[int, int], None] = lambda done, total: None,
    target: str = "",
) -> Forecast:  # fmt: skip
    """Return the forecast of a field for one target on a path (points in order; none: anywhere on the floor).

    told: called with the number of places done and about all; target: "" for the first. Raises EstimatorFault for
    results that are not finite.
    """
    team, points = team_of(field, target), spaced(path, _PATH_PLACES)
    total, done = _CELLS + len(points) + len(teams_without_one(team)) * _CELLS // 4, 0

    def one_more() -> None:
        nonlocal done
        done += 1
        told(min(done, total - 1), total)

    forecaster = PlaceForecaster(field, team)
    floor = floor_map(field, forecaster, _CELLS, one_more)
    along = []
    for point in points:
        along.append(forecaster.at(point))
        one_more()
    hardest = _hardest(along or floor.places)
    topologies = topologies_of(team, [] if hardest is None or hardest.stand is None else [hardest.stand.topology])
    middle = team.planner.fence.center if hardest is None else hardest.place
    seen = observe(field, team, middle, topologies)
    coarse = floor.every_second()
    base = spread_of(one for one in floor.places if one.place in set(coarse))
    lost = failures(field, team, coarse, one_more)
    told(total, total)
    return Forecast(
        team, middle, tuple(seen), floor, tuple(along), tuple(endurance_of(field)), base, tuple(lost)
    )  # fmt: skip


def _hardest(places: Sequence[PlaceForecast]) -> PlaceForecast | None:
    """Return the seen place with the largest deviation, where topologies differ most."""
    seen = [one for one in places if one.std_m is not None]
    return max(seen, key=lambda one: one.std_m or 0.0, default=None)
