"""Conditions on a vehicle's motion that several checks share: it brakes, stands, lands. They raise AssertionError."""

import math
from collections.abc import Sequence

from groundstation.time_units import NS_PER_S
from sim_bridge.conformance.check import Case
from sim_bridge.conformance.record import Moment, turned

_STILL_M_S, _STILL_RAD_S = 0.2, 0.15
_LANDED_S = 14.0
# A degree of it.
_LEVEL_ERROR_M_S2 = 9.81 * math.sin(math.radians(1.0))


def brakes(case: Case, mark: str, after_s: float) -> None:
    """The vehicle has less than half of its speed after a while, and stands at the end of the span."""
    begin, _ = case.record.span(mark)
    before, later = case.record.at(begin).speed, case.record.at(begin + round(after_s * 1e9)).speed
    assert later < max(_STILL_M_S, 0.5 * before), f"{later:.2f} m/s after {after_s} s, {before:.2f} before"


def still(case: Case, mark: str, skip_s: float = 0.0) -> None:
    """The vehicle stands in a span, the first seconds left out, and does not turn."""
    motion = case.record.motion(mark, skip_s)
    assert motion, f"nothing was seen of: {mark}"
    speed = max(one.speed for one in motion)
    assert speed < _STILL_M_S, f"{speed:.2f} m/s"
    faces_on(motion)


def faces_on(motion: Sequence[Moment]) -> None:
    """The vehicle does not turn."""
    turns = abs(turned(motion)) / max(1e-9, (motion[-1].at_ns - motion[0].at_ns) / NS_PER_S)
    assert turns < _STILL_RAD_S, f"it turns by {turns:.2f} rad/s"


def lands(case: Case, mark: str) -> None:
    """The vehicle stands on the floor, motors off, in time."""
    case.record.span(mark)
    took = case.record.facts[mark]
    assert took < _LANDED_S, f"it stood after {took:.1f} s" if math.isfinite(took) else "it did not land"


def stops_without_positions(case: Case, mark: str) -> None:
    """The vehicle stands within 1.5 s, and then gathers no more speed than the error of its tilt explains.

    The dead driver sends no positions any more, and nothing replaces them: the vehicle has its accelerometers only.
    """
    begin, _ = case.record.span(mark)
    motion = case.record.motion(mark, 0.9)
    stood = next((one for one in motion if one.speed < _STILL_M_S), None)
    assert stood is not None, f"{min(one.speed for one in motion):.2f} m/s at least" if motion else "nothing was seen"
    took_s = (stood.at_ns - begin) / NS_PER_S
    assert took_s < 1.5, f"it stood after {took_s:.1f} s"
    after = [one for one in motion if one.at_ns >= stood.at_ns]
    beyond = max(one.speed - _LEVEL_ERROR_M_S2 * (one.at_ns - stood.at_ns) / NS_PER_S for one in after)
    assert beyond < _STILL_M_S, (
        f"it stood after {took_s:.1f} s and went on to {max(one.speed for one in after):.2f} m/s"
    )
    faces_on(after)
