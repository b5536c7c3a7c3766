"""A lab whose drones swing about a driving target, with measurements made under wrong settings."""

import math
from collections.abc import Iterator

import msgspec
import numpy as np

from groundstation.bus.messages import FlightState, Header, Message, Odometry, RelativeObservation, VehicleStatus
from groundstation.bus.topics import OBSERVATION, ODOMETRY, VEHICLE_STATUS
from groundstation.calibration.flown import Flown
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.rotations import (
    base_from_tilted_optical,
    rotation_from_euler,
    rotation_z,
    world_from_downward_optical,
)
from sim_bridge.study.wrong_figures import WrongFigures

SECONDS, STAND_S, CLOCK = 12.0, 2.0, "c"
NOISE = np.array([0.004, 0.004, 0.006, 0.01])
STANDING_M = 0.1
TOPIC_OF = {"status": VEHICLE_STATUS, "odometry": ODOMETRY, "observation": OBSERVATION}


class Lab:
    """Two drones that stand, rise and swing about a driving target; cameras and odometry with a little noise."""

    def __init__(self, field: ResolvedField, wrong: WrongFigures, seed: int = 1, seconds: float = SECONDS) -> None:
        self.seconds = seconds
        self.field, self.true, self.wrong = field, wrong.world(field), wrong
        self.rng, self.seq = np.random.default_rng(seed), 0

    def pose(self, name: str, t: float) -> tuple[np.ndarray, float]:
        flown = max(0.0, t - STAND_S)
        if name not in self.field.drones:
            return np.array([1.3 - 0.3 * math.cos(0.5 * flown), 0.4 - 0.4 * math.cos(0.4 * flown), 0.0]), 0.3 * flown
        drone, rank = self.field.drones[name], list(self.field.drones).index(name)
        eased = 1.0 - math.exp(-(flown**2) / 4.0)
        x, y = drone.pad_m
        z = STANDING_M + eased * (1.2 + 0.4 * rank + 0.25 * math.sin(0.7 * flown + rank))
        swing = eased * np.array([0.5 * math.sin(0.8 * flown + 2.0 * rank), 0.4 * math.sin(1.1 * flown + rank)])
        yaw = math.radians(drone.pad_yaw_deg) + 0.5 * eased * math.sin(0.9 * flown + rank)
        return np.array([x + swing[0], y + swing[1], z]), yaw

    def header(self, t: float, name: str) -> Header:
        self.seq += 1
        return Header(round(t * 1e9), CLOCK, name, name, self.seq)

    def late(self, name: str) -> float:
        return self.wrong.errors.get((name, "own_delay"), 0.0) / 1e3

    def own(self, name: str, t: float) -> Odometry:
        odometry = self.field.drones[name].odometry
        stamp, t = t, t - self.late(name)
        then = t - odometry.velocity_delay_ms / 1e3
        (before, _), (after, _) = self.pose(name, then - 0.005), self.pose(name, then + 0.005)
        yaw = self.pose(name, t)[1]
        ahead = rotation_z(self.pose(name, then)[1]).T @ (after - before) / 0.01 / odometry.velocity_scale
        vx, vy = (ahead[:2] + 0.01 * self.rng.standard_normal(2)).tolist()
        height = float(self.pose(name, t - odometry.height_delay_ms / 1e3)[0][2])
        covariance = (0.0025, 0.0, 0.0, 0.0, 0.0025, 0.0, 0.0, 0.0, 0.01)
        return Odometry(
            header=self.header(stamp, name),
            velocity_m_s=(vx, vy, 0.0),
            velocity_covariance=covariance,
            yaw_rad=yaw + 0.4,
            roll_rad=0.0,
            pitch_rad=0.0,
            height_m=height if t > STAND_S else None,
        )

    def sighting(self, observer: str, subject: str, t: float) -> RelativeObservation | None:
        place, yaw = self.pose(subject, t)
        carried = (
            self.true.drones[subject].marker.position_m
            if subject in self.field.drones
            else (0.0, 0.0, self.true.tracked[subject].marker.height_m)
        )
        marker = place + rotation_z(yaw) @ np.array(carried)
        if observer in self.field.cameras:
            camera = self.true.cameras[observer]
            rotation, eye, turned = world_from_downward_optical(camera.rotation_deg), np.array(camera.position_m), 0.0
        else:
            mount, (base, turned) = self.true.drones[observer].camera, self.pose(observer, t)
            level = rotation_from_euler(0.0, 0.0, turned)
            tilt, pan = math.radians(mount.tilt_down_deg), math.radians(mount.pan_left_deg)
            rotation, eye = level @ base_from_tilted_optical(tilt, pan), base + level @ np.array(mount.position_m)
        centre = rotation.T @ (marker - eye)
        if centre[2] < 0.3:
            return None
        seen = np.array([*centre, yaw - turned]) + NOISE * self.rng.standard_normal(4)
        exact = RelativeObservation(
            header=self.header(t, observer),
            observer=observer,
            subject=subject,
            camera=observer,
            position_m=tuple(seen[:3].tolist()),
            yaw_rad=math.remainder(seen[3], math.tau),
            covariance=tuple(np.diag(NOISE**2).ravel().tolist()),
        )
        return self.wrong.reported(exact)

    def messages(self, t: float, tick: int) -> Iterator[tuple[str, Message]]:
        for name in self.field.drones:
            state = FlightState.LANDED if t < STAND_S else FlightState.FLYING
            yield "status", VehicleStatus(header=self.header(t, name), flight_state=state, mode="TRACK")
            yield "odometry", self.own(name, t)
        if tick % 5 == 0:
            for observer in ("ceiling", *self.field.drones):
                for subject in (*self.field.drones, *self.field.tracked):
                    if subject != observer and not (observer == "ceiling" and subject in self.field.tracked):
                        found = self.sighting(observer, subject, t + 0.02 * self.rng.random())
                        if found is not None:
                            yield "observation", found

    def flown(self) -> Flown:
        ticks = []
        for tick in range(round(self.seconds * 50)):
            t = 100.0 + tick / 50.0
            ticks.append((round(t * 1e9) + 1, tuple(self._later(self.messages(tick / 50.0, tick)))))
        return Flown(tuple(ticks), CLOCK)

    def _later(self, messages: Iterator[tuple[str, Message]]) -> Iterator[tuple[str, Message]]:
        for key, message in messages:
            stamp_ns = message.header.stamp_ns + 100_000_000_000
            header = msgspec.structs.replace(message.header, stamp_ns=stamp_ns)
            yield key, msgspec.structs.replace(message, header=header)
