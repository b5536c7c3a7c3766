"""Forecasts of the same places when one camera or drone of the team fails."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from groundstation.field.resolved import ResolvedField
from groundstation.forecast.floor import PlaceForecast, PlaceForecaster, Spread, spread_of
from groundstation.forecast.team import Place, Team


@dataclass(frozen=True, slots=True)
class Failure:
    """One failure, the forecasts of the same places with it, and the drones that can no longer be located."""

    what: str
    without: Spread
    unlocalised: tuple[str, ...]


def teams_without_one(team: Team) -> list[tuple[str, Team]]:
    """Return the team without each fixed sensor, drone's camera or drone in turn, with its name for people."""
    fixed = [(name, team.without_sensor(name)) for name in team.sensors.world]
    onboard = [(f"{name}'s camera", team.without_sensor(name)) for name in team.sensors.onboard if name in team.robots]
    return [*fixed, *onboard, *((name, team.without_robot(name)) for name in team.robots)]


def failures(
    field: ResolvedField, team: Team, places: Sequence[Place], told: Callable[[], None] = lambda: None
) -> list[Failure]:
    """Return the forecasts of some places under each single failure; told: called after each place."""
    found = []
    for what, left in teams_without_one(team):
        forecaster = PlaceForecaster(field, left)
        seen = [_told(forecaster, place, told) for place in places]
        found.append(Failure(what, spread_of(seen), _unlocalised(forecaster, seen)))
    return found


def _told(forecaster: PlaceForecaster, place: Place, told: Callable[[], None]) -> PlaceForecast:
    told()
    return forecaster.at(place)


def _unlocalised(forecaster: PlaceForecaster, seen: Sequence[PlaceForecast]) -> tuple[str, ...]:
    """Return whom fixed sensors locate, directly or through drones, at the stand of none of these places.

    Where the team has no stand, because it sees the target nowhere, drones count as located that fixed sensors could
    see above one of these places.
    """
    team, stands = forecaster.team, [one.stand for one in seen if one.stand is not None]
    placed = set[str]().union(*(stand.placed for stand in stands))
    if not stands:
        views, places = forecaster.search.views, [one.place for one in seen]
        placed = {name for name in team.robots if any(views.is_placed_above(name, place) for place in places)}
    if any(one.std_m is not None for one in seen):
        placed.add(team.target)
    return tuple(name for name in (*team.robots, team.target) if name not in placed)
