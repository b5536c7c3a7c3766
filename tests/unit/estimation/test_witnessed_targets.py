"""A target that turns, seen by a robot that nobody sees, does not teach that robot a wrong velocity (0374)."""

import math

import numpy as np
import pytest

from groundstation.arrays import Array
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.measurement import Measurement, OdometrySample
from groundstation.estimation.models import ConstantVelocityTarget, FixedMount, MountedCamera, OdometryRobot
from groundstation.estimation.models.odometry_robot import SLOW_STATES
from groundstation.estimation.models.protocol import MotionModel
from groundstation.estimation.parameters import WORLD_FROM_DOWN, EstimatorParameters

MS, START = 1_000_000, 10_000_000_000_000
NOISE = np.diag([4e-4, 4e-4, 4e-4, 1e-3])
SEEN_S, END_S, HEIGHT_M = 3.0, 6.0, 1.2
DRONE = OdometryRobot(slow_states=SLOW_STATES, velocity_bias_std_m_s=0.07, velocity_std_m_s=0.012)
PLACES = {"one": np.array([0.0, 0.0, HEIGHT_M]), "two": np.array([0.5, 0.5, HEIGHT_M])}
CEILING_M = np.array([0.0, 0.0, 4.2])


def target_at(now_s: float) -> Array:
    """Return the place of its marker: it drives on at 0.4 m/s, and turns by 1.2 rad/s once drone one is not seen."""
    turned = 1.2 * max(0.0, now_s - SEEN_S)
    straight_m = 0.4 * min(now_s, SEEN_S) - 0.6
    return np.array([straight_m + math.sin(turned) / 3.0, (1.0 - math.cos(turned)) / 3.0, 0.4])


def sighting(observer: str, seen_from: Array, subject: str, place: Array, now_ns: int) -> Measurement:
    """Return what a camera looking down sees, exactly."""
    yaw, noise = (None, NOISE[:3, :3]) if subject == "target" else (0.0, NOISE)
    x, y, z = (WORLD_FROM_DOWN.T @ (place - seen_from)).tolist()
    return Measurement(now_ns, observer, subject, (x, y, z), yaw, tuple(noise.ravel().tolist()))


def flown(lies_m_s: float, seen: tuple[str, ...]) -> FixedLagFilter:
    """Return the filter after a flight in which all hover; one's velocity lies from when it is not seen on."""
    ceiling = FixedMount((0.0, 0.0, 4.2), 0.0035, 0.01)
    entities: dict[str, MotionModel] = {"target": ConstantVelocityTarget(), "ceiling": ceiling}
    entities |= dict.fromkeys(PLACES, DRONE)
    sensors = {name: MountedCamera(name, WORLD_FROM_DOWN) for name in ("ceiling", *PLACES)}
    joint = FixedLagFilter(EstimatorParameters(entities, sensors))
    for name in PLACES:
        joint.set_airborne(name, True, START, START)
    for step in range(1, round(END_S * 100)):
        now_s, now_ns = step * 0.01, START + step * 10 * MS
        for name in PLACES:
            velocity = (lies_m_s if name == "one" and now_s > SEEN_S else 0.0, 0.0, 0.0)
            joint.add_motion(name, OdometrySample(now_ns, velocity, height_m=HEIGHT_M), now_ns)
        if step % 10 == 0:
            for name in PLACES if now_s <= SEEN_S else seen:
                marker = PLACES[name] + DRONE.marker_position_m
                joint.add_observation(sighting("ceiling", CEILING_M, name, marker, now_ns), "", now_ns)
            for name in ("one", *seen):
                joint.add_observation(sighting(name, PLACES[name], "target", target_at(now_s), now_ns), "", now_ns)
        joint.advance(now_ns)
    return joint


def off_m(joint: FixedLagFilter) -> float:
    """Return by how much drone one's place is off."""
    return float(np.hypot(*(joint.belief().mean_of("one")[:2] - PLACES["one"][:2])))


def test_a_turning_target_does_not_move_the_drone_that_nobody_sees() -> None:
    joint = flown(0.0, ())
    assert math.hypot(*joint.velocity_of("one")[:2]) < 0.03
    assert off_m(joint) < 0.1


def test_a_target_that_another_drone_sees_still_tells_an_unseen_drone_its_velocity() -> None:
    joint = flown(0.15, ("two",))
    assert joint.velocity_of("one")[0] == pytest.approx(0.0, abs=0.05)
    assert off_m(joint) < 0.1
    assert off_m(flown(0.15, ())) > 0.3, "nothing could tell it"


def test_the_covariance_stays_a_distribution() -> None:
    joint = flown(0.0, ())
    assert joint.is_sound()
    P = joint.belief().covariance
    assert np.array_equal(P, P.T)
