"""The tracker levels a drone's observations by its IMU: wind tilts it, and its reported attitude does not show that."""

import math

import numpy as np
import pytest

from groundstation.bus.messages import (
    FlightState,
    Header,
    ImuSample,
    Message,
    Odometry,
    RelativeObservation,
    VehicleStatus,
    Verdict,
)
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.rotations import base_from_tilted_optical, rotation_from_euler
from groundstation.tracker import tracker_from_field

MS, START, GRAVITY = 1_000_000, 7_000_000_000_000, 9.80665
PLACE, TARGET, LEAN_RAD = np.array([-0.9, 0.5, 1.3]), np.array([0.1, 0.5, 0.4]), math.radians(6.0)
COVARIANCE = tuple(np.diag([1e-4, 1e-4, 4e-4, 1e-3]).ravel().tolist())


class Hover:
    """drone_1 hovers in wind and reports level; its IMU shows the tilt."""

    def __init__(self, field: ResolvedField) -> None:
        self.tracker = tracker_from_field(field, "here", 1)
        self.now, self.seq = START, 0
        self.verdicts: list[Verdict | None] = []
        self.magnetic_rad, self.shaking = 0.0, 1e-6
        self.lean(roll_rad=LEAN_RAD)

    def lean(self, roll_rad: float = 0.0, pitch_rad: float = 0.0) -> None:
        self._base = rotation_from_euler(roll_rad, pitch_rad, 0.0)

    def header(self, entity: str, age_ms: int = 0) -> Header:
        self.seq += 1
        return Header(self.now - age_ms * MS, "here", entity, entity, self.seq)

    def send(self, message: Message) -> None:
        key = f"{type(message).__name__}/{message.header.entity}"
        self.verdicts.append(self.tracker.ingest(key, message, self.now))

    def run(self, seconds: float, inertial: bool = True, state: FlightState = FlightState.FLYING) -> None:
        self.send(VehicleStatus(header=self.header("drone_1"), flight_state=state, mode="TRACK"))
        for step in range(round(seconds * 100)):
            self.now += 10 * MS
            trembling = 1e-9 * self.seq
            self.send(
                Odometry(
                    header=self.header("drone_1"),
                    velocity_m_s=(0.0, 0.0, 0.0),
                    velocity_covariance=(0.01,) * 9,
                    yaw_rad=self.magnetic_rad,
                    roll_rad=trembling,
                    pitch_rad=0.0,
                    height_m=1.3,
                )
            )
            if inertial:
                force = self._base.T @ np.array([0.0, 0.0, GRAVITY]) + self.shaking * self.seq
                x, y, z = force.tolist()
                rates = (0.0, 0.0, 0.0)
                header = self.header("drone_1")
                self.send(ImuSample(header=header, angular_velocity_rad_s=rates, specific_force_m_s2=(x, y, z)))
            if step % 4 == 0 and state is FlightState.FLYING:
                self.look()
            self.tracker.advance(self.now)

    def look(self) -> None:
        marker = PLACE + self._base @ np.array([0.0, 0.0, 0.08])
        self.sight("ceiling", "drone_1", np.diag([1.0, -1.0, -1.0]) @ (marker - np.array([0.0, 0.0, 4.2])), 0.0)
        tilted = base_from_tilted_optical(math.radians(45.0))
        self.sight("drone_1", "turtlebot", tilted.T @ (self._base.T @ (TARGET - PLACE) - np.array([0.09, 0, 0])), 0.3)

    def sight(self, observer: str, subject: str, point: np.ndarray, yaw: float) -> None:
        x, y, z = (point + 1e-9 * self.seq).tolist()
        sighting = RelativeObservation(
            header=self.header(observer, 50),
            observer=observer,
            subject=subject,
            camera=f"{observer}_camera",
            position_m=(x, y, z),
            yaw_rad=yaw,
            covariance=COVARIANCE,
        )
        self.send(sighting)

    @property
    def target_error_m(self) -> float:
        return float(np.linalg.norm(self.tracker.belief.mean_of("turtlebot")[:2] - TARGET[:2]))


@pytest.fixture
def hover(lab_field: ResolvedField) -> Hover:
    return Hover(lab_field)


def test_observations_of_a_tilted_drone_are_levelled_by_its_imu(hover: Hover) -> None:
    hover.run(2.0)
    assert hover.target_error_m < 0.02
    assert set(hover.verdicts) == {None}


def test_without_an_imu_its_word_counts(hover: Hover) -> None:
    hover.run(2.0, inertial=False)
    assert hover.target_error_m > 0.06


def test_an_imu_that_hangs_is_refused_and_the_drones_own_attitude_counts_again(hover: Hover) -> None:
    hover.run(2.0)
    hover.shaking = 0.0
    hover.run(2.0)
    assert Verdict.FROZEN in hover.verdicts
    assert hover.target_error_m > 0.04


def test_a_magnetic_heading_that_wanders_turns_nobody(hover: Hover) -> None:
    hover.run(2.0, state=FlightState.LANDED)
    hover.run(1.0)
    for _ in range(40):
        hover.magnetic_rad += math.radians(0.5)
        hover.run(0.1)
    assert abs(hover.tracker.belief.mean_of("drone_1")[3]) < math.radians(0.5)


def test_a_change_of_the_headings_source_turns_nobody(hover: Hover) -> None:
    hover.magnetic_rad = 2.0
    hover.run(1.0)
    for inertial in (False, True, False):
        hover.run(0.5, inertial)
        assert abs(hover.tracker.belief.mean_of("drone_1")[3]) < math.radians(0.5)
