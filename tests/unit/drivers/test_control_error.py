"""A vehicle that does not do what it is told is found out; one that lags, swings and shakes is not."""

import math
import random
from typing import Any

import pytest

from drivers.control_error import ControlErrorMonitor
from drivers.seen_velocity import SeenVelocity
from drivers.watchdog_types import Action, DriverMode, VehicleView, WatchdogDecision
from groundstation.bus.messages import EntityEstimate, FlightState

S = 1_000_000_000
TURN_S = 0.025


def told(x=0.0, y=0.0, turn=0.0, action=Action.FLY, mode=DriverMode.TRACK):
    return WatchdogDecision(mode, action, (x, y, 0.0), turn)


def view(x=0.0, y=0.0, state=FlightState.FLYING):
    return VehicleView(state, True, 0.9, velocity_m_s=(x, y, 0.0))


def fly(command, answer, seconds=8.0, seen=lambda t: None):
    """Return (when it was first said to stray, what was said) for a command and velocities as functions of time."""
    monitor = ControlErrorMonitor()
    for turn in range(round(seconds / TURN_S)):
        at_s = turn * TURN_S
        judged = monitor.judge(round(at_s * S) + S, view(*answer(at_s)), command(at_s), seen(at_s))
        if judged.stray:
            return at_s, judged.stray
    return None, ""


class Lag:
    """Second order with dead time, gusts and noise, as the slowest of the emulated vehicles."""

    def __init__(self, seed, gain=1.0, rate=3.3, damping=0.75, dead_s=0.13):
        self.rng, self.gain, self.rate, self.damping = random.Random(seed), gain, rate, damping
        self.waiting = [0.0] * round(dead_s / TURN_S)
        self.speed = self.change = self.gust = 0.0

    def step(self, wanted):
        self.waiting.append(wanted * self.gain)
        pull = self.rate**2 * (self.waiting.pop(0) - self.speed) - 2 * self.damping * self.rate * self.change
        self.gust += -self.gust * TURN_S / 0.8 + self.rng.gauss(0, 0.05) * math.sqrt(TURN_S)
        self.change += pull * TURN_S
        self.speed += (self.change + self.gust) * TURN_S
        return self.speed + self.rng.gauss(0, 0.05)


@pytest.mark.parametrize("gain", [0.8, 1.0, 1.15])
def test_healthy_vehicles_under_commands_that_change_often_give_no_alarm(gain):
    for seed in range(8):
        rng, lags = random.Random(seed), (Lag(seed, gain), Lag(seed + 100, gain))
        wanted = [0.0, 0.0]

        def command(at_s, rng=rng, wanted=wanted):
            if rng.random() < TURN_S / 0.7:
                angle, speed = rng.uniform(0, math.tau), rng.uniform(0, 0.6)
                wanted[:] = speed * math.cos(angle), speed * math.sin(angle)
            return told(*wanted)

        def answer(at_s, lags=lags, wanted=wanted):
            return tuple(lag.step(value) for lag, value in zip(lags, wanted, strict=True))

        assert fly(command, answer, 30.0) == (None, "")


@pytest.mark.parametrize(
    ("command", "velocity", "by_s"),
    [
        ((0.5, 0.0), (0.0, 0.0), 2.5),  # held back, or a velocity that says 0 with noise
        ((0.3, 0.0), (-0.3, 0.0), 1.8),  # turned round
        ((0.3, 0.0), (0.0, 0.4), 2.2),  # axes swapped
        ((0.0, 0.0), (0.6, 0.0), 1.0),  # it drifts away while it should hover
        ((0.3, 0.0), (0.9, 0.0), 1.0),  # three times as fast
    ],
)
def test_a_vehicle_that_does_something_else_is_found_in_time(command, velocity, by_s):
    rng = random.Random(1)
    at_s, said = fly(lambda t: told(*command), lambda t: tuple(v + rng.gauss(0, 0.03) for v in velocity))
    assert at_s is not None and at_s <= by_s
    assert "reported" in said and f"{math.hypot(*command):.1f} m/s asked" in said


def test_what_cameras_see_convicts_a_velocity_that_lies():
    at_s, said = fly(lambda t: told(0.3), lambda t: (0.3, 0.0), seen=lambda t: (1.2, 0.0))
    assert at_s is not None and at_s <= 1.2 and "1.2 m/s seen by cameras" in said
    assert fly(lambda t: told(0.3), lambda t: (0.3, 0.0), seen=lambda t: (0.5, 0.15)) == (None, "")


def test_it_is_over_when_the_vehicle_obeys():
    monitor, strays = ControlErrorMonitor(), []
    for turn in range(400):
        at_s = turn * TURN_S
        velocity = 1.0 if at_s < 3.0 else 0.0
        strays.append(bool(monitor.judge(round(at_s * S), view(velocity), told(action=Action.HOVER), None).stray))
    assert strays[round(2.9 / TURN_S)] and not any(strays[round(3.5 / TURN_S) :])


def test_nobody_is_judged_who_takes_off_lands_or_is_flown_by_a_pilot():
    monitor = ControlErrorMonitor()
    for turn in range(200):
        now_ns = round(turn * TURN_S * S)
        for command, said in (
            (told(mode=DriverMode.LANDING), view(1.0)),
            (told(), view(1.0, state=FlightState.LANDING)),
            (told(), VehicleView(FlightState.FLYING, True, 0.9)),
            (None, view(1.0)),
        ):
            judged = monitor.judge(now_ns, said, command, (1.0, 0.0))
            assert judged.stray == "" and judged.speed_m_s == 0.0


def test_the_speed_is_the_faster_of_what_is_reported_and_seen():
    judged = ControlErrorMonitor().judge(S, view(0.3, 0.4), told(0.5), (1.5, 0.0))
    assert judged.speed_m_s == pytest.approx(1.3)
    assert ControlErrorMonitor().judge(S, view(0.3, 0.4), told(0.5), None).speed_m_s == pytest.approx(0.5)


def seen_velocity(positions, yaw=0.0, yaw_rate=0.0, **fields):
    seen, velocities = SeenVelocity(), []
    for turn, (x, y) in enumerate(positions):
        heading = yaw + yaw_rate * turn / 50
        values: dict[str, Any] = {"converged": True, "age_s": 0.1, "covariance": (1e-4,) * 16} | fields
        entity = EntityEstimate(
            name="v", kind="robot", mean=(x, y, 0.8, heading), velocity_m_s=(0.0, 0.0, 0.0), **values
        )
        seen.hear(turn * S // 50, 1, entity)
        velocities.append(seen.velocity(turn * S // 50))
    return velocities


def test_positions_seen_become_a_velocity_in_the_vehicles_frame():
    moving = [(0.5 * i / 50, 0.0) for i in range(100)]
    assert seen_velocity(moving)[10] is None
    assert seen_velocity(moving, yaw=math.pi / 2)[-1] == pytest.approx((0.0, -0.5), abs=1e-9)


def test_a_velocity_seen_while_turning_is_the_mean_one_of_the_vehicles_frame():
    velocity = seen_velocity([(0.5 * i / 50, 0.0) for i in range(50)], yaw_rate=1.0)[-1]
    window = [i / 50 for i in range(19, 50)]  # headings of the last 0.6 s
    mean = [0.5 * sum(map(f, window)) / len(window) for f in (math.cos, lambda yaw: -math.sin(yaw))]
    assert velocity == pytest.approx(mean, abs=0.01)


@pytest.mark.parametrize("fields", [{"converged": False}, {"age_s": 2.0}, {"covariance": (0.06**2,) * 16}])
def test_nothing_is_made_of_positions_that_nobody_sees_well(fields):
    assert seen_velocity([(0.5 * i / 50, 0.0) for i in range(100)], **fields)[-1] is None


WIDE: dict[str, Any] = {"covariance": (0.15**2,) * 16}  # nothing tells how it moves, and pictures are 0.15 s under way


def test_a_silent_vehicle_is_seen_where_its_last_picture_showed_it():
    moving = [(0.5 * i / 50, 0.0) for i in range(100)]
    assert seen_velocity(moving, sighting=(0.2, 0.015), **WIDE)[-1] == pytest.approx((0.5, 0.0), abs=1e-9)


def test_a_silent_vehicle_is_timed_by_its_pictures():
    """Ten of them a second, each 0.15 s late: in between its belief stands still."""
    seen = SeenVelocity()
    for turn in range(100):
        late = turn % 5
        place = 1.0 * (turn - late) / 50
        entity = EntityEstimate(
            name="v", kind="robot", mean=(place, 0.0, 0.8, 0.0), velocity_m_s=(0.0, 0.0, 0.0), converged=True,
            age_s=0.15 + late / 50, sighting=(0.15 + late / 50, 0.015), **WIDE
        )  # fmt: skip
        seen.hear(turn * S // 50, 1, entity)
        if turn > 40:
            assert seen.velocity(turn * S // 50) == pytest.approx((1.0, 0.0), abs=1e-6)


@pytest.mark.parametrize("sighting", [None, (0.5, 0.015), (0.2, 0.06)])
def test_a_silent_vehicle_is_not_seen_by_an_old_or_a_poor_picture(sighting):
    assert seen_velocity([(0.0, 0.0)] * 100, sighting=sighting, **WIDE)[-1] is None


def test_a_belief_that_was_set_anew_is_no_flight():
    velocities = seen_velocity([(0.0, 0.0)] * 50 + [(1.0, 0.0)] * 50)
    assert max(abs(v[0]) for v in velocities if v is not None) < 1e-9
