"""Checks of a flight by orders and setpoints: units, signs, rates, answers."""

import math

import numpy as np

from groundstation.bus.messages import AckStage
from groundstation.bus.topics import COMMAND_ACK, VEHICLE_STATUS
from groundstation.time_units import NS_PER_S
from sim_bridge.conformance.check import Case, check
from sim_bridge.conformance.flights import CLIMB_M_S, CLIMB_S, LEG_S, SPEED_M_S, TURN_RAD_S
from sim_bridge.conformance.record import Moment, turned
from sim_bridge.conformance.subject import LIMITS

_LEGS = {"forward": (1, 0), "left": (0, 1), "back": (-1, 0), "right": (0, -1)}
# Shares of an ideal vehicle's way: gain errors and gusts may take or add as much.
_LEAST, _MOST, _ASIDE = 0.6, 1.35, 0.35
_DONE = [AckStage.RECEIVED, AckStage.ACCEPTED, AckStage.EFFECTIVE]


def _ends(case: Case, mark: str, coasts_s: float) -> tuple[Moment, Moment]:
    """Return the states before a span and after it, when the vehicle is at rest and its lag no longer counts."""
    begin, end = case.record.span(mark)
    return case.record.at(begin), case.record.at(end + round(coasts_s * NS_PER_S))


def _way(case: Case, mark: str, coasts_s: float = 1.1) -> tuple[float, float]:
    """Return the way of a span, forward and left of the heading at its begin [m]."""
    first, last = _ends(case, mark, coasts_s)
    (x, y, _), (u, v, _), yaw = first.position, last.position, first.attitude[2]
    c, s = math.cos(yaw), math.sin(yaw)
    return c * (u - x) + s * (v - y), c * (v - y) - s * (u - x)


def _leg(case: Case, mark: str) -> None:
    ahead, aside = _LEGS[mark]
    forward, left = _way(case, mark)
    ideal = SPEED_M_S * LEG_S
    along, across = ahead * forward + aside * left, ahead * left - aside * forward
    assert _LEAST * ideal < along < _MOST * ideal, f"{along:.2f} m of {ideal:.2f} m the right way"
    assert abs(across) < _ASIDE * ideal, f"{across:.2f} m aside"


@check("square")
def forward_is_forward(case: Case) -> None:
    """A setpoint along x flies forward, by metres per second."""
    _leg(case, "forward")


@check("square")
def left_is_left(case: Case) -> None:
    """A setpoint along y flies to the left."""
    _leg(case, "left")


@check("square")
def back_is_back(case: Case) -> None:
    """A setpoint against x flies backward."""
    _leg(case, "back")


@check("square")
def right_is_right(case: Case) -> None:
    """A setpoint against y flies to the right."""
    _leg(case, "right")


@check("square")
def square_closes(case: Case) -> None:
    """The four legs end within 0.6 m of where they began."""
    begin, end = case.record.motion("forward")[0], case.record.motion("right")[-1]
    off = math.dist(begin.position[:2], end.position[:2])
    assert off < 0.6, f"{off:.2f} m off"


def _climb(case: Case, mark: str, wanted: float) -> None:
    first, last = _ends(case, mark, 0.7)
    climbed = last.position[2] - first.position[2]
    assert _LEAST * abs(wanted) < climbed * math.copysign(1.0, wanted) < _MOST * abs(wanted), f"{climbed:.2f} m"


@check("square")
def up_is_up(case: Case) -> None:
    """A setpoint along z climbs."""
    _climb(case, "up", CLIMB_S * CLIMB_M_S)


@check("square")
def down_is_down(case: Case) -> None:
    """A setpoint against z descends."""
    _climb(case, "down", -CLIMB_S * CLIMB_M_S)


@check("square")
def turn_is_counter_clockwise(case: Case) -> None:
    """A positive turn is counter-clockwise, by radians per second."""
    came, ideal = turned(case.record.motion("turn")), 2.0 * TURN_RAD_S
    assert _LEAST * ideal < came < _MOST * ideal, f"{came:.2f} rad of {ideal:.2f} rad"


@check("square")
def forward_turns_with_it(case: Case) -> None:
    """After a turn a setpoint along x flies along the new heading."""
    forward, left = _way(case, "forward after the turn", 0.4)
    assert forward > _LEAST * SPEED_M_S * LEG_S, f"{forward:.2f} m forward"
    assert abs(left) < _ASIDE * SPEED_M_S * LEG_S, f"{left:.2f} m aside"


@check("square")
def speed_limit_is_kept(case: Case) -> None:
    """Asked for one and a half times the speed limit of the field file, it flies no faster than that limit."""
    speed = float(np.mean([one.speed for one in case.record.motion("too fast", 1.2)]))
    assert speed < 1.2 * LIMITS.max_speed_m_s, f"{speed:.2f} m/s, {LIMITS.max_speed_m_s:.2f} allowed"


@check("square")
def hovers_still(case: Case) -> None:
    """At zero velocity it drifts less than 0.3 m in 1.5 s."""
    motion = case.record.motion("still")
    drift = math.dist(motion[0].position, motion[-1].position)
    assert drift < 0.3, f"{drift:.2f} m"


@check("square")
def take_off_ends_in_hover(case: Case) -> None:
    """After TAKEOFF it is aloft, waits in HOVER, and no setpoint moves it."""
    modes = {one.message.mode for one in case.record.heard(VEHICLE_STATUS, "hover")}
    assert modes == {"HOVER"}, f"modes {modes}"
    assert case.record.motion("hover")[-1].position[2] > 0.3, "it is too low"


@check("square")
def take_off_is_answered(case: Case) -> None:
    """TAKEOFF is RECEIVED, ACCEPTED, and EFFECTIVE once it flies."""
    stages = case.record.stages("take off", COMMAND_ACK)
    assert stages == _DONE, " ".join(stages)


@check("square")
def track_is_answered(case: Case) -> None:
    """TRACK is RECEIVED, ACCEPTED, and EFFECTIVE once a setpoint is obeyed."""
    stages = case.record.stages("track", COMMAND_ACK)
    assert stages == _DONE, " ".join(stages)


@check("square")
def hold_is_answered(case: Case) -> None:
    """HOLD is RECEIVED, ACCEPTED, and EFFECTIVE once the vehicle says that it hovers."""
    stages = case.record.stages("hold", COMMAND_ACK)
    assert stages == _DONE, " ".join(stages)


@check("square")
def hold_goes_before_setpoints(case: Case) -> None:
    """In HOLD setpoints move nothing."""
    speed = max(one.speed for one in case.record.motion("held", 1.3))
    assert speed < 0.25, f"{speed:.2f} m/s"


@check("square")
def repeated_land_is_answered_again(case: Case) -> None:
    """LAND is effective once it stands; the same id is answered again."""
    stages = case.record.stages("land", COMMAND_ACK)
    assert stages.count(AckStage.RECEIVED) == 2 and stages[-1] == AckStage.EFFECTIVE, " ".join(stages)


@check("square")
def lands(case: Case) -> None:
    """LAND brings it down within 12 s, motors off."""
    case.record.span("landing")
    assert case.record.facts["landing"] < 12.0, f"{case.record.facts['landing']:.1f} s"


@check("square")
def stays_down(case: Case) -> None:
    """Once landed it stays down while setpoints still come."""
    assert not [one for one in case.record.motion("landed", 0.3) if not one.on_ground or one.motors], "it rose again"


@check("square")
def flies_again(case: Case) -> None:
    """After a landing it takes off once more."""
    stages = case.record.stages("take off again", COMMAND_ACK)
    assert stages == _DONE, f"{' '.join(stages)} {case.record.failure}"


@check("square")
def flight_states_follow(case: Case) -> None:
    """LANDED, then aloft, then LANDED: the reported state follows the true one within 1.5 s."""
    begin, end = case.record.span("landed")
    after = [one.message.flight_state for one in case.record.heard(VEHICLE_STATUS) if begin + 1.4e9 <= one.at_ns <= end]
    assert set(after) <= {"LANDED"}, f"after the landing: {after}"
    aloft = {one.message.flight_state for one in case.record.heard(VEHICLE_STATUS, "forward")}
    assert aloft <= {"FLYING", "HOVERING"} and aloft, f"in flight: {aloft}"
