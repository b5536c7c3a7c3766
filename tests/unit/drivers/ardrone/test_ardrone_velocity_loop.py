"""The velocity loop on AR.Drone dynamics: tilt 10/63/90 % after 90/180/270 ms, velocity delayed and too low."""

import math
import random
from collections import deque

import pytest

from drivers.ardrone.settings import ArDroneLimits
from drivers.ardrone.velocity_loop import VelocityLoop

TICK_S = 0.005
DEAD_S, FREQUENCY, DAMPING = 0.07, 15.0, 0.9


class Tilt:
    """Dead time and a second order lag."""

    def __init__(self):
        self.angle = self.rate = 0.0
        self.waiting = deque([0.0] * round(DEAD_S / TICK_S))

    def step(self, wanted):
        self.waiting.append(wanted)
        pull = FREQUENCY**2 * (self.waiting.popleft() - self.angle) - 2 * DAMPING * FREQUENCY * self.rate
        self.rate += pull * TICK_S
        self.angle += self.rate * TICK_S
        return self.angle


def fly(
    wanted, seconds, gain=0.85, delay_s=0.03, drag=0.45, bias_deg=0.0, seed=0,
    scale=1.18, sensed=True, wall_s=0.0, wind=0.0, braced=0.0,
):  # fmt: skip
    """Return the true velocities along x for a wanted velocity as a function of time.

    sensed: the accelerometers are fed, with their gain error and noise; wall_s: blocked for this time at first; wind:
    push of the air from second 3 on [m/s^2], of which the firmware itself counters the share `braced`.
    """
    rng, loop, tilt = random.Random(seed), VelocityLoop(ArDroneLimits()), Tilt()
    late = deque([0.0] * round(delay_s / TICK_S))
    speed, pitch, speeds, next_s, air = 0.0, 0.0, [], 0.0, []
    for i in range(round(seconds / TICK_S)):
        now_s = i * TICK_S
        late.append(speed * gain + rng.gauss(0, 0.03))
        measured = late.popleft() * scale
        angle = tilt.step(pitch) + math.radians(bias_deg)
        push = wind * (1.0 - math.exp(3.0 - now_s)) if now_s > 3.0 else 0.0
        outside = push - drag * speed
        speed += (9.81 * math.tan(angle) + outside - braced * push) * TICK_S
        if now_s < wall_s:
            speed = 0.0
        pull = -9.81 * math.tan(angle) if now_s < wall_s else outside
        air.append(0.92 * pull + rng.gauss(0, 0.045))
        if now_s >= next_s:
            next_s += 1 / 40
            force = (sum(air) / len(air), 0.0) if sensed else None
            air.clear()
            pitch = loop.step((wanted(now_s), 0.0, 0.0), 0.0, (measured, 0.0, 0.0), 1 / 40, force).pitch_rad
        speeds.append(speed)
    return speeds


def test_the_model_answers_like_the_recorded_drone():
    tilt, times = Tilt(), dict[float, float]()
    for i in range(200):
        angle = tilt.step(1.0)
        for share in (0.1, 0.63, 0.9):
            if angle >= share:
                times.setdefault(share, i * TICK_S)
    assert times[0.1] == pytest.approx(0.09, abs=0.03)
    assert times[0.63] == pytest.approx(0.18, abs=0.03)
    assert times[0.9] == pytest.approx(0.27, abs=0.03)


@pytest.mark.parametrize("gain", [0.8, 0.9])
@pytest.mark.parametrize("delay_s", [0.02, 0.04])
@pytest.mark.parametrize("drag", [0.2, 0.5])
def test_a_step_of_half_a_metre_per_second(gain, delay_s, drag):
    """90 % in 1.2 s, at most 15 % over, although the odometry has the calibration error of its scale."""
    for seed in range(3):
        speed = fly(lambda t: 0.5, 6.0, gain, delay_s, drag, seed=seed)
        assert next(i for i, v in enumerate(speed) if v >= 0.45) * TICK_S <= 1.2
        assert max(speed[:500]) <= 1.15 * 0.5
        assert sum(speed[-400:]) / 400 == pytest.approx(0.5 / (1.18 * gain), abs=0.03)


def test_without_accelerometers_it_is_less_sharp_but_arrives():
    for seed in range(3):
        speed = fly(lambda t: 0.5, 8.0, seed=seed, sensed=False)
        assert next(i for i, v in enumerate(speed) if v >= 0.45) * TICK_S <= 2.5
        assert max(speed) <= 1.3 * 0.5
        assert sum(speed[-400:]) / 400 == pytest.approx(0.5, abs=0.04)


def test_stopping_does_not_swing():
    speeds = fly(lambda t: 0.5 if t < 4 else 0.0, 5.0)
    assert min(speeds[800:]) > -0.1
    assert abs(speeds[round(5.0 / TICK_S) - 1]) < 0.08


def test_a_constant_tilt_error_is_integrated_away():
    speeds = fly(lambda t: 0.3, 12.0, bias_deg=1.0)
    assert sum(speeds[-600:]) / 600 == pytest.approx(0.3, abs=0.04)


@pytest.mark.parametrize("sensed", [True, False])
def test_being_held_back_does_not_wind_it_up(sensed):
    """Blocked by a wall for 10 s, then released: it must not shoot off."""
    speeds = fly(lambda t: 0.5, 14.0, wall_s=10.0, sensed=sensed)
    assert max(speeds) <= 1.2
    assert abs(sum(speeds[-200:]) / 200 - 0.5) <= 0.12


def test_a_standing_drone_teaches_what_its_accelerometers_show_when_level():
    """A bias of 0.3 m/s^2, as on the recorded AR.Drone 2, must not move a hovering drone."""
    loop = VelocityLoop(ArDroneLimits())
    for _ in range(400):
        loop.stand((0.3, -0.2), 1 / 40)
    loop.reset()
    out = loop.step((0.0, 0.0, 0.0), 0.1, (0.0, 0.0, 0.0), 1 / 40, (0.3, -0.2))
    assert abs(out.pitch_rad) < 0.001 and abs(out.roll_rad) < 0.001


def test_one_that_goes_blind_as_it_stops_is_braked_from_the_speed_it_told_last():
    """Its own hover ends with its flow. With an estimate begun from zero it glided at 0.17 m/s until it had landed."""
    loop = VelocityLoop(ArDroneLimits())
    for speed in (0.4, 0.38, 0.35, 0.32, 0.3):
        assert loop.hold((speed, -speed, 0.0), 1 / 40).hover
    out = [loop.brake(1 / 40, (0.0, 0.0)) for _ in range(20)]
    assert min(request.pitch_rad for request in out) < -0.03, "nose up: it flies forward"
    assert min(request.roll_rad for request in out) < -0.03, "to the left: it flies to the right"


def test_the_speed_before_a_flight_is_no_guide_to_braking_after_it():
    loop = VelocityLoop(ArDroneLimits())
    loop.hold((0.5, 0.5, 0.0), 1 / 40)
    settled = [loop.step((0.0, 0.0, 0.0), 0.0, (0.0, 0.0, 0.0), 1 / 40).hover for _ in range(80)]
    out = [loop.brake(1 / 40, (0.0, 0.0)) for _ in range(20)]
    assert settled[-1] and max(abs(request.pitch_rad) + abs(request.roll_rad) for request in out) < 0.02


def test_turning_while_flying_pulls_inwards():
    loop = VelocityLoop(ArDroneLimits())
    for _ in range(80):
        out = loop.step((0.5, 0.0, 0.0), 1.0, (0.5, 0.0, 0.0), 1 / 40, (-0.1, 0.0))
    assert out.roll_rad == pytest.approx(-math.atan(0.5 / 9.81), abs=0.02), "0.5 m/s x 1 rad/s, to the left"


def test_zero_hands_over_to_the_drones_own_hover_after_a_while():
    loop = VelocityLoop(ArDroneLimits())
    zero = ((0.0, 0.0, 0.0), 0.0, (0.1, 0.0, 0.0), 1 / 30)
    outputs = [loop.step(*zero).hover for _ in range(60)]
    assert not outputs[0] and outputs.index(True) == pytest.approx(30, abs=1) and outputs[-1]
    assert not loop.step((0.1, 0.0, 0.0), 0.0, (0.0, 0.0, 0.0), 1 / 30).hover
    assert not loop.step((0.0, 0.0, 0.0), 0.5, (0.0, 0.0, 0.0), 1 / 30).hover, "turning is no hover"


def test_limits_hold_whatever_is_asked():
    loop = VelocityLoop(ArDroneLimits(max_tilt_deg=12, max_climb_m_s=0.4, max_yaw_rate_deg_s=60))
    for wanted in ((50.0, -50.0, 9.0), (-50.0, 50.0, -9.0)):
        out = loop.step(wanted, 99.0, (0.0, 0.0, 0.0), 1 / 30)
        assert math.hypot(math.tan(out.roll_rad), math.tan(out.pitch_rad)) <= math.tan(math.radians(12)) + 1e-9
        assert abs(out.climb_m_s) <= 0.4 and abs(out.yaw_rate_rad_s) <= math.radians(60) + 1e-9


def test_left_is_negative_roll_and_forward_positive_pitch():
    out = VelocityLoop(ArDroneLimits()).step((0.3, 0.3, 0.0), 0.0, (0.0, 0.0, 0.0), 1 / 30)
    assert out.pitch_rad > 0 > out.roll_rad


def fly_blindly(wanted, seconds, reported, sensed=True, heeds=True, noise=0.0, wind=0.0):
    """Return the true speeds with constant odometry, and the time at which the loop contradicted it [s].

    wind: push of the air [m/s^2].
    """
    rng, loop, tilt = random.Random(0), VelocityLoop(ArDroneLimits()), Tilt()
    speed, pitch, speeds, air, found_s = 0.0, 0.0, [], [], None
    for i in range(round(seconds / TICK_S)):
        angle = tilt.step(pitch)
        brake = speed * (0.2 + 0.1 * abs(speed)) - wind  # slippery air
        speed += (9.81 * math.tan(angle) - brake) * TICK_S
        air.append(-0.92 * brake + rng.gauss(0, 0.045))
        if i % 5 == 0:
            force = (sum(air) / len(air), 0.0) if sensed else None
            air.clear()
            measured = (reported + rng.gauss(0, noise), 0.0, 0.0)
            pitch = loop.step((wanted, 0.0, 0.0), 0.0, measured, 1 / 40, force).pitch_rad
            if loop.contradicted and found_s is None:
                found_s = i * TICK_S
            if heeds and found_s is not None:
                pitch = 0.0
        speeds.append(speed)
    return speeds, found_s


@pytest.mark.parametrize("sensed", [True, False])
@pytest.mark.parametrize("noise", [0.0, 0.03])
@pytest.mark.parametrize("wanted", [0.3, 0.6])
def test_a_velocity_stuck_at_0_cannot_wind_up_tilt(wanted, noise, sensed):
    """Trusting it gave 1.76 m/s: tilt is bounded by the drag, and the contradiction is detected."""
    speeds, _ = fly_blindly(wanted, 20.0, 0.0, sensed, heeds=False, noise=noise)
    assert max(speeds) <= 1.3, "if nobody heeds it, for ever"
    speeds, found_s = fly_blindly(wanted, 20.0, 0.0, sensed, noise=noise)
    assert found_s is not None and found_s <= 3.0 and max(speeds) <= 0.95


@pytest.mark.parametrize(("wanted", "reported", "within_s"), [(0.0, 0.5, 1.0), (0.3, 0.8, 0.5), (0.3, -0.2, 1.1)])
def test_a_speed_that_nobody_asked_for_is_noticed_within_a_second(wanted, reported, within_s):
    """A drone led off by its drifting velocity was 0.8 m beside its belief until the driver stopped it."""
    _, found_s = fly_blindly(wanted, 5.0, reported, noise=0.03)
    assert found_s is not None and found_s <= within_s


@pytest.mark.parametrize("wind", [-0.8, 0.8])
def test_a_velocity_stuck_at_0_in_wind_is_noticed_in_time(wind):
    speeds, found_s = fly_blindly(0.5, 20.0, 0.0, noise=0.03, wind=wind)
    assert found_s <= 2.0
    # Most of it is the wind's: the firmware does not counter it without flow.
    assert max(abs(speed) for speed in speeds[: round(found_s / TICK_S)]) <= 1.5


@pytest.mark.parametrize("drag", [0.2, 0.5])
@pytest.mark.parametrize("braced", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("wind", [-1.6, -0.8, 0.4, 0.8, 1.6])
def test_wind_that_the_accelerometers_show_is_flown_against(wind, braced, drag, contradictions):
    speeds = fly(lambda t: 0.3, 12.0, wind=wind, drag=drag, gain=0.83, braced=braced)
    off = [abs(speed - 0.3) for speed in speeds]
    assert max(off) <= 0.4 and max(off[round(8.0 / TICK_S) :]) <= 0.12
    assert contradictions and not any(contradictions)


@pytest.fixture
def contradictions(monkeypatch):
    found = []
    step = VelocityLoop.step

    def watched(self, *arguments):
        asked = step(self, *arguments)
        found.append(self.contradicted)
        return asked

    monkeypatch.setattr(VelocityLoop, "step", watched)
    return found


@pytest.mark.parametrize("sensed", [True, False])
def test_a_healthy_flight_is_never_contradicted(sensed, contradictions):
    for seed in range(3):
        fly(lambda t: 0.5 * math.copysign(1.0, math.sin(0.8 * t)), 20.0, seed=seed, sensed=sensed, bias_deg=1.0)
    assert len(contradictions) > 2000 and not any(contradictions)


def stop_blindly(push, seen_s, wrong=0.0, drift=0.0, cameras=False, told_s=9.0, offset=0.0):
    """Fly 0.5 m/s, with flow until seen_s, then for 0.7 s with a speed that is off by `wrong`, then brake for 4 s.

    Return the true speeds of the last second; push: of the air from the brake on [m/s^2]; drift: error of the measured
    speed in flight [m/s]; cameras: whether they see the drone; told_s: the accelerometers are fed for this time after
    seen_s; offset: theirs [m/s^2], as the standing drone has shown.
    """
    rng, loop, tilt = random.Random(1), VelocityLoop(ArDroneLimits()), Tilt()
    for _ in range(400):
        loop.stand((offset, 0.0), 1 / 40)
    speed, pitch, speeds, air = 0.0, 0.0, list[float](), []
    for i in range(round((seen_s + 4.7) / TICK_S)):
        now_s = i * TICK_S
        outside = -speed * (0.2 + 0.1 * abs(speed)) + (push if now_s > seen_s else 0.0)
        speed += (9.81 * math.tan(tilt.step(pitch)) + outside) * TICK_S
        air.append(0.92 * outside + offset + rng.gauss(0, 0.045))
        if i % 5 == 0:
            force = (sum(air) / len(air), 0.0) if now_s < seen_s + told_s else None
            air.clear()
            measured = (speed + drift + rng.gauss(0, 0.04), 0.0, 0.0) if now_s < seen_s else None
            measured = (speed + wrong, 0.0, 0.0) if wrong and now_s >= seen_s else measured
            half_second = speeds[-round(0.55 / TICK_S) :] or [0.0]
            seen = (sum(half_second) / len(half_second) + rng.gauss(0, 0.05), 0.0) if cameras else None
            asked = (
                loop.step((0.5, 0.0, 0.0), 0.0, measured, 1 / 40, force)
                if now_s < seen_s + 0.7
                else loop.brake(1 / 40, force, seen)
            )
            assert not asked.hover
            pitch = asked.pitch_rad
        speeds.append(speed)
    return speeds[-round(1.0 / TICK_S) :]


@pytest.mark.parametrize("push", [0.0, 0.15, -0.15])
@pytest.mark.parametrize("seen_s", [1.0, 4.0])
def test_a_drone_that_sees_no_floor_is_braked_by_what_it_knows(seen_s, push):
    """Level, as its firmware hovers then, it would still do 0.3 m/s: air alone hardly brakes."""
    assert max(abs(speed) for speed in stop_blindly(push, seen_s)) <= 0.12


@pytest.mark.parametrize("push", [0.0, 0.15, -0.15])
@pytest.mark.parametrize("offset", [0.0, 0.2, -0.2])
def test_one_that_falls_silent_besides_is_braked_by_what_its_accelerometers_showed_last(push, offset):
    """From 0.5 m/s: commanded to hold its place without a floor it came to rest on the floor, 6.5 s later."""
    assert max(abs(speed) for speed in stop_blindly(push, 4.0, told_s=0.9, offset=offset)) <= 0.15


def test_a_speed_that_contradicts_the_requests_is_no_guide_to_braking():
    assert max(abs(speed) for speed in stop_blindly(0.0, 4.0, wrong=-0.9)) <= 0.25


@pytest.mark.parametrize("wrong", [0.0, -0.9])
def test_cameras_tell_a_drone_that_sees_no_floor_its_speed(wrong):
    """Its speed had drifted by 0.3 m/s before: it would keep that speed."""
    assert max(abs(speed) for speed in stop_blindly(0.0, 4.0, wrong, drift=0.3)) >= 0.15
    assert max(abs(speed) for speed in stop_blindly(0.0, 4.0, wrong, drift=0.3, cameras=True)) <= 0.08
