"""A vehicle that does not follow its setpoints is detected; one that lags, swings and shakes is not."""

import math
import random

import pytest

from drivers.control_error import ControlErrorMonitor
from drivers.watchdog_types import Action, DriverMode, VehicleView, WatchdogDecision
from groundstation.bus.messages import FlightState

S = 1_000_000_000
TURN_S = 0.025


def told(x=0.0, y=0.0, turn=0.0, action=Action.FLY, mode=DriverMode.TRACK):
    return WatchdogDecision(mode, action, (x, y, 0.0), turn)


def view(x=0.0, y=0.0, state=FlightState.FLYING):
    return VehicleView(state, True, 0.9, velocity_m_s=(x, y, 0.0))


def fly(command, answer, seconds=8.0, seen=lambda t: None):
    """Return (time of the first alarm, its text) for a setpoint and velocities as functions of time."""
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
        ((0.5, 0.0), (0.0, 0.0), 2.5),  # blocked, or a velocity of 0 with noise
        ((0.3, 0.0), (-0.3, 0.0), 1.8),  # sign reversed
        ((0.3, 0.0), (0.0, 0.4), 2.2),  # axes swapped
        ((0.0, 0.0), (0.6, 0.0), 1.0),  # it drifts away although it should hover
        ((0.3, 0.0), (0.9, 0.0), 1.0),  # three times as fast
    ],
)
def test_a_vehicle_that_does_something_else_is_found_in_time(command, velocity, by_s):
    rng = random.Random(1)
    at_s, said = fly(lambda t: told(*command), lambda t: tuple(v + rng.gauss(0, 0.03) for v in velocity))
    assert at_s is not None and at_s <= by_s
    assert "reported" in said and f"{math.hypot(*command):.1f} m/s asked" in said


def test_camera_observations_reveal_a_wrong_velocity():
    at_s, said = fly(lambda t: told(0.3), lambda t: (0.3, 0.0), seen=lambda t: (1.2, 0.0))
    assert at_s is not None and at_s <= 1.2 and "1.2 m/s seen by cameras" in said
    assert fly(lambda t: told(0.3), lambda t: (0.3, 0.0), seen=lambda t: (0.5, 0.15)) == (None, "")


def test_one_that_strays_by_its_report_may_begin_to_stray_by_cameras():
    """There was a gap between the two, after which the time until its landing began anew."""
    monitor, strays = ControlErrorMonitor(), []
    for turn in range(200):
        reported = 1.0 if turn * TURN_S < 2.0 else 0.0
        judged = monitor.judge(round(turn * TURN_S * S) + S, view(reported), told(action=Action.HOVER), (1.4, 0.0))
        strays.append(bool(judged.stray))
    assert all(strays[round(1.0 / TURN_S) :])


def test_to_stray_again_it_has_to_go_as_far_again():
    """A gust at the end of its way back is none of that."""
    monitor, strays = ControlErrorMonitor(), []
    for turn in range(400):
        at_s = turn * TURN_S
        velocity = 1.0 if at_s < 3.0 else 0.5 if 3.4 < at_s < 3.7 or at_s > 6.0 else 0.0
        judged = monitor.judge(round(at_s * S) + S, view(velocity), told(action=Action.HOVER), None)
        strays.append(bool(judged.stray))
    assert not any(strays[round(3.35 / TURN_S) : round(6.5 / TURN_S)]) and strays[-1]


@pytest.mark.parametrize("how", ["reported", "seen"])
def test_a_velocity_that_is_lost_for_a_moment_does_not_come_back_as_a_stray(how):
    monitor, strays = ControlErrorMonitor(), []
    for turn in range(200):
        at_s = turn * TURN_S
        speed = 1.2 if at_s < 1.5 else 0.0
        lost = 1.6 < at_s < 1.7
        said = view(speed if how == "reported" else 0.0)._replace(fresh=not (lost and how == "reported"))
        seen = (speed, 0.0) if how == "seen" and not lost else None
        strays.append(bool(monitor.judge(round(at_s * S) + S, said, told(action=Action.HOVER), seen).stray))
    assert strays[round(1.5 / TURN_S)] and not any(strays[round(1.62 / TURN_S) :])


def after_a_silence(silent_s, answer, period_s=math.inf):
    """Return when one strays that flew at 0.6 m/s and was told to hover when it fell silent [s]; None: never."""
    monitor = ControlErrorMonitor()
    for turn in range(round(8.0 / TURN_S)):
        at_s = turn * TURN_S - 2.0
        silent = at_s > 0.0 and at_s % period_s < silent_s
        command = told(0.6) if at_s < 0.0 else told(action=Action.HOVER)
        reported = view(answer(max(0.0, at_s - silent_s)))._replace(fresh=not silent)
        if monitor.judge(turn * round(TURN_S * S) + S, reported, command, None).stray:
            return at_s
    return None


def test_one_that_was_not_heard_has_time_to_brake_as_it_may_not_have_heard():
    assert after_a_silence(1.4, lambda at_s: 0.6 * math.exp(-at_s / 0.8)) is None


@pytest.mark.parametrize("silent_s", [1.4, 2.4])
def test_one_that_flies_on_after_a_silence_strays(silent_s):
    assert silent_s < after_a_silence(silent_s, lambda at_s: 0.6) < silent_s + 1.3


def test_short_silences_hide_nothing():
    assert after_a_silence(0.4, lambda at_s: 0.6, period_s=1.0) < 3.0


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
            assert judged.stray == "" and judged.speed_m_s == 0.0 and judged.seen


def test_of_a_vehicle_that_others_fly_only_the_speed_is_judged():
    monitor = ControlErrorMonitor()
    for turn in range(200):
        flown = view(1.5)._replace(foreign=True)
        judged = monitor.judge(round(turn * TURN_S * S), flown, told(), (1.0, 0.0))
        assert judged.stray == "" and judged.speed_m_s == 1.5 and judged.seen


@pytest.mark.parametrize(("reported", "seen"), [(4.7, None), (0.0, 4.7)])
@pytest.mark.parametrize("foreign", [True, False])
def test_of_a_vehicle_that_others_fly_the_climb_is_told_too(foreign, reported, seen):
    flown = view()._replace(foreign=foreign, velocity_m_s=(0.0, 0.0, reported))
    judged = ControlErrorMonitor().judge(S, flown, told(), (0.0, 0.0), seen)
    assert judged.speed_m_s == 0.0 and judged.climb_m_s == pytest.approx(4.7 if foreign else 0.0, abs=0.13)


def test_the_speed_is_the_faster_of_what_is_reported_and_seen():
    judged = ControlErrorMonitor().judge(S, view(0.3, 0.4), told(0.5), (1.5, 0.0))
    assert judged.speed_m_s == pytest.approx(1.3)
    assert ControlErrorMonitor().judge(S, view(0.3, 0.4), told(0.5), None).speed_m_s == pytest.approx(0.5)


@pytest.mark.parametrize("back", [(0.15, -0.1, 0.0), None])
def test_a_hovering_vehicle_that_is_brought_back_does_what_it_is_told(back):
    asked = WatchdogDecision(DriverMode.HOLD, Action.HOVER, back_m_s=back)
    forward, left = (2.2 * 0.15, 2.2 * -0.1)  # within the tolerance of its setpoint, but beyond that of standing
    at_s, _ = fly(lambda _: asked, lambda _: (forward, left))
    assert (at_s is None) == (back is not None)


# -- vertical motion --------------------------------------------------------------------------------------------------


def ride(asked, climb, seconds=8.0, rises=False):
    """Return (time of the first alarm, its text) for a commanded climb and one that cameras see, by time."""
    monitor = ControlErrorMonitor()
    for turn in range(round(seconds / TURN_S)):
        at_s = turn * TURN_S
        command = WatchdogDecision(DriverMode.TRACK, Action.FLY, (0.0, 0.0, asked(at_s)), 0.0)
        said = view()._replace(velocity_m_s=(0.0, 0.0, asked(at_s)), rises=rises)
        stray = monitor.judge(round(at_s * S) + S, said, command, (0.0, 0.0), climb(at_s)).stray
        if stray:
            return at_s, stray
    return None, ""


def test_a_climb_that_was_not_asked_for_is_found_though_the_vehicle_reports_what_it_was_told():
    """As an ArduCopter with accelerometers that read 1 m/s^2 too much: it rises ever faster."""
    at_s, said = ride(lambda t: 0.0 if t < 3 else -0.7, lambda t: 0.0 if t < 3 else 0.65 * (t - 3))
    assert at_s is not None and at_s - 3 <= 1.65
    assert "m/s up seen by cameras, 0.7 m/s down asked" in said


@pytest.mark.parametrize(("asked", "seen"), [(0.3, -0.9), (-0.2, -1.2), (0.4, 1.4)])
def test_a_vehicle_that_moves_the_wrong_way_or_too_fast_is_found(asked, seen):
    at_s, _ = ride(lambda t: asked, lambda t: seen if t > 2 else 0.0)
    assert at_s is not None and at_s - 2 <= 1.3


@pytest.mark.parametrize("asked", [0.6, -0.6])
def test_one_that_stays_is_held_by_floor_ceiling_or_an_object_below(asked):
    assert ride(lambda t: asked, lambda t: 0.0) == (None, "")


def test_healthy_climbs_noise_and_the_end_of_a_take_off_give_no_alarm():
    for seed in range(8):
        rng, lag = random.Random(seed), Lag(seed, 1.15)
        wanted = [0.0]

        def asked(at_s, rng=rng, wanted=wanted):
            if rng.random() < TURN_S / 0.7:
                wanted[0] = rng.uniform(-0.6, 0.6)
            return wanted[0]

        assert ride(asked, lambda t, lag=lag, wanted=wanted: lag.step(wanted[0]), 30.0) == (None, "")
    assert ride(lambda t: 0.0, lambda t: 1.0 if t < 1.2 else 0.0) == (None, "")


def test_a_vehicle_that_keeps_its_height_above_what_is_below_does_not_stray():
    """It climbs over a box at 0.5 m/s, while the tracker asks it down."""
    assert ride(lambda t: -0.4, lambda t: 0.5 if 3 < t < 4.5 else 0.0) == (None, "")
    assert ride(lambda t: -0.4, lambda t: 0.7 if 3 < t < 4 else 0.0) == (None, "")


def test_one_that_continues_to_its_take_off_height_does_not_stray():
    assert ride(lambda t: 0.0, lambda t: 1.0 if t < 3 else 0.0, rises=True) == (None, "")
    assert ride(lambda t: 0.0, lambda t: 1.0 if t < 3 else 0.0)[0] is not None


def test_nobody_is_judged_by_a_climb_that_nobody_sees():
    assert ride(lambda t: 0.0, lambda t: None) == (None, "")
