"""A forecast in words: sections with a table and notes, for the terminal and the page."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

from groundstation.appearance.topology import topology_words
from groundstation.forecast.endurance import Endurance
from groundstation.forecast.failures import Failure
from groundstation.forecast.floor import PlaceForecast, Spread, left_of, spread_of
from groundstation.forecast.forecast import Forecast
from groundstation.forecast.observability import FLOWN_S, Direction, Observability

_REGIONS, _UNKNOWN_M = 6, 1.0


@dataclass(frozen=True, slots=True)
class Section:
    """A title, a table (head and rows; may be empty) and sentences."""

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()


def sections_of(forecast: Forecast) -> list[Section]:
    """Return all sections of a forecast, the most important ones first."""
    return [
        _accuracy(forecast),
        _blind(forecast),
        _failures(forecast),
        _observability(forecast),
        Section("Battery, from full", ("drone", "lasts"), tuple(_lasts(one) for one in forecast.endurance)),
    ]


def _accuracy(forecast: Forecast) -> Section:
    rows = [("over the floor", *_cells(spread_of(forecast.floor.places)))]
    if forecast.path:
        rows.insert(0, ("along the path", *_cells(spread_of(forecast.path))))
    title = f"Where {forecast.team.target} will be known to, with the best stand of {_count(forecast.team.robots)}"
    others = ", ".join(forecast.team.others)
    notes = [f"as if {others} were not there: --target forecasts others"] if others else []
    notes += [_left(where, places) for where, places in _places(forecast) if left_of(places)]
    return Section(title, ("", "median", "worst", "not seen"), tuple(rows), tuple(notes))


def _places(forecast: Forecast) -> tuple[tuple[str, Sequence[PlaceForecast]], ...]:
    return ("on the path", forecast.path), ("on the floor", forecast.floor.places)


def _left(where: str, places: Sequence[PlaceForecast]) -> str:
    seen = sum(one.std_m is not None for one in places)
    return (
        f"{where}: at {left_of(places)} of the {seen} places that are seen the planner alone would leave the stand for "
        "one that no fixed camera locates; the figure holds as far as flight keeps the drones within reach of a view"
    )


def _cells(spread: Spread) -> tuple[str, str, str]:
    return _metres(spread.median_m), _metres(spread.worst_m), f"{spread.blind:.0%}"


def _metres(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f} m"


def _count(names: Sequence[str]) -> str:
    return f"{len(names)} drone{'s' if len(names) > 1 else ''}"


def _blind(forecast: Forecast) -> Section:
    regions = forecast.floor.regions()
    rows = [
        (f"{one.share:.0%}", f"{_span(one.x_m)}", f"{_span(one.y_m)}", one.reason)
        for one in regions[:_REGIONS]
    ]  # fmt: skip
    notes = [_on_path(forecast.path)] if forecast.path else []
    if not regions:
        notes.insert(0, "nowhere: the team sees the whole floor")
    if len(regions) > _REGIONS:
        notes.insert(0, f"and {len(regions) - _REGIONS} smaller regions")
    return Section("Blind", ("floor", "x [m]", "y [m]", "because"), tuple(rows), tuple(notes))


def _span(span: tuple[float, float]) -> str:
    # Else -0.0 would be written with its sign.
    return f"{span[0] + 0.0:.1f} to {span[1] + 0.0:.1f}"


def _on_path(path: Sequence[PlaceForecast]) -> str:
    blind = [one for one in path if one.std_m is None]
    if not blind:
        return "nowhere on the path"
    x, y = blind[0].place
    return f"on the path: {len(blind)} of {len(path)} places, first at ({x:.1f}, {y:.1f}): {blind[0].reason}"


def _failures(forecast: Forecast) -> Section:
    rows = [("nothing", *_cells(forecast.base), "-")]
    rows += [(one.what, *_cells(one.without), ", ".join(one.unlocalised) or "-") for one in forecast.failures]
    head = ("fails", "median", "worst", "not seen", "no longer located")
    return Section("When one fails, over the floor", head, tuple(rows), tuple(_gravest(forecast.failures)))


def _gravest(failures: Iterable[Failure]) -> Iterator[str]:
    for one in failures:
        if one.unlocalised and one.without.blind >= 1.0:
            yield f"without {one.what} there is no tracking: have the remedy ready, or a second one"


def _observability(forecast: Forecast) -> Section:
    x, y = forecast.watched
    rows = tuple(_told(one) for one in forecast.observability)
    notes = [f"target at ({x:.1f}, {y:.1f}), {FLOWN_S:.0f} s of flight; told: deviation at least halved"]
    notes += _missing(forecast.observability)
    best = max(forecast.observability, key=lambda one: (one.rank, -_size(one.worst_m)))
    notes += [f"as before the flight: {line}" for line in _by_labels(best.untold)]
    return Section("What sensors tell, by topology", ("topology", "told", "known worst", "heading"), rows, tuple(notes))


def _told(one: Observability) -> tuple[str, str, str, str]:
    place, yaw = one.worst_m, one.worst_yaw
    turned = "-" if yaw is None else f"{math.degrees(yaw.std):.1f} deg"
    where = "-" if place is None else f"{_deviation(place)} {_parts(place)}"
    return topology_words(str(one.topology)), f"{one.rank} of {len(one.entries)}", where, turned


def _deviation(place: Direction) -> str:
    return f"{place.std:.3f} m" if place.std < _UNKNOWN_M else "unknown:"


def _parts(direction: Direction) -> str:
    return " ".join(name for name, _ in direction.parts[:2])


def _size(direction: Direction | None) -> float:
    return math.inf if direction is None else direction.std


def _missing(seen: Iterable[Observability]) -> Iterator[str]:
    for one in seen:
        if one.missing:
            yield f"{topology_words(str(one.topology))}: nothing tells where {' and '.join(one.missing)} would be"


def _by_labels(entries: Sequence[str]) -> Iterator[str]:
    """Return entries grouped by the entities that share them: "drone_1, drone_2: roll_error, climb"."""
    pairs, owners = [name.rsplit(".", 1) for name in entries], dict[tuple[str, ...], list[str]]()
    for entity, own in groupby(pairs, key=lambda pair: pair[0]):
        owners.setdefault(tuple(label for _, label in own), []).append(entity)
    for labels, entities in owners.items():
        yield f"{', '.join(entities)}: {', '.join(labels)}"


def _lasts(one: Endurance) -> tuple[str, str]:
    if one.seconds is None:
        return one.drone, f"not known: the kind {one.kind} tells no figure; time a first flight"
    return one.drone, f"{one.seconds / 60:.0f} min at most, until it lands at {one.lands_at:.0%}"
