"""The joint state: cameras and robots that come and go, several targets, manoeuvres, floors, repeated errors."""

import math

import numpy as np
import pytest

from groundstation.bus.messages import Header, Odometry, Verdict
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.ingest import Intake
from groundstation.estimation.measurement import Measurement, OdometrySample, SensorReading
from groundstation.estimation.models import (
    CommandedRobot,
    ConstantVelocityTarget,
    CoordinatedTurnTarget,
    FixedMount,
    HeadingSensor,
    Landmark,
    ManoeuvringTarget,
    MotionModel,
    MountedCamera,
    OdometryRobot,
    RangeBearingSensor,
)
from groundstation.estimation.parameters import WORLD_FROM_DOWN, EstimatorParameters
from groundstation.geometry.rotations import base_from_tilted_optical

MS = 1_000_000
START = 10_000_000_000_000
TILTED = base_from_tilted_optical(math.radians(45))
FOUR = tuple(np.diag([1e-4, 1e-4, 4e-4, 1e-3]).ravel().tolist())


class Room:
    """A filter with two ceiling cameras, two drones and further entities of a test, on a manual clock."""

    def __init__(self, **more: MotionModel) -> None:
        drone = OdometryRobot(marker_position_m=(0.0, 0.0, 0.0))
        mounts = {"east": FixedMount((1.0, 0.0, 4.0), 0.004, 0.02), "west": FixedMount((-1.0, 0.0, 4.0), 0.004, 0.02)}
        cameras = {name: MountedCamera(name, WORLD_FROM_DOWN) for name in mounts}
        cameras |= {name: MountedCamera(name, TILTED) for name in ("a", "b")}
        self.filter = FixedLagFilter(EstimatorParameters({"a": drone, "b": drone, **more, **mounts}, cameras))
        self.now = START
        for name in ("a", "b"):
            self.filter.set_airborne(name, True, self.now, self.now)

    def run(self, seconds: float, height_m: float | None = None) -> None:
        for _ in range(round(seconds * 100)):
            self.now += 10 * MS
            for name in ("a", "b"):
                self.filter.add_motion(name, OdometrySample(self.now, (0.0, 0.0, 0.0), 0.0, height_m), self.now)
            self.filter.advance(self.now)

    def see(self, camera: str, subject: str, position: tuple[float, float, float], yaw: float | None = 0.0) -> Verdict:
        covariance = FOUR if yaw is not None else tuple(np.diag([1e-4, 1e-4, 4e-4]).ravel().tolist())
        sight = Measurement(self.now, camera, subject, position, yaw, covariance)
        assert self.filter.add_observation(sight, f"{camera}{subject}", self.now) is None
        self.filter.advance(self.now)
        return self.filter.take_corrections()[-1].verdict

    def below(self, camera: str, subject: str, place: tuple[float, float, float]) -> Verdict:
        x0 = 1.0 if camera == "east" else -1.0
        return self.see(camera, subject, (place[0] - x0, -place[1], 4.0 - place[2]))

    @property
    def belief(self) -> JointBelief:
        return self.filter.belief()


def entries(belief: JointBelief, *names: str) -> list[int]:
    return [i for name in names for i in range(belief.layout.block(name).start, belief.layout.block(name).slice.stop)]


def test_removing_a_camera_leaves_the_other_estimates_unchanged() -> None:
    room = Room()
    room.run(0.1)
    place = (0.5, 0.1, 1.5)
    for camera, subject in (("east", "a"), ("west", "a"), ("east", "b")):
        assert room.below(camera, subject, place) is Verdict.ACCEPTED
    before = room.belief
    others = ("a", "b", "west")
    assert np.abs(before.covariance[np.ix_(entries(before, "a"), entries(before, "east"))]).max() > 1e-5
    room.now += 1
    room.filter.set_present("east", False, room.now, room.now)
    room.filter.advance(room.now)
    after = room.belief
    assert "east" not in after.layout
    kept = entries(before, *others)
    np.testing.assert_allclose(after.mean[entries(after, *others)], before.mean[kept], atol=1e-8)
    left = np.ix_(entries(after, *others), entries(after, *others))
    np.testing.assert_allclose(after.covariance[left], before.covariance[np.ix_(kept, kept)], atol=1e-8)
    assert room.see("east", "a", (0.5, 0.1, 2.5)) is Verdict.UNKNOWN_ENTITY


def test_a_camera_that_comes_back_is_as_new_and_correlates_by_what_it_sees() -> None:
    """Compared with a room whose camera was never there before."""
    rooms = [Room(), Room()]
    rooms[1].filter.set_present("east", False, START, START)
    rooms[0].run(0.1)
    rooms[1].run(0.1)
    for room in rooms:
        room.below("west", "a", (0.5, 0.1, 1.5))
    rooms[0].below("east", "b", (0.2, 0.3, 1.4))  # joins b; b lands again, and the camera goes too
    rooms[0].filter.set_airborne("b", False, rooms[0].now, rooms[0].now)
    rooms[0].filter.set_present("east", False, rooms[0].now, rooms[0].now)
    for room in rooms:
        room.run(0.2)
        room.filter.set_present("east", True, room.now, room.now)
        room.filter.advance(room.now)
        belief = room.belief
        assert not belief.covariance[np.ix_(entries(belief, "a"), entries(belief, "east"))].any()
        room.run(0.05)
        assert room.below("east", "a", (0.52, 0.1, 1.5)) is Verdict.ACCEPTED
    old, new = (room.belief for room in rooms)
    assert np.abs(new.covariance[np.ix_(entries(new, "a"), entries(new, "east"))]).max() > 1e-5
    np.testing.assert_allclose(old.mean, new.mean, atol=1e-12)
    np.testing.assert_allclose(old.covariance, new.covariance, atol=1e-12)


def test_a_robot_in_a_camera_less_room_is_placed_by_hand() -> None:
    room = Room()
    variances = (0.01, 0.01, 0.02, 0.03)
    room.filter.place("a", (1.0, 2.0, 1.2, 3.0), variances, room.now, room.now)
    room.filter.advance(room.now)
    belief = room.belief
    np.testing.assert_allclose(belief.mean_of("a")[:4], (1.0, 2.0, 1.2, 3.0), atol=1e-12)
    np.testing.assert_allclose(np.diag(belief.covariance_of("a"))[:4], variances, atol=1e-12)
    with pytest.raises(ValueError, match="variances"):
        room.filter.place("a", (1.0, 2.0, 1.2, 3.0), (0.0, 1.0, 1.0, 1.0), room.now, room.now)
    assert room.filter.place("nobody", (0, 0, 0, 0), variances, room.now, room.now) is Verdict.UNKNOWN_ENTITY


def test_two_targets_have_a_block_each() -> None:
    room = Room(first=ConstantVelocityTarget(), second=ConstantVelocityTarget(heading=True))
    room.run(0.1)
    room.below("west", "a", (0.0, 0.0, 1.5))
    for k in range(40):
        room.run(0.05)
        room.below("west", "a", (0.0, 0.0, 1.5))
        reach = (1.5 - 0.4) * math.sqrt(2.0)
        room.see("a", "first", (0.3 + 0.01 * k, 0.0, reach), None)
        room.see("a", "second", (-0.3, 0.0, reach), 0.7)
    belief = room.belief
    assert belief.layout.targets == ("first", "second")
    np.testing.assert_allclose(belief.mean_of("first")[[2, 3]], (0.0, -0.2), atol=0.05)
    np.testing.assert_allclose(belief.mean_of("second")[[2, 3]], (0.0, 0.0), atol=0.05)
    assert belief.mean_of("first")[1] - belief.mean_of("second")[1] == pytest.approx(-0.6 - 0.39, abs=0.03)
    assert belief.mean_of("second")[4] == pytest.approx(0.7, abs=0.05)
    cross = belief.covariance[np.ix_(entries(belief, "first"), entries(belief, "second"))]
    assert cross[0, 0] > 1e-5  # an error of the observer is common to both


def follow(target: MotionModel, seed: int = 0) -> tuple[float, list[float], FixedLagFilter]:
    """Return the RMSE of a target that goes straight, turns at 1 rad/s and goes straight, seen at 10 Hz to 2 cm."""
    rng, room = np.random.default_rng(seed), Room(rover=target)
    room.run(0.05)
    room.below("west", "a", (0.0, 0.0, 1.5))
    place, heading, squares, turning = -1.5 + 0j, 0.0, [], []
    for k in range(120):
        rate = 1.0 if 50 <= k < 82 else 0.0
        for _ in range(10):
            place += 0.01 * 0.5 * np.exp(1j * heading)
            heading += 0.01 * rate
        room.run(0.1)
        z = (place.real + 1.0 + 0.02 * rng.normal(), -(place.imag + 0.02 * rng.normal()), 3.6)
        sight = Measurement(room.now, "west", "rover", z, None, tuple(np.diag([4e-4] * 3).ravel().tolist()))
        if k % 5 == 0:
            room.below("west", "a", (0.0, 0.0, 1.5))
        room.filter.add_observation(sight, "rover", room.now)
        room.filter.advance(room.now)
        mean = room.belief.mean_of("rover")
        squares.append((mean[0] - place.real) ** 2 + (mean[1] - place.imag) ** 2)
        turning.append(room.filter.mode_probabilities()[-1])
        assert room.filter.is_sound()
    return math.sqrt(float(np.mean(squares[5:]))), turning, room.filter


def test_modes_follow_a_manoeuvre_and_beat_a_model_that_only_goes_straight() -> None:
    straight, _, _ = follow(ConstantVelocityTarget(acceleration_std_m_s2=0.1))
    switching, turning, _ = follow(ManoeuvringTarget())
    assert switching < 0.8 * straight
    assert np.mean(turning[60:82]) > 0.8
    assert np.mean(turning[100:]) < np.mean(turning[60:82]) - 0.3


def test_two_equal_modes_are_one_model_cross_covariances_included() -> None:
    one, equal = CoordinatedTurnTarget(), ManoeuvringTarget((CoordinatedTurnTarget(),) * 2, (1.0, 1.0))
    _, _, single = follow(one)
    _, probabilities, mixed = follow(equal)
    np.testing.assert_allclose(mixed.belief().mean, single.belief().mean, atol=1e-9)
    np.testing.assert_allclose(mixed.belief().covariance, single.belief().covariance, atol=1e-9)
    np.testing.assert_allclose(probabilities, 0.5, atol=1e-9)


def test_a_step_in_the_floor_does_not_move_the_vehicle() -> None:
    """Hovers unseen at 1.3 m; a box of 0.4 m passes below for 3 s."""
    room = Room()
    for _ in range(2):  # a first observation is accepted once a second one agrees
        room.run(0.3, height_m=1.3)
        room.below("west", "a", (0.0, 0.0, 1.3))
    room.run(2.0, height_m=1.3)
    z = [room.belief.mean_of("a")[2]]
    for _ in range(30):
        room.run(0.1, height_m=0.9)
        z.append(room.belief.mean_of("a")[2])
    floor = room.belief.layout.block("a").labels.index("floor")
    assert room.belief.mean_of("a")[floor] == pytest.approx(0.4, abs=0.05)
    for _ in range(20):
        room.run(0.1, height_m=1.3)
        z.append(room.belief.mean_of("a")[2])
    assert max(abs(value - 1.3) for value in z) < 0.03
    assert abs(room.belief.mean_of("a")[floor]) < 0.02


def test_a_single_wild_height_moves_nothing() -> None:
    room = Room()
    room.run(0.3, height_m=1.3)
    room.below("west", "a", (0.0, 0.0, 1.3))
    room.run(1.0, height_m=1.3)
    room.run(0.01, height_m=3.5)
    room.run(0.5, height_m=1.3)
    assert room.belief.mean_of("a")[2] == pytest.approx(1.3, abs=0.02)


def ground(repeats_s: float = 0.0) -> FixedLagFilter:
    """A ground robot at the origin before a post 2 m ahead."""
    joint = FixedLagFilter(
        EstimatorParameters(
            {"rover": CommandedRobot(range_bias_std_m=1e-3, range_scale_std=1e-3), "post": Landmark((2.0, 0.0, 0.0))},
            {"eye": RangeBearingSensor("rover", repeats_s=repeats_s), "compass": HeadingSensor("rover")},
        )
    )
    joint.place("rover", (0.0, 0.0, 0.0, 0.0), (0.09, 0.09, 1e-6, 0.04), START, START)
    return joint


def test_readings_that_repeat_their_error_share_one_readings_information() -> None:
    spreads = {}
    for repeats_s in (0.0, 1.0):
        joint = ground(repeats_s=repeats_s)
        for k in range(100):
            now = START + 10 * MS * k
            joint.add_motion("rover", OdometrySample(now, (0.0, 0.0, 0.0)), now)
            joint.add_observation(SensorReading(now, "eye", "post", (2.0, 0.0), (0.01, 0.0, 0.0, 0.01)), str(k), now)
            joint.advance(now)
        spreads[repeats_s] = joint.belief().covariance_of("rover")[0, 0]
    first = 1.0 / (1.0 / 0.09 + 1.0 / 0.01)
    assert spreads[0.0] < 0.05 * first
    assert 0.4 * first < spreads[1.0] < first  # a second's worth: two readings, the first and one spread over it


def test_a_heading_is_a_measurement_of_the_carrier_itself() -> None:
    joint = ground()
    assert joint.add_observation(SensorReading(START, "compass", "rover", (0.3,), (1e-4,)), "c", START) is None
    joint.advance(START)
    assert joint.belief().mean_of("rover")[3] == pytest.approx(0.3, abs=0.01)
    assert joint.add_observation(SensorReading(START, "eye", "nobody", (2.0, 0.0), (1.0, 0, 0, 1.0)), "n", START) is (
        Verdict.UNKNOWN_ENTITY
    )
    with pytest.raises(ValueError, match="rows"):
        joint.add_observation(SensorReading(START, "eye", "post", (2.0, 0.0), (1.0,)), "s", START)


def test_a_vehicles_own_position_is_never_fused() -> None:
    """It flies on our estimate: its position is our own estimate, and would count twice."""
    beliefs = []
    for position in ((0.0, 0.0, 1.3), (40.0, -30.0, 9.0), None):
        room = Room()
        intake = Intake(room.filter, room.filter.parameters.sensors, "clock")
        room.below("west", "a", (0.0, 0.0, 1.5))
        for k in range(50):
            room.now += 10 * MS
            message = Odometry(
                header=Header(room.now, "clock", "a", "a", k),
                velocity_m_s=(0.1, 0.0, 0.0),
                velocity_covariance=(0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.01),
                yaw_rad=0.0,
                roll_rad=0.0,
                pitch_rad=0.0,
                position_m=position,
            )
            assert intake.take("a", message, room.now) is Verdict.ACCEPTED
        room.filter.advance(room.now)
        beliefs.append(room.belief)
    for belief in beliefs[1:]:
        np.testing.assert_array_equal(belief.mean, beliefs[0].mean)
        np.testing.assert_array_equal(belief.covariance, beliefs[0].covariance)
