"""The flight whose setpoints exceed the limits of its field file, and its checks."""

import math

import numpy as np

from groundstation.field.drones import DroneLimits
from sim_bridge.conformance.bench import Bench
from sim_bridge.conformance.check import Case, check
from sim_bridge.conformance.record import Moment, turned
from sim_bridge.conformance.script import script

# About half of the default limits, and twice that is asked.
NARROW = DroneLimits(max_speed_m_s=0.3, max_climb_m_s=0.2, max_yaw_rate_deg_s=30.0)
_ASKED_TURN_RAD_S = 2.0 * math.radians(NARROW.max_yaw_rate_deg_s)
# Greatest share of the limit, with gusts and gain, and the least share that must be reached.
_MOST, _LEAST = 1.25, 0.5
_SETTLES_S = 1.2


@script(limits=NARROW)
def _limits(bench: Bench) -> None:
    """Low limits in the field file, and setpoints that ask for twice as much."""
    bench.track()
    for mark, velocity, turn in (
        ("too fast ahead", (2.0 * NARROW.max_speed_m_s, 0.0, 0.0), 0.0),
        ("too fast aslant", (-1.4 * NARROW.max_speed_m_s, 1.4 * NARROW.max_speed_m_s, 0.0), 0.0),
        ("too fast up", (0.0, 0.0, 2.0 * NARROW.max_climb_m_s), 0.0),
        ("too fast down", (0.0, 0.0, -2.0 * NARROW.max_climb_m_s), 0.0),
        ("too fast a turn", (0.0, 0.0, 0.0), _ASKED_TURN_RAD_S),
    ):
        bench.fly(mark, velocity, turn, 2.4)
        bench.spend(f"after {mark}", 0.8)
    bench.land()


def _settled(case: Case, mark: str) -> list[Moment]:
    motion = case.record.motion(mark, _SETTLES_S)
    assert motion, f"nothing was seen of: {mark}"
    return motion


def _keeps(figure: float, limit: float, unit: str) -> None:
    assert _LEAST * limit < figure < _MOST * limit, f"{figure:.2f} {unit}, {limit:.2f} allowed"


@check("limits")
def speed_limit_is_flown(case: Case) -> None:
    """Asked for twice the speed that the field file allows, it flies as fast as that allows and no faster."""
    for mark in ("too fast ahead", "too fast aslant"):
        _keeps(float(np.mean([one.speed for one in _settled(case, mark)])), NARROW.max_speed_m_s, "m/s")


@check("limits")
def climb_limit_is_flown(case: Case) -> None:
    """Asked for twice the climb rate that the field file allows, up and down, it keeps to that limit."""
    for mark in ("too fast up", "too fast down"):
        _keeps(float(np.mean([abs(one.velocity[2]) for one in _settled(case, mark)])), NARROW.max_climb_m_s, "m/s")


@check("limits")
def turn_limit_is_flown(case: Case) -> None:
    """Asked for twice the yaw rate that the field file allows, it turns as fast as that allows and no faster."""
    motion = _settled(case, "too fast a turn")
    rate = turned(motion) / ((motion[-1].at_ns - motion[0].at_ns) / 1e9)
    _keeps(rate, math.radians(NARROW.max_yaw_rate_deg_s), "rad/s")
