"""A real AR.Drone's flight as its driver would publish it, with simulated cameras that observe motion capture truth.

The data are described in their README; the cameras are simulated: white noise, a target at rest, dark periods of the
ceiling camera.
"""

import itertools
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import structs

from drivers.ardrone.convert import NavdataMotion
from drivers.ardrone.publisher import NavdataPublisher
from drivers.ardrone.settings import ArDroneDriverSettings
from groundstation.arrays import Array
from groundstation.bus.messages import FlightState, Header, Message, RelativeObservation, VehicleStatus
from groundstation.estimation.belief import JointBelief
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.angles import difference
from groundstation.geometry.rotations import base_from_tilted_optical, euler_from_rotation, rotation_from_euler
from groundstation.tracker import tracker_from_field

DRONE, TARGET, CEILING, CLOCK = "drone_1", "turtlebot", "ceiling", "recorded"
START_NS = 10**12
GRAVITY_M_S2 = 9.80665
TAKE_OFF_S, ALOFT_S, JUDGED_FROM_S, FOUND_S = 4.3, 6.0, 9.0, 3.0
FRAME_S, TICK_S, STATUS_S = 1 / 15, 0.02, 0.2
VIDEO_LATE_S = {CEILING: 0.06, DRONE: 0.12}
SEEN_M = 2.5
STALLS, STALL_S, BURST_S = 26, 0.15, 0.0002
WARMED_S, WARMED_RAD_S = 15.0, math.radians(0.2)
TARGET_M, TARGET_YAW_RAD, TARGET_HEIGHT_M = (1.0, -1.9), 0.4, 0.1
# Standard deviations of position [m], [m per square metre of range], and heading [rad]: the planner's.
NOISE = {CEILING: (0.015, 0.0, 0.035), DRONE: (0.02, 0.004, 0.05)}


def ns(t: float) -> int:
    """Return a time of the recording on the messages' clock."""
    return START_NS + round(t * 1e9)


@dataclass(frozen=True)
class Recording:
    """The arrays of the recording, and the truth between its samples."""

    arrays: dict[str, Array]
    attitudes: Array

    @property
    def end_s(self) -> float:
        return float(self.arrays["nav_time_s"][-1])

    def truth(self, t: float) -> Array:
        """Return (x, y, z, roll, pitch, yaw) [world]."""
        times = self.arrays["mocap_time_s"]
        columns = np.column_stack((self.arrays["mocap_position_m"], self.attitudes)).T
        return np.array([np.interp(t, times, column) for column in columns])

    def reported(self, t: float) -> tuple[float, float]:
        """Return roll and pitch from navdata."""
        roll, pitch = (
            np.interp(t, self.arrays["nav_time_s"], column) for column in self.arrays["nav_rotation_deg"].T[:2]
        )
        return math.radians(float(roll)), math.radians(float(pitch))


def read_recording(folder: Path) -> Recording:
    """Read the recording."""
    with np.load(folder / "flight.npz") as file:
        arrays = {name: np.asarray(file[name], dtype=np.float64) for name in file.files}
    x, y, z, w = arrays["mocap_quaternion_xyzw"].T
    matrices = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    angles = np.array([euler_from_rotation(m) for m in np.moveaxis(matrices, 2, 0)])
    angles[:, 2] = np.unwrap(angles[:, 2])
    return Recording(arrays, angles)


def stalled(recording: Recording) -> Recording:
    """Return the recording over a link that stalls: what it holds up arrives at once, in the order of sending."""
    sent_s = recording.arrays["nav_time_s"]
    arrivals_s = sent_s.copy()
    for begun_s in np.linspace(ALOFT_S, recording.end_s - STALL_S, STALLS).tolist():
        held = np.flatnonzero((sent_s >= begun_s) & (sent_s < begun_s + STALL_S))
        arrivals_s[held] = begun_s + STALL_S + BURST_S * np.arange(len(held))
    arrivals_s = np.maximum.accumulate(arrivals_s)
    return replace(recording, arrays={**recording.arrays, "nav_time_s": arrivals_s, "drone_time_s": sent_s})


def warmed(recording: Recording) -> Recording:
    """Return the recording with a vertical gyroscope whose bias changes in flight."""
    rates = recording.arrays["imu_gyro_rad_s"].copy()
    rates[recording.arrays["nav_time_s"] >= WARMED_S, 2] += WARMED_RAD_S
    return replace(recording, arrays={**recording.arrays, "imu_gyro_rad_s": rates})


class _Published:
    """A bus that records a driver's messages."""

    def __init__(self) -> None:
        self.messages: list[Message] = []
        self._seq = itertools.count()

    def header(self, entity: str, stamp_ns: int) -> Header:
        return Header(stamp_ns, CLOCK, entity, entity, next(self._seq))

    def publish(self, topic: object, message: Message) -> None:
        self.messages.append(message)


def driver_messages(recording: Recording, inertial: bool = True) -> list[tuple[float, Message]]:
    """Return the messages of the AR.Drone's driver, with times of arrival; inertial False: navdata in demo mode."""
    a, bus = recording.arrays, _Published()
    drone_s = a.get("drone_time_s", a["nav_time_s"])
    publisher: Any = NavdataPublisher(ArDroneDriverSettings(name=DRONE, address="10.0.0.1"), bus)  # type: ignore[arg-type]
    arrivals: list[tuple[float, Message]] = []
    for i, t in enumerate(a["nav_time_s"].tolist()):
        roll, pitch, yaw = np.radians(a["nav_rotation_deg"][i]).tolist()
        height_mm = float(a["nav_altitude_mm"][i])
        motion = NavdataMotion(
            velocity_m_s=tuple((a["nav_velocity_mm_s"][i] / 1000).tolist()),
            roll_rad=roll,
            pitch_rad=pitch,
            yaw_rad=yaw,
            height_m=height_mm / 1000 if height_mm > 0.0 else None,
            rates_rad_s=tuple(a["imu_gyro_rad_s"][i].tolist()) if inertial else None,
            specific_force_m_s2=tuple((GRAVITY_M_S2 * a["nav_acceleration_g"][i]).tolist()) if inertial else None,
        )
        publisher.publish(ns(t), motion, drone_ns=round(float(drone_s[i]) * 1e9))
        arrivals += [(t, message) for message in bus.messages]
        bus.messages.clear()
    return arrivals + [(t, _status(bus, t)) for t in np.arange(0.0, recording.end_s, STATUS_S).tolist()]


def _status(bus: _Published, t: float) -> VehicleStatus:
    aloft = FlightState.HOVERING if t >= ALOFT_S else FlightState.TAKING_OFF
    state = aloft if t >= TAKE_OFF_S else FlightState.LANDED
    return VehicleStatus(header=bus.header(DRONE, ns(t)), flight_state=state, mode="TRACK")


class Cameras:
    """Ceiling and drone cameras on the truth; askew: the ceiling camera has the greatest allowed mounting error."""

    def __init__(self, recording: Recording, field: ResolvedField, seed: int, askew: bool = False) -> None:
        self._truth, self._reported = recording.truth, recording.reported
        self._rng, self._seq = np.random.default_rng(seed), itertools.count()
        drone, ceiling = field.drones[DRONE], field.cameras[CEILING]
        self._marker, self._ceiling = np.array(drone.marker.position_m), np.array(ceiling.position_m)
        self._looking = np.diag([1.0, -1.0, -1.0])
        if askew:
            mounting = np.random.default_rng((seed, 1))
            self._ceiling = self._ceiling + ceiling.position_std_m * mounting.standard_normal(3)
            turned = math.radians(ceiling.attitude_std_deg) * mounting.standard_normal(3)
            self._looking = rotation_from_euler(*turned) @ self._looking
        self._camera = np.array(drone.camera.position_m)
        self._optical = base_from_tilted_optical(math.radians(drone.camera.tilt_down_deg))

    def ceiling(self, t: float) -> RelativeObservation:
        """Return the ceiling camera's observation of the drone."""
        pose = self._truth(t)
        point = pose[:3] + rotation_from_euler(*pose[3:]) @ self._marker - self._ceiling
        return self._message(CEILING, DRONE, t, self._looking @ point, float(pose[5]), (0.0, 0.0))

    def onboard(self, t: float) -> RelativeObservation | None:
        """Return the drone's observation of the target, if it is before its camera and near."""
        pose = self._truth(t)
        base = rotation_from_euler(*pose[3:])
        point = self._optical.T @ (base.T @ (np.array([*TARGET_M, TARGET_HEIGHT_M]) - pose[:3]) - self._camera)
        if point[2] < 0.2 or float(np.linalg.norm(point)) > SEEN_M:
            return None
        return self._message(DRONE, TARGET, t, point, TARGET_YAW_RAD - float(pose[5]), self._reported(t))

    def _message(
        self, observer: str, subject: str, t: float, point: Array, yaw: float, reported: tuple[float, float]
    ) -> RelativeObservation:
        base_m, per_m2, yaw_std = NOISE[observer]
        deviations = np.array([*[math.hypot(base_m, per_m2 * float(point @ point))] * 3, yaw_std])
        error = deviations * self._rng.standard_normal(4)
        return RelativeObservation(
            header=Header(ns(t), CLOCK, observer, f"{observer}_camera", next(self._seq)),
            observer=observer,
            subject=subject,
            camera=f"{observer}_camera",
            position_m=tuple((point + error[:3]).tolist()),
            yaw_rad=math.remainder(yaw + float(error[3]), math.tau),
            covariance=tuple(np.diag(deviations**2).ravel().tolist()),
            margin=2.0,
            roll_rad=reported[0],
            pitch_rad=reported[1],
        )


@dataclass(frozen=True)
class Figures:
    """Root mean square errors [m, deg] and NEES per degree of freedom."""

    target_m: float
    target_anees: float
    drone_m: float
    drone_anees: float
    heading_deg: float
    heading_nees: float


class Score:
    """Errors of target, drone and heading at each tick that counts."""

    def __init__(self, recording: Recording) -> None:
        self._truth = recording.truth
        self.errors: list[tuple[float, ...]] = []

    def take(self, belief: JointBelief, t: float) -> None:
        """Compare a belief with the truth."""
        pose = self._truth(t)
        row = (*_judged(belief, TARGET, np.array(TARGET_M)), *_judged(belief, DRONE, pose[:2]))
        mean, P = belief.mean_of(DRONE), belief.covariance_of(DRONE)
        yaw = difference(float(mean[3]), float(pose[5]))
        self.errors.append((*row, math.degrees(yaw) ** 2, yaw * yaw / float(P[3, 3])))


def figures(errors: list[tuple[float, ...]]) -> Figures:
    """Return means and roots of means."""
    m = np.mean(errors, axis=0).tolist()
    return Figures(math.sqrt(m[0]), m[1], math.sqrt(m[2]), m[3], math.sqrt(m[4]), m[5])


def _judged(belief: JointBelief, name: str, truth: Array) -> tuple[float, float]:
    """Return the squared error [m^2] of (x, y) and its NEES per degree of freedom."""
    error, P = belief.mean_of(name)[:2] - truth, belief.covariance_of(name)[:2, :2]
    return float(error @ error), float(error @ np.linalg.solve(P, error)) / 2.0


def field_for_flight(field: ResolvedField) -> ResolvedField:
    """Return the field with a target as low as the recorded drone flies over."""
    assert field.target is not None
    marker = structs.replace(field.target.marker, height_m=TARGET_HEIGHT_M)
    return structs.replace(field, target=structs.replace(field.target, marker=marker))


@dataclass(frozen=True)
class Dark:
    """The ceiling camera is dark for the last so many seconds of each period."""

    dark_s: float = 0.0
    period_s: float = 1.0

    def hides(self, t: float) -> bool:
        """Return whether the ceiling camera is dark; it sees until the belief is judged."""
        seen_s = self.period_s - self.dark_s
        return t >= JUDGED_FROM_S and (t - JUDGED_FROM_S) % self.period_s >= seen_s


def arrivals_of(
    recording: Recording, field: ResolvedField, dark: Dark, seed: int, inertial: bool, askew: bool = False
) -> list[tuple[float, Message]]:
    """Return all messages by time of arrival."""
    arrivals, cameras = driver_messages(recording, inertial), Cameras(recording, field, seed, askew)
    for t in np.arange(ALOFT_S, recording.end_s, FRAME_S).tolist():
        if not dark.hides(t):
            arrivals.append((t + VIDEO_LATE_S[CEILING], cameras.ceiling(t)))
        sighting = cameras.onboard(t + FRAME_S / 2)
        if sighting is not None:
            arrivals.append((t + FRAME_S / 2 + VIDEO_LATE_S[DRONE], sighting))
    return sorted(arrivals, key=lambda arrival: arrival[0])


def fly(
    recording: Recording, field: ResolvedField, dark: Dark, seed: int = 1, inertial: bool = True, askew: bool = False,
    begun_s: float = 0.0,
) -> Score:  # fmt: skip
    """Feed the flight, from a time on, to a tracker and return the errors of its belief."""
    lab = field_for_flight(field)
    tracker, score = tracker_from_field(lab, CLOCK, 1), Score(recording)
    due, judged_from_s = begun_s, max(JUDGED_FROM_S, begun_s + FOUND_S)
    for t, message in arrivals_of(recording, lab, dark, seed, inertial, askew):
        if t < begun_s:
            continue
        while due <= t:
            belief = tracker.advance(ns(due))
            if due >= judged_from_s:
                score.take(belief, due)
            due += TICK_S
        tracker.ingest(f"{type(message).__name__}/{message.header.entity}", message, ns(t))
    return score
