"""Within the rewind's bound, neither the order of arrival nor the number of queries changes the belief."""

import math
import random
from typing import NamedTuple, Protocol

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.bus.messages import Verdict
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.measurement import Measurement, OdometrySample
from groundstation.estimation.models import ConstantVelocityTarget, FixedMount, MountedCamera, OdometryRobot
from groundstation.estimation.parameters import WORLD_FROM_DOWN, EstimatorParameters
from groundstation.geometry.rotations import base_from_tilted_optical

MS = 1_000_000
START = 5_000_000_000_000
NOW = START + 400 * MS
END = NOW + 60 * MS  # the last observation comes 120 ms late


def parameters(wait_s: float = 0.0) -> EstimatorParameters:
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
        wait_s=wait_s,
    )


def diagonal(*variances: float) -> tuple[float, ...]:
    return tuple(np.diag(variances).ravel().tolist())


class Arrival(Protocol):
    """An input: `due_ns`, its arrival time in flight, and the filter's call for it."""

    @property
    def due_ns(self) -> int: ...

    def enter(self, joint: FixedLagFilter, now_ns: int) -> Verdict | None: ...


class Airborne(NamedTuple):
    entity: str
    due_ns: int

    def enter(self, joint: FixedLagFilter, now_ns: int) -> Verdict | None:
        return joint.set_airborne(self.entity, True, self.due_ns, now_ns)


class Motion(NamedTuple):
    entity: str
    sample: OdometrySample

    @property
    def due_ns(self) -> int:
        return self.sample.stamp_ns

    def enter(self, joint: FixedLagFilter, now_ns: int) -> Verdict | None:
        return joint.add_motion(self.entity, self.sample, now_ns)


class Sight(NamedTuple):
    measurement: Measurement
    key: str

    @property
    def due_ns(self) -> int:
        return self.measurement.stamp_ns + 120 * MS

    def enter(self, joint: FixedLagFilter, now_ns: int) -> Verdict | None:
        return joint.add_observation(self.measurement, self.key, now_ns)


def stream(seed: int) -> list[Arrival]:
    """0.4 s of a flight: both robots observed, the target observed, one outlier, one reset."""
    rng = np.random.default_rng(seed)
    flight: list[Arrival] = [Airborne("a", START), Airborne("b", START + 11 * MS)]
    for k in range(80):
        stamp = START + 5 * MS * k + int(rng.integers(0, 2 * MS))
        for name, speed in (("a", 0.1), ("b", -0.05)):
            yaw = 0.002 * k + (2.0 if k > 50 else 0.0)
            height = 1.3 + 0.01 * float(rng.normal()) if k % 3 == 0 else None
            velocity = (speed + 0.02 * float(rng.normal()), 0.01, 0.0)
            flight.append(Motion(name, OdometrySample(stamp, velocity, yaw, height, int(k > 50))))
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
            turned = 0.1 if covariance is four else None
            sight = Measurement(stamp, camera, subject, place, turned, covariance)
            flight.append(Sight(sight, f"{camera}{subject}{k}"))
    return flight


def feed(joint: FixedLagFilter, arrival: Arrival) -> None:
    assert arrival.enter(joint, NOW) is (None if isinstance(arrival, Sight) else Verdict.ACCEPTED)


def final(flight: list[Arrival], advance_every: int = 0, begin_ns: int = NOW, wait_s: float = 0.0) -> JointBelief:
    joint = FixedLagFilter(parameters(wait_s))
    joint.advance(begin_ns)
    for number, arrival in enumerate(flight):
        feed(joint, arrival)
        if advance_every and number % advance_every == 0:
            joint.advance(NOW)
    joint.advance(END)
    return joint.belief()


@given(
    seed=st.integers(0, 3), order=st.integers(0, 10_000), advance_every=st.sampled_from([0, 1, 7]),
    wait_s=st.sampled_from([0.0, 0.095]),
)  # fmt: skip
@settings(max_examples=40, deadline=None)
def test_any_order_of_arrival_gives_the_same_belief(seed: int, order: int, advance_every: int, wait_s: float) -> None:
    flight = stream(seed)
    reference = final(flight, wait_s=wait_s)
    shuffled = flight.copy()
    random.Random(order).shuffle(shuffled)
    belief = final(shuffled, advance_every, wait_s=wait_s)
    assert belief.layout == reference.layout
    np.testing.assert_allclose(belief.mean, reference.mean, atol=1e-9, rtol=0)
    np.testing.assert_allclose(belief.covariance, reference.covariance, atol=1e-9, rtol=0)


def test_the_stream_is_worth_permuting() -> None:
    belief = final(stream(0), begin_ns=START)
    assert set(belief.layout.robots) == {"a", "b"}
    assert belief.layout.targets == ("t",)
    # Processed on arrival, in steps, with the observations 120 ms late.
    joint = FixedLagFilter(parameters())
    joint.advance(START)
    for arrival in sorted(stream(0), key=lambda each: each.due_ns):
        assert arrival.due_ns <= END
        arrival.enter(joint, arrival.due_ns)
        joint.advance(arrival.due_ns)
    joint.advance(END)
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
    """The process was frozen: a minute passes between two calls, and late data are refused, not confused."""
    joint = FixedLagFilter(parameters())
    for arrival in stream(1):
        feed(joint, arrival)
    joint.advance(NOW)
    later = NOW + 60_000 * MS
    assert joint.add_motion("a", OdometrySample(NOW + MS, (1.0, 0.0, 0.0), 0.0), later) is Verdict.LATE
    assert joint.add_motion("a", OdometrySample(later, (0.0, 0.0, 0.0), 0.0, 1.3), later) is Verdict.ACCEPTED
    joint.advance(later)
    assert joint.is_sound()
    belief = joint.belief()
    assert belief.covariance_of("a")[0, 0] > 1.0
    assert belief.stamp_ns == later
