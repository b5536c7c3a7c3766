"""Checks of a vehicle's measurements against the truth: signs, units, rates, deviations."""

import itertools
import math
import struct
from collections.abc import Sequence

import numpy as np

from groundstation.bus.topics import IMU, ODOMETRY, RAW_TX
from groundstation.time_units import NS_PER_MS
from sim_bridge.conformance.check import Case, NotApplicable, check
from sim_bridge.conformance.flights import LEG_S, SPEED_M_S, TURN_RAD_S
from sim_bridge.conformance.record import Heard

_LEGS = ("forward", "left", "back", "right")
_STD_M_S = 0.15
_GRAVITY_M_S2 = 9.81
_RATE_NS = 20 * NS_PER_MS  # on both sides, over which a true rate is taken
_HARDLY = 0.01  # rad or rad/s
_FRAMING = struct.Struct("<qI")  # of recorded datagrams: stamp, length


def _odometry(case: Case, *marks: str) -> list[Heard]:
    found = [one for mark in marks for one in case.record.heard(ODOMETRY, mark)]
    assert found, "no odometry"
    return found


def _fit(case: Case, axis: int, marks: Sequence[str]) -> tuple[float, float]:
    """Return slope and correlation of the reported velocity of an axis over the true one."""
    told, true = [], []
    for one in _odometry(case, *marks):
        now = case.record.at(one.message.header.stamp_ns)
        told.append(one.message.velocity_m_s[axis])
        true.append((*now.forward_left, now.velocity[2])[axis])
    slope = float(np.dot(told, true) / np.dot(true, true))
    return slope, float(np.corrcoef(told, true)[0, 1])


@check("square")
def odometry_comes_often(case: Case) -> None:
    """Odometry comes at 8 Hz at least, with no pause longer than 0.3 s."""
    heard = _odometry(case, "forward")
    rate = len(heard) / LEG_S
    pause = max(b.at_ns - a.at_ns for a, b in itertools.pairwise(heard)) / 1e9
    assert rate >= 8.0 and pause < 0.3, f"{rate:.1f} Hz, longest pause {pause:.2f} s"


@check("square")
def forward_velocity_is_told(case: Case) -> None:
    """The reported velocity along x has the sign and unit of the true one."""
    slope, correlation = _fit(case, 0, ("forward", "back", "left"))
    assert 0.6 < slope < 1.3 and correlation > 0.85, f"slope {slope:.2f}, correlation {correlation:.2f}"


@check("square")
def left_velocity_is_told(case: Case) -> None:
    """The reported velocity along y has the sign and unit of the true one."""
    slope, correlation = _fit(case, 1, ("left", "right", "forward"))
    assert 0.6 < slope < 1.3 and correlation > 0.85, f"slope {slope:.2f}, correlation {correlation:.2f}"


@check("square")
def climb_is_told(case: Case) -> None:
    """The reported climb rate, where there is one, has the sign and unit of the true one."""
    if not case.subject.kind.habits.reports_climb:
        raise NotApplicable("it reports no climb rate")
    slope, correlation = _fit(case, 2, ("up", "down"))
    assert 0.6 < slope < 1.3 and correlation > 0.8, f"slope {slope:.2f}, correlation {correlation:.2f}"


@check("square")
def velocity_turns_with_it(case: Case) -> None:
    """After a turn the reported velocity is still that along its own axes."""
    told = [one.message.velocity_m_s for one in _odometry(case, "forward after the turn")]
    forward, left = np.mean([one[:2] for one in told[len(told) // 2 :]], axis=0)
    assert forward > 0.6 * SPEED_M_S and abs(left) < 0.5 * SPEED_M_S, f"forward {forward:.2f}, left {left:.2f} m/s"


@check("square")
def heading_is_told(case: Case) -> None:
    """The reported heading turns as the true one does, counter-clockwise."""
    heard = _odometry(case, "turn")
    told = math.remainder(heard[-1].message.yaw_rad - heard[0].message.yaw_rad, math.tau)
    ends = [case.record.at(one.message.header.stamp_ns).attitude[2] for one in (heard[0], heard[-1])]
    true = math.remainder(ends[1] - ends[0], math.tau)
    assert abs(told - true) < 0.15, f"told {told:.2f} rad, true {true:.2f} rad"


def _tilt(case: Case, axis: int, marks: Sequence[str]) -> float:
    """Return the correlation of the reported tilt with the true one over spans."""
    pairs = [
        ((one.message.roll_rad, one.message.pitch_rad)[axis], case.record.at(one.message.header.stamp_ns))
        for one in _odometry(case, *marks)
    ]
    told, true = [p[0] for p in pairs], [p[1].attitude[axis] for p in pairs]
    if float(np.std(true)) < math.radians(0.4):
        raise NotApplicable("it hardly leans")
    return float(np.corrcoef(told, true)[0, 1])


@check("square")
def pitch_is_told(case: Case) -> None:
    """Pitch is positive with the nose down."""
    correlation = _tilt(case, 1, ("forward", "back"))
    assert correlation > 0.5, f"correlation with the true pitch {correlation:.2f}"


@check("square")
def roll_is_told(case: Case) -> None:
    """Roll is positive with the right side down."""
    correlation = _tilt(case, 0, ("left", "right"))
    assert correlation > 0.5, f"correlation with the true roll {correlation:.2f}"


@check("square")
def height_is_told(case: Case) -> None:
    """The reported height, where there is one, is that above the floor within 0.15 m."""
    heights = [(one.message.height_m, one) for one in _odometry(case, "still") if one.message.height_m is not None]
    if not heights:
        raise NotApplicable("it reports no height")
    off = np.mean([height - case.record.at(one.message.header.stamp_ns).position[2] for height, one in heights])
    assert abs(off) < 0.15, f"{off:.2f} m off"


@check("square")
def odometry_is_fresh(case: Case) -> None:
    """Odometry is stamped with the host's boot clock, not in the future, and arrives within 0.25 s; stamps rise."""
    heard = _odometry(case, "forward", "left")
    ages = [(one.at_ns - one.message.header.stamp_ns) / 1e9 for one in heard]
    stamps = [one.message.header.stamp_ns for one in heard]
    assert min(ages) > -0.002 and max(ages) < 0.25, f"ages {min(ages):.3f} to {max(ages):.3f} s"
    assert all(a < b for a, b in itertools.pairwise(stamps)), "stamps do not rise"


@check("square")
def velocity_covariance_is_honest(case: Case) -> None:
    """The covariance of the velocity is symmetric and positive definite, between 0.005 and 0.5 m/s."""
    for one in _odometry(case, "forward"):
        matrix = np.array(one.message.velocity_covariance).reshape(3, 3)
        assert np.allclose(matrix, matrix.T), "it is not symmetric"
        values = np.linalg.eigvalsh(matrix)[-2:]
        assert values[0] >= 0.005**2 and values[1] <= 0.5**2, f"deviations {np.sqrt(np.abs(values))}"


@check("square")
def velocity_deviation_is_true(case: Case) -> None:
    """The reported velocity is not wrong by more than 0.15 m/s in the middle of the legs."""
    errors = []
    for mark in _LEGS:
        for one in _odometry(case, mark):
            now = case.record.at(one.message.header.stamp_ns)
            errors.append(math.dist(one.message.velocity_m_s[:2], now.forward_left))
    rms = float(np.sqrt(np.mean(np.square(errors))) / math.sqrt(2.0))
    assert rms < _STD_M_S, f"{rms:.2f} m/s a single axis"


def _imu(case: Case, mark: str) -> list[Heard]:
    heard = case.record.heard(IMU, mark)
    if not heard:
        raise NotApplicable("it publishes no IMU samples")
    return heard


@check("square")
def accelerometers_point_up(case: Case) -> None:
    """The specific force of a hovering vehicle, where it is reported, is 9.81 m/s^2 up."""
    force = np.mean([one.message.specific_force_m_s2 for one in _imu(case, "still")], axis=0)
    assert abs(force[2] - _GRAVITY_M_S2) < 0.8 and np.hypot(force[0], force[1]) < 1.0, f"{force.round(2)}"


@check("square")
def gyroscopes_turn_the_right_way(case: Case) -> None:
    """The body rate about z, where it is reported, is positive in a counter-clockwise turn."""
    rate = float(np.median([one.message.angular_velocity_rad_s[2] for one in _imu(case, "turn")]))
    assert 0.6 * TURN_RAD_S < rate < 1.4 * TURN_RAD_S, f"{rate:.2f} rad/s"


def _true_rate(case: Case, at_ns: int, axis: int) -> float:
    """Return the true rate of roll (0) or pitch (1) [rad/s]; nearly the body's own, for it leans little."""
    before, after = (case.record.at(at_ns + offset).attitude[axis] for offset in (-_RATE_NS, _RATE_NS))
    return (after - before) / (2e-9 * _RATE_NS)


def _agrees(told: Sequence[float], true: Sequence[float]) -> float:
    """Return the correlation of reported values with true ones."""
    if float(np.std(true)) < _HARDLY:
        raise NotApplicable("it hardly leans")
    return float(np.corrcoef(told, true)[0, 1])


def _rate(case: Case, axis: int, marks: Sequence[str]) -> float:
    """Return the correlation of the reported rate of roll (0) or pitch (1) with the true one over spans."""
    heard = [one for mark in marks for one in _imu(case, mark)]
    true = [_true_rate(case, one.message.header.stamp_ns, axis) for one in heard]
    return _agrees([one.message.angular_velocity_rad_s[axis] for one in heard], true)


@check("square")
def gyroscopes_roll_the_right_way(case: Case) -> None:
    """The body rate about x, where it is reported, is positive as the right side goes down."""
    correlation = _rate(case, 0, ("left", "right"))
    assert correlation > 0.3, f"correlation with the true rate {correlation:.2f}"


@check("square")
def gyroscopes_pitch_the_right_way(case: Case) -> None:
    """The body rate about y, where it is reported, is positive as the nose goes down."""
    correlation = _rate(case, 1, ("forward", "back"))
    assert correlation > 0.3, f"correlation with the true rate {correlation:.2f}"


@check("square")
def attitude_of_the_imu_is_that_of_the_body(case: Case) -> None:
    """The quaternion of IMU samples, where they have one, turns body into world: it leans as the vehicle does."""
    heard = [one for mark in _LEGS for one in _imu(case, mark) if one.message.attitude is not None]
    if not heard:
        raise NotApplicable("its IMU tells no attitude")
    true = [case.record.at(one.message.header.stamp_ns).attitude for one in heard]
    leans = [_lean(one.message.attitude) for one in heard]
    least = min(_agrees([lean[axis] for lean in leans], [a[axis] for a in true]) for axis in (0, 1))
    assert least > 0.5, f"correlation with the true lean {least:.2f}"


def _lean(attitude: Sequence[float]) -> tuple[float, float]:
    """Return roll and pitch [rad] of a quaternion (w, x, y, z)."""
    w, x, y, z = attitude
    return math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)), math.asin(2.0 * (w * y - z * x))


@check("square")
def commands_are_sent_often(case: Case) -> None:
    """In TRACK the vehicle is sent datagrams at 10 Hz at least."""
    count = 0
    for one in case.record.heard(RAW_TX, "forward"):
        payload, offset = one.received.payload, 0
        while offset + _FRAMING.size <= len(payload):
            offset += _FRAMING.size + _FRAMING.unpack_from(payload, offset)[1]
            count += 1
    assert count / LEG_S >= 10.0, f"{count / LEG_S:.1f} Hz"


@check("square")
def stop_after_a_flight_ends_the_driver(case: Case) -> None:
    """SIGTERM after a flight ends the driver with exit code 0."""
    case.record.span("second landing")
    assert case.record.exits == [0], f"exit code {case.record.exits}"
