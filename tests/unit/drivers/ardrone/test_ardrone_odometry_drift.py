"""A drone with drifting optical flow is corrected by cameras; a frozen picture does not drive it away."""

import math
import random
from collections import deque

import pytest

from drivers.ardrone.odometry_drift import DriftLimits, OdometryDrift
from drivers.ardrone.settings import ArDroneLimits
from drivers.ardrone.velocity_loop import VelocityLoop

TICK_S = 1 / 40
CAMERA_TICKS, CAMERA_NOISE_M_S = 22, 0.04


def fly(drift_of, seen_of, seconds=20.0, wanted=0.3, seed=1):
    """Return the true speeds of a drone that answers its tilt after 0.1 s.

    drift_of: time -> error of the odometry [m/s]; seen_of: time, mean speed of the last half second -> the cameras'
    velocity, or None.
    """
    rng, loop = random.Random(seed), VelocityLoop(ArDroneLimits())
    late, speed, speeds = deque([0.0] * 4), 0.0, []
    for i in range(round(seconds / TICK_S)):
        now_s = i * TICK_S
        air = -speed * (0.15 + 0.13 * abs(speed))
        speed += (9.81 * math.tan(late.popleft()) + air) * TICK_S
        speeds.append(speed)
        mean = sum(speeds[-CAMERA_TICKS:]) / len(speeds[-CAMERA_TICKS:])
        seen = seen_of(now_s, mean + rng.gauss(0, CAMERA_NOISE_M_S))
        asked = loop.step(
            (wanted, 0.0, 0.0),
            0.0,
            (speed + drift_of(now_s) + rng.gauss(0, 0.03), 0.0, 0.0),
            TICK_S,
            (0.92 * air + rng.gauss(0, 0.03), 0.0),
            None if seen is None else (seen, 0.0),
        )
        late.append(asked.pitch_rad)
    return speeds


def drifting(now_s):
    """Drift of 0.09 m/s each second, up to 0.6."""
    return -min(0.6, 0.09 * max(0.0, now_s - 5.0))


def test_cameras_hold_a_drone_whose_odometry_drifts() -> None:
    blind = fly(drifting, lambda now_s, mean: None)
    seen = fly(drifting, lambda now_s, mean: mean)
    assert max(blind) > 0.75
    assert max(seen) < 0.55  # the tolerance, and the drift within the time that cameras need
    assert abs(sum(seen[-200:]) / 200 - 0.3) < 0.05


@pytest.mark.parametrize(("hangs_s", "most_m_s"), [(0.5, 0.35), (1.0, 0.55)])
def test_a_picture_that_hangs_carries_nobody_off(hangs_s: float, most_m_s: float) -> None:
    """Cameras report that it stands still, for longer than the detection takes, and then nothing."""
    speeds = fly(lambda now_s: 0.0, lambda now_s, mean: mean if now_s < 8 else 0.0 if now_s < 8 + hangs_s else None)
    assert max(speeds[round(8 / TICK_S) :]) < most_m_s


def test_a_floor_that_misleads_by_a_little_changes_nothing() -> None:
    seen = fly(lambda now_s: 0.1, lambda now_s, mean: mean)
    alone = fly(lambda now_s: 0.1, lambda now_s, mean: None)
    assert max(abs(a - b) for a, b in zip(seen, alone, strict=True)) < 0.02


def test_a_healthy_velocity_is_not_touched() -> None:
    for seed in range(5):
        healthy = fly(lambda now_s: 0.0, lambda now_s, mean: mean, seed=seed)
        alone = fly(lambda now_s: 0.0, lambda now_s, mean: None, seed=seed)
        assert max(abs(a - b) for a, b in zip(healthy, alone, strict=True)) < 0.02


def test_without_cameras_the_correction_fades() -> None:
    drift = OdometryDrift(DriftLimits())
    for _ in range(400):
        drift.compare(0.8, 0.3, TICK_S)
    assert drift.correction_m_s == pytest.approx(0.5, abs=0.01)
    for _ in range(80):
        drift.compare(0.8, None, TICK_S)
    assert drift.correction_m_s < 0.2
    drift.reset()
    assert drift.correction_m_s == 0.0
