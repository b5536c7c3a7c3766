"""Draws the flight of a seed of the missions: a room, the team and its pads, the target's path, unreported drifts."""

from typing import Any

import numpy as np

from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.scenario import Scenario
from sim_bridge.study.faults.draw import PAD_TO_OBSTACLE_M, Drawn, apart_m, random_eight, random_pads
from sim_bridge.target_paths import AlongWalls, Anywhere, Path, RandomWalk, Sprint, Waypoints
from sim_bridge.world.noise import generator_of

# Rooms in which a team of the shipped fields can fly; the fixed sensors stay where they are.
_LENGTH_M, _WIDTH_M = (6.0, 12.0), (5.0, 8.0)
_FENCE_INSET_M, _TARGET_INSET_M = 0.3, 0.6
_SPEED_M_S = (0.15, 0.6)
_POINTS = 5
_LEAST_TEAM = 2
_PILLAR_M, _PILLARED, _TRIES = (0.2, 0.8), 0.5, 100


def draw_mission(field: dict[str, Any], base: Scenario, seed: int, drift_m_s: float = 0.0) -> Drawn:
    """Return the flight of a seed: without faults, but with the sensor errors of a scenario.

    drift_m_s: error of every drone's reported velocity, constant in its frame, in a direction of its own.
    """
    rng = generator_of(seed, "mission")
    sized = {**field, "room": _room(field["room"], rng)}
    told = {**sized, "drones": random_pads(sized, rng)}
    told["room"] = {**told["room"], "obstacles": _pillar(told, seed)}
    path = _path(told, rng)
    waits = {"departs_after_team_s": None} if isinstance(path, AlongWalls | Anywhere) else {}
    target = base.target.model_copy(update={"path": path, **waits})
    team = _team(told["drones"], rng)
    faults = tuple(_drift(name, drift_m_s, rng) for name in team) if drift_m_s else ()
    drawn = base.model_copy(update={"target": target, "faults": faults, "seed": seed})
    return Drawn({**told, "drones": team}, drawn, seed)


def _team(drones: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Return the drones that fly: two at least."""
    if len(drones) <= _LEAST_TEAM:
        return drones
    flying = set(rng.permutation(list(drones))[: int(rng.integers(_LEAST_TEAM, len(drones) + 1))])
    return {name: drone for name, drone in drones.items() if name in flying}


def _drift(name: str, speed_m_s: float, rng: np.random.Generator) -> Fault:
    direction_deg = float(rng.uniform(-180.0, 180.0))
    return Fault(
        kind=FaultKind.VELOCITY_JUMPING, entity=name, start_s=0.0, value=speed_m_s, direction_deg=direction_deg
    )


def _room(room: dict[str, Any], rng: np.random.Generator) -> dict[str, Any]:
    """Return a room of another size, with a fence inside its walls."""
    length_m, width_m = float(rng.uniform(*_LENGTH_M)), float(rng.uniform(*_WIDTH_M))
    x_m, y_m = length_m / 2 - _FENCE_INSET_M, width_m / 2 - _FENCE_INSET_M
    fence = {**room["fence"], "x_m": (-x_m, x_m), "y_m": (-y_m, y_m)}
    return {**room, "size_m": (length_m, width_m, room["size_m"][2]), "fence": fence, "obstacles": {}}


def _pillar(field: dict[str, Any], seed: int) -> dict[str, Any]:
    """Return a pillar inside the fence, away from the pads, in every other flight.

    As high as the room: low boxes are flown over, and who lands on one would sink through it, as nothing stops bodies.
    """
    rng = generator_of(seed, "pillar")
    (x0, x1), (y0, y1) = field["room"]["fence"]["x_m"], field["room"]["fence"]["y_m"]
    side_m = (float(rng.uniform(*_PILLAR_M)), float(rng.uniform(*_PILLAR_M)))
    box: dict[str, Any] = {"size_m": (*side_m, field["room"]["size_m"][2])}
    for _ in range(_TRIES if rng.random() < _PILLARED else 0):
        box["centre_m"] = float(rng.uniform(x0, x1)), float(rng.uniform(y0, y1))
        if all(apart_m(box, drone["pad_m"]) >= PAD_TO_OBSTACLE_M for drone in field["drones"].values()):
            return {"pillar": box}
    return {}


def _path(field: dict[str, Any], rng: np.random.Generator) -> Path:
    """Return a path of one of the kinds that a scenario can name, somewhere in the room."""
    length_m, width_m, _ = field["room"]["size_m"]
    x, y = length_m / 2 - _TARGET_INSET_M, width_m / 2 - _TARGET_INSET_M
    speed_m_s = float(rng.uniform(*_SPEED_M_S))
    area = {"x_m": (-x, x), "y_m": (-y, y), "speed_m_s": speed_m_s}
    points = tuple((float(rng.uniform(-x, x)), float(rng.uniform(-y, y))) for _ in range(_POINTS))
    paths: tuple[Path, ...] = (
        random_eight(field, rng),
        RandomWalk.model_validate(area),
        Sprint.model_validate(area),
        AlongWalls(speed_m_s=speed_m_s, from_wall_m=_TARGET_INSET_M, start_corner=int(rng.integers(4))),
        Anywhere(),
        Waypoints(points_m=((0.0, 0.0), *points), speed_m_s=speed_m_s),
    )
    return paths[int(rng.integers(len(paths)))]
