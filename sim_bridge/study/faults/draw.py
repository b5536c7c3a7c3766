"""Draws the flight of a seed of the campaign: a field, a path of the target, and faults."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from sim_bridge.blind_flow import BlindReport
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.scenario import Scenario
from sim_bridge.study.faults.flight_order import WrongOrder
from sim_bridge.target_paths import FigureEight
from sim_bridge.world.noise import generator_of

_HEALTHY_SHARE = 0.1
# Pads lie where the ceiling camera of the shipped fields sees a drone at the height to which it takes off, and far
# enough inside the fence that a take-off does not leave it (as `groundstation config check` advises).
_PADS_M = (1.4, 0.75)
PAD_TO_OBSTACLE_M = 0.6
_LEAST_PADS_M, _TARGET_M, _PAD_TO_FENCE_M = 1.1, 0.6, 0.3
# Two pads may leave no room for a third: then all are drawn anew. If they fit, a seed's pads are those of old.
_MISSES, _BEGINNINGS = 20_000, 60

# For each kind of fault: least and greatest figure, None: it has none. Both signs where a sign makes sense.
_FIGURES: dict[FaultKind, tuple[float, float] | None] = {
    FaultKind.NAVDATA_SILENT: None,
    FaultKind.AT_DEAF: None,
    FaultKind.CAMERA_STALL: None,
    FaultKind.BATTERY_DROP: (0.02, 0.14),
    FaultKind.TELEMETRY_FROZEN: None,
    FaultKind.TELEMETRY_DELAYED: (0.2, 2.0),
    FaultKind.VELOCITY_STUCK: (-0.6, 0.6),
    FaultKind.VELOCITY_SCALED: (-1.0, 2.5),
    FaultKind.VELOCITY_DRIFTING: (0.02, 0.3),
    FaultKind.VELOCITY_JUMPING: (0.1, 1.0),
    FaultKind.HEADING_DRIFTING: (-5.0, 5.0),
    FaultKind.HEADING_JUMPING: (-90.0, 90.0),
    FaultKind.BATTERY_STUCK: (0.0, 0.3),  # below and above the charge at which drones land
    FaultKind.UNIFORM_FLOOR: None,
    FaultKind.OBSTACLE_BELOW: (0.2, 0.8),
    FaultKind.WIND: (0.3, 1.75),
    FaultKind.CAMERA_BUMPED: (1.0, 10.0),
    FaultKind.PICTURE_FROZEN: None,
    FaultKind.PICTURE_BLACK: None,
}
KINDS = tuple(_FIGURES)
# Flown where they are named: one more to draw from would change the faults of all seeds.
_NAMED: dict[FaultKind, tuple[float, float] | None] = {
    FaultKind.BODY_TURNED: (-180.0, 180.0),
    FaultKind.ANCHOR_FROZEN: None,
}
ALL_KINDS = (*KINDS, *_NAMED)
_OF_CAMERAS = frozenset(
    {FaultKind.CAMERA_STALL, FaultKind.CAMERA_BUMPED, FaultKind.PICTURE_FROZEN, FaultKind.PICTURE_BLACK}
)
_OF_ARDRONES = frozenset({FaultKind.UNIFORM_FLOOR, FaultKind.OBSTACLE_BELOW})


@dataclass(frozen=True, slots=True)
class Drawn:
    """One flight: the field (plain values), the scenario with its faults, and the seed of all noise."""

    field: dict[str, Any]
    scenario: Scenario
    seed: int


def draw(
    field: dict[str, Any],
    base: Scenario,
    seed: int,
    window_s: tuple[float, float],
    kinds: tuple[FaultKind, ...] = KINDS,
) -> Drawn:
    """Return the flight of a seed; window_s: span of the world's time in which faults begin [s]."""
    rng = generator_of(seed, "campaign")
    drones = random_pads(field, rng)
    target = base.target.model_copy(update={"path": random_eight(field, rng)})
    faults = _faults(field, rng, window_s, kinds)
    scenario = base.model_copy(update={"target": target, "faults": faults, "seed": seed})
    return Drawn({**field, "drones": drones}, scenario, seed)


def random_pads(field: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Return the drones of a field (plain values) on other pads, each heading for the middle of the fence.

    Raises WrongOrder if the fence is too small for so many.
    """
    (x, y), _ = _fenced(field)
    pads = _pads(field, rng)
    return {
        name: {**drone, "pad_m": pads[i], "pad_yaw_deg": math.degrees(math.atan2(y - pads[i][1], x - pads[i][0]))}
        for i, (name, drone) in enumerate(field["drones"].items())
    }


def _fenced(field: dict[str, Any]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the middle of the fence, and half of its length along world x and y [m]."""
    sides = [field["room"]["fence"][axis] for axis in ("x_m", "y_m")]
    (x, y), (half_x, half_y) = ([(high + sign * low) / 2 for low, high in sides] for sign in (1, -1))
    return (x, y), (half_x, half_y)


def _pads(field: dict[str, Any], rng: np.random.Generator) -> list[tuple[float, float]]:
    """Return places about the middle of the fence, apart from each other and the target."""
    middle, half_m = _fenced(field)
    reach = tuple(min(most, half - _PAD_TO_FENCE_M) for most, half in zip(_PADS_M, half_m, strict=True))
    wanted = len(field["drones"])
    for _ in range(_BEGINNINGS if min(reach) > 0.0 else 0):
        pads = _some_pads(wanted, middle, (reach[0], reach[1]), list(field["room"].get("obstacles", {}).values()), rng)
        if len(pads) == wanted:
            return pads
    raise WrongOrder(
        f"{wanted} drones: pads that are {_LEAST_PADS_M:g} m apart, {_TARGET_M:g} m from the middle of the fence, "
        f"{PAD_TO_OBSTACLE_M:g} m from room.obstacles and {_PAD_TO_FENCE_M:g} m inside the fence were not found for so "
        "many: fly fewer, or widen room.fence"
    )


def apart_m(obstacle: dict[str, Any], place: tuple[float, float]) -> float:
    """Return the distance of a place from an obstacle of a field (plain values) [m]."""
    gaps = (
        abs(at - c) - size / 2 for at, c, size in zip(place, obstacle["centre_m"], obstacle["size_m"], strict=False)
    )
    return math.hypot(*(max(0.0, gap) for gap in gaps))


def _some_pads(
    wanted: int,
    middle: tuple[float, float],
    reach: tuple[float, float],
    obstacles: list[dict[str, Any]],
    rng: np.random.Generator,
) -> list[tuple[float, float]]:
    """Return `wanted` places, or fewer if there was no room for another one."""
    (west, east), (south, north) = ((at - span, at + span) for at, span in zip(middle, reach, strict=True))
    pads: list[tuple[float, float]] = []
    missed = 0
    while len(pads) < wanted and missed < _MISSES:
        place = (float(rng.uniform(west, east)), float(rng.uniform(south, north)))
        fits = math.dist(place, middle) >= _TARGET_M and all(math.dist(place, other) >= _LEAST_PADS_M for other in pads)
        fits = fits and all(apart_m(one, place) >= PAD_TO_OBSTACLE_M for one in obstacles)
        missed = 0 if fits else missed + 1
        pads += [place] if fits else []
    return pads


def random_eight(field: dict[str, Any], rng: np.random.Generator) -> FigureEight:
    """Return a path about the middle of the fence of a field (plain values), within it."""
    middle, (half_x, half_y) = _fenced(field)
    longest, widest = 0.85 * half_x, 0.4 * half_y
    return FigureEight(
        half_length_m=float(rng.uniform(min(1.0, longest), longest)),
        half_width_m=float(rng.uniform(min(0.3, widest), widest)),
        speed_m_s=float(rng.uniform(0.15, 0.4)),
        start_phase=float(rng.choice((0.0, 0.5))),
        centre_m=middle,
    )


def _faults(
    field: dict[str, Any], rng: np.random.Generator, window_s: tuple[float, float], kinds: tuple[FaultKind, ...]
) -> tuple[Fault, ...]:
    if kinds and not any(_entities(field, kind) for kind in kinds):
        raise WrongOrder(f"{', '.join(kinds)}: nothing in this field can have such a fault: name other kinds")
    if rng.random() < _HEALTHY_SHARE or not kinds:
        return ()
    count = 1 if rng.random() < 0.5 else 2
    return tuple(_fault(field, rng, window_s, _kind(field, rng, kinds)) for _ in range(count))


def _kind(field: dict[str, Any], rng: np.random.Generator, kinds: tuple[FaultKind, ...]) -> FaultKind:
    """Return a kind that something in the field can have; others are drawn again, so seeds keep their faults."""
    while not _entities(field, kind := kinds[int(rng.integers(len(kinds)))]):
        pass
    return kind


def _entities(field: dict[str, Any], kind: FaultKind) -> list[str]:
    """Return the drones, cameras or ranging systems that can have a kind of fault."""
    if kind is FaultKind.ANCHOR_FROZEN:
        return [*field.get("ranging", ())]
    if kind is FaultKind.BODY_TURNED and not field.get("motion_capture"):
        return []
    if kind in _OF_CAMERAS:
        return [*field["cameras"], *field["drones"]]
    return [n for n, d in field["drones"].items() if d["kind"] == "ardrone" or kind not in _OF_ARDRONES]


def _fault(field: dict[str, Any], rng: np.random.Generator, window_s: tuple[float, float], kind: FaultKind) -> Fault:
    entities = _entities(field, kind)
    figures = (_FIGURES | _NAMED)[kind]
    value = None if figures is None else float(rng.uniform(*figures))
    if kind is FaultKind.VELOCITY_STUCK and rng.random() < 0.5:
        value = 0.0  # reported by an AR.Drone that sees no floor
    start_s = float(rng.uniform(*window_s))
    if kind is FaultKind.UNIFORM_FLOOR:  # a generator of its own: it changes no other draw
        value = float(rng.spawn(1)[0].integers(len(BlindReport)))
    lasts_s = float(rng.uniform(1.0, 8.0)) if rng.random() < 0.25 and kind is not FaultKind.BATTERY_DROP else None
    entity, anchors = entities[int(rng.integers(len(entities)))], list[str]()
    if kind is FaultKind.ANCHOR_FROZEN:
        anchors = [*field["ranging"][entity]["anchors"]]
    return Fault(
        kind=kind,
        entity=entity,
        start_s=start_s,
        end_s=None if lasts_s is None else start_s + lasts_s,
        value=value,
        direction_deg=float(rng.uniform(-180.0, 180.0)),
        other=anchors[int(rng.integers(len(anchors)))] if anchors else None,
    )
