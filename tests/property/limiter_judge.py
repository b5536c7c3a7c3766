"""Judges the output limiter's response to random wishes in random team states by the safety page's half-spaces."""

import math
from collections import Counter
from dataclasses import dataclass
from itertools import count

import numpy as np
from team_states import CLUTTERED, LIMITS, SAFETY, TeamStates, anything_allowed, promised, random_states

from groundstation.arrays import Array, BoolArray, IntArray
from groundstation.control.flight_mode import FlightMode
from groundstation.control.output_limiter import limit_setpoint
from groundstation.control.setpoints import Setpoint

TEAMS = 1000  # drawn at a time
_TOLERANCE_M_S, _STEP_M_S = 1e-6, 1e-4
# The limiter approximates a circle by a polygon of 16 sides.
_WITHIN = math.cos(math.pi / 16)


@dataclass(frozen=True)
class Told:
    """The limiter's output for each robot's wish: velocities [n, r, 3; m/s; world] and yaw_rates [n, r; rad/s]."""

    velocities: Array
    yaw_rates: Array


def limited(states: TeamStates) -> Told:
    """Run the limiter, state by state, as the tracker does."""
    yaws = states.poses[..., 3]
    asked, answers = _turned(states.wishes, -yaws), np.empty((*yaws.shape, 4))
    wishes, rates = asked.tolist(), states.yaw_rates.tolist()
    for row in range(len(yaws)):
        at, velocities, drifts = states.belief(row), states.velocities_of(row), states.drifts_of(row)
        shafts = states.shafts_of(row)
        for i, name in enumerate(states.names):
            wish = Setpoint(tuple(wishes[row][i]), rates[row][i], FlightMode.TRACK)
            told = limit_setpoint(name, wish, at, 0, states.safety, velocities, drifts, shafts).setpoint
            answers[row, i] = *told.velocity_m_s, told.yaw_rate_rad_s
    return Told(_turned(answers[..., :3], yaws), answers[..., 3])


def _turned(vectors: Array, angles: Array) -> Array:
    """Return vectors rotated about the vertical [..., 3]."""
    (x, y, z), c, s = np.moveaxis(vectors, -1, 0), np.cos(angles), np.sin(angles)
    return np.stack((c * x - s * y, s * x + c * y, z), axis=-1)


def judge(states: TeamStates, told: Told, robot: int) -> Counter[str]:
    """Assert the promises for one robot's setpoints; returns the number of states by outcome.

    "hovers": unfit to fly; "open": no wall limits the wish; "bent": a wall limits the wish; "held off": a wall requires
    motion against a drift, or back into the fence; "kept out": others do not let it come back; "squeezed": the walls
    require more than a vehicle can do.
    """
    velocity, rate = told.velocities[:, robot], told.yaw_rates[:, robot]
    unfit = states.unfit(robot)
    _none(unfit & ((velocity != 0.0).any(axis=1) | (rate != 0.0)), "who is unfit hovers")
    _none(_too_fast(velocity) | (np.abs(rate) > LIMITS.max_yaw_rate_rad_s), "limits are kept")
    normals, most = promised(states, robot, rate)
    _, without = promised(states, robot, rate, returns=False)
    excess = _excess(normals, most, velocity)
    demanded = _excess(normals, without, velocity)
    nearer = (demanded - np.maximum(-without, 0.0)).max(axis=1) > _TOLERANCE_M_S
    _none(~unfit & nearer, "nobody comes nearer than a wall lets it")
    unmet = ~unfit & (excess.max(axis=1) > _TOLERANCE_M_S)
    if unmet.any():
        which = np.flatnonzero(unmet)
        _none(_at(which, anything_allowed(normals[which], most[which]), unmet), "what holds off every drift is found")
    squeezed = ~unfit & (demanded.max(axis=1) > _TOLERANCE_M_S)
    which = np.flatnonzero(squeezed & (without != most).any(axis=1))
    if which.size:
        allowed = anything_allowed(normals[which], without[which])
        _none(_at(which, allowed, squeezed), "no return costs what holds off a drift")
    wish = _clipped(states.wishes[:, robot])
    free = ~unfit & (_excess(normals, most, wish).max(axis=1) < -_TOLERANCE_M_S)
    _none(free & (np.abs(velocity - wish).max(axis=1) > 1e-9), "an open way changes nothing")
    met = ~unfit & ~unmet & ~free
    _none(met & _could_be_nearer(velocity, wish, normals, most), "a step nearer to the wish is allowed")
    pushed = met & (most.min(axis=1) < 0.0)
    ends = {"hovers": unfit, "open": free, "bent": met & ~pushed, "held off": pushed, "squeezed": squeezed}
    ends["kept out"] = unmet & ~squeezed
    return Counter({end: int(where.sum()) for end, where in ends.items()})


def _excess(normals: Array, most: Array, velocity: Array) -> Array:
    excess: Array = np.einsum("nmi,ni->nm", normals, velocity) - most
    return excess


def _too_fast(velocity: Array, share: float = 1.0) -> BoolArray:
    fast = np.hypot(velocity[:, 0], velocity[:, 1]) > share * LIMITS.max_speed_m_s + 1e-9
    return fast | (np.abs(velocity[:, 2]) > LIMITS.max_climb_m_s + 1e-9)


def _clipped(wish: Array) -> Array:
    """Return wishes within the vehicle's limits."""
    speed = np.maximum(np.hypot(wish[:, 0], wish[:, 1]), 1e-12)
    scale = np.minimum(1.0, LIMITS.max_speed_m_s / speed)
    climb = np.clip(wish[:, 2], -LIMITS.max_climb_m_s, LIMITS.max_climb_m_s)
    return np.column_stack((wish[:, 0] * scale, wish[:, 1] * scale, climb))


def _could_be_nearer(velocity: Array, wish: Array, normals: Array, most: Array) -> BoolArray:
    """Return where a small step straight towards the wish stays clear of all walls, well within the limits."""
    way = wish - velocity
    size = np.linalg.norm(way, axis=1)
    step = velocity + way * (_STEP_M_S / np.maximum(size, _STEP_M_S))[:, None]
    return (size > _STEP_M_S) & ~_too_fast(step, _WITHIN - 0.001) & (_excess(normals, most, step).max(axis=1) < -1e-8)


def _at(which: IntArray, values: BoolArray, like: BoolArray) -> BoolArray:
    found = np.zeros_like(like)
    found[which] = values
    return found


def _none(wrong: BoolArray, what: str) -> None:
    assert not wrong.any(), f"{what}: not so in {wrong.sum()} of {len(wrong)} states, first in row {wrong.argmax()}"


def judged(states: int, seed: int) -> Counter[str]:
    """Draw and judge at least so many states; returns the number of states by outcome."""
    ends, numbers = Counter[str](), count()
    while ends.total() < states:
        ends += judged_batch(seed, next(numbers), min(TEAMS, 1 + (states - ends.total()) // 2))
    return ends


def judged_batch(seed: int, number: int, teams: int) -> Counter[str]:
    """Draw and judge the states of one batch; its number reproduces it.

    Teams of two and of three in turn, and every third pair of batches in a room with obstacles.
    """
    safety = CLUTTERED if number % 6 < 2 else SAFETY
    drawn = random_states(np.random.default_rng((seed, number)), teams, 2 + number % 2, safety)
    told, ends = limited(drawn), Counter[str]()
    for robot in range(len(drawn.names)):
        try:
            ends += judge(drawn, told, robot)
        except AssertionError as error:
            error.add_note(f"judged_batch({seed}, {number}, {teams}), robot {robot}")
            raise
    return ends
