"""Within the rewind's bound the order of arrival changes nothing, nor does how often the belief is asked for."""

import math
import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.bus.messages import Verdict
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.measurement import Measurement, OdometrySample
from groundstation.estimation.models import ConstantVelocityTarget, FixedMount, MountedCamera, OdometryRobot
from groundstation.estimation.parameters import WORLD_FROM_DOWN, EstimatorParameters
from groundstation.geometry.rotations import base_from_tilted_optical

MS = 1_000_000
START = 5_000_000_000_000
NOW = START + 400 * MS


def parameters() -> EstimatorParameters:
    tilted = base_from_tilted_optical(math.radians(45))
    return EstimatorParameters(
        {
            "a": OdometryRobot(velocity_scale=1.18),
            "b": OdometryRobot(),
            "t": ConstantVelocityTarget(),
            "ceiling": FixedMount((0.0, 0.0, 4.2), 0.0035, 0.01),
        },
        {
            "ceiling": MountedCamera("ceiling", WORLD_FROM_DOWN, observes_targets=False),
            "a": MountedCamera("a", tilted, (0.09, 0.0, 0.0)),
            "b": MountedCamera("b", tilted, (0.09, 0.0, 0.0)),
        },
    )


def diagonal(*variances: float) -> tuple[float, ...]:
    return tuple(np.diag(variances).ravel().tolist())


def stream(seed: int):
    """0.4 s of a flight as (kind, arguments): both robots seen, the target seen, one wild sighting, one reset."""
    rng = np.random.default_rng(seed)
    flight = [("airborne", ("a", True, START)), ("airborne", ("b", True, START + 11 * MS))]
    for k in range(80):
        stamp = START + 5 * MS * k + int(rng.integers(0, 2 * MS))
        for name, speed in (("a", 0.1), ("b", -0.05)):
            yaw = 0.002 * k + (2.0 if k > 50 else 0.0)
            height = 1.3 + 0.01 * float(rng.normal()) if k % 3 == 0 else None
            velocity = (speed + 0.02 * float(rng.normal()), 0.01, 0.0)
            flight.append(("motion", (name, OdometrySample(stamp, velocity, yaw, height, int(k > 50)))))
    four, three = diagonal(1e-4, 1e-4, 4e-4, 1e-3), diagonal(1e-4, 1e-4, 4e-4)
    for k in range(1, 6):
        stamp = START + 65 * MS * k + int(rng.integers(0, 9 * MS))
        noise = 0.01 * rng.normal(size=3)
        far = 3.0 if k == 3 else 0.0
        for camera, subject, position, covariance in (
            ("ceiling", "a", (0.5 + far, -0.3, 2.8), four),
            ("ceiling", "b", (-0.5, 0.4, 2.8), four),
            ("a", "t", (0.1, 0.0, 1.2), three),
        ):
            place = tuple((np.array(position) + noise).tolist())
            yaw = 0.1 if covariance is four else None
            flight.append(
                ("observation", (Measurement(stamp, camera, subject, place, yaw, covariance), f"{camera}{subject}{k}"))
            )
    return flight


def feed(joint: FixedLagFilter, kind: str, arguments) -> None:
    if kind == "motion":
        assert joint.add_motion(*arguments, NOW) is Verdict.ACCEPTED
    elif kind == "airborne":
        assert joint.set_airborne(*arguments, NOW) is Verdict.ACCEPTED
    else:
        assert joint.add_observation(*arguments, NOW) is None


def final(flight, advance_every: int = 0):
    joint = FixedLagFilter(parameters())
    joint.advance(NOW)
    for number, (kind, arguments) in enumerate(flight):
        feed(joint, kind, arguments)
        if advance_every and number % advance_every == 0:
            joint.advance(NOW)
    joint.advance(NOW + 20 * MS)
    return joint.belief()


@given(seed=st.integers(0, 3), order=st.integers(0, 10_000), advance_every=st.sampled_from([0, 1, 7]))
@settings(max_examples=40, deadline=None)
def test_any_order_of_arrival_gives_the_same_belief(seed: int, order: int, advance_every: int) -> None:
    flight = stream(seed)
    reference = final(flight)
    shuffled = flight.copy()
    random.Random(order).shuffle(shuffled)
    belief = final(shuffled, advance_every)
    assert belief.layout == reference.layout
    np.testing.assert_allclose(belief.mean, reference.mean, atol=1e-9, rtol=0)
    np.testing.assert_allclose(belief.covariance, reference.covariance, atol=1e-9, rtol=0)


def test_the_stream_is_worth_permuting() -> None:
    belief = final(stream(0))
    assert set(belief.layout.robots) == {"a", "b"}
    assert belief.layout.targets == ("t",)
    # Seen as it came, in steps, with the observations 120 ms late.
    joint = FixedLagFilter(parameters())
    arrivals = sorted(
        ((a[0].stamp_ns + 120 * MS if k == "observation" else a[1].stamp_ns if k == "motion" else a[2]), i)
        for i, (k, a) in enumerate(stream(0))
    )
    flight = stream(0)
    joint.advance(START)
    for at, index in arrivals:
        kind, arguments = flight[index]
        if kind == "motion":
            joint.add_motion(*arguments, at)
        elif kind == "airborne":
            joint.set_airborne(*arguments, at)
        else:
            joint.add_observation(*arguments, at)
        joint.advance(at)
    joint.advance(NOW + 20 * MS)
    if max(at for at, _ in arrivals) <= NOW + 20 * MS:
        np.testing.assert_allclose(joint.belief().mean, belief.mean, atol=1e-9, rtol=0)


@pytest.mark.parametrize(("late_ms", "verdict"), [(499, None), (501, Verdict.LATE), (3_600_000, Verdict.LATE)])
def test_older_than_the_bound_is_late(late_ms: int, verdict: Verdict | None) -> None:
    joint = FixedLagFilter(parameters())
    joint.advance(NOW)
    sight = Measurement(NOW - late_ms * MS, "ceiling", "a", (0, 0, 3), 0.0, diagonal(1, 1, 1, 1))
    assert joint.add_observation(sight, "x", NOW) is verdict


def test_a_stamp_from_the_future_is_refused() -> None:
    joint = FixedLagFilter(parameters())
    sight = Measurement(NOW + 200 * MS, "ceiling", "a", (0, 0, 3), 0.0, diagonal(1, 1, 1, 1))
    assert joint.add_observation(sight, "x", NOW) is Verdict.IMPLAUSIBLE


def test_a_long_pause_is_survived() -> None:
    """The process was frozen: a minute passes between two calls, and late data are refused, not mixed up."""
    joint = FixedLagFilter(parameters())
    for kind, arguments in stream(1):
        feed(joint, kind, arguments)
    joint.advance(NOW)
    later = NOW + 60_000 * MS
    assert joint.add_motion("a", OdometrySample(NOW + MS, (1.0, 0.0, 0.0), 0.0), later) is Verdict.LATE
    assert joint.add_motion("a", OdometrySample(later, (0.0, 0.0, 0.0), 0.0, 1.3), later) is Verdict.ACCEPTED
    joint.advance(later)
    assert joint.is_sound()
    belief = joint.belief()
    assert belief.covariance_of("a")[0, 0] > 1.0
    assert belief.stamp_ns == later
