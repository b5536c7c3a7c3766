"""Drivers and cameras on a memory bus, and the tracker's loop under test."""

import math
import time
from typing import Any

import numpy as np

from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import FlightState, Header, Message, Odometry, RelativeObservation, VehicleStatus
from groundstation.bus.topics import (
    BELIEF,
    COMMAND,
    ESTIMATE,
    INNOVATION,
    JOURNAL,
    OBSERVATION,
    ODOMETRY,
    PLAN,
    SETPOINT,
    VEHICLE_STATUS,
    Topic,
)
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.rotations import base_from_tilted_optical
from groundstation.runtime.tracker_loop import TrackerSection, Tracking

MS = 1_000_000
PLACES = {"drone_1": (-0.9, 0.5, 1.3), "drone_2": (-0.9, -0.7, 1.3)}
COVARIANCE = tuple(np.diag([1e-4, 1e-4, 4e-4, 1e-3]).ravel().tolist())
TARGET = np.array([0.2, 0.3, 0.4])


class Lab:
    """Drivers and cameras on a memory bus, and the tracker's loop under test."""

    def __init__(self, field: ResolvedField) -> None:
        exchange = MemoryExchange()
        self.buses = {name: MemoryBus(exchange, "lab", name) for name in (*PLACES, "ceiling")}
        self.listener = MemoryBus(exchange, "lab", "listener")
        self.heard = self.listener.subscribe([ESTIMATE, BELIEF, SETPOINT, PLAN, INNOVATION, JOURNAL, COMMAND])
        self.tape = self.listener.subscribe([ODOMETRY, OBSERVATION, VEHICLE_STATUS])
        self.tracking = Tracking(MemoryBus(exchange, "lab", "tracker"), TrackerSection(field, 2))
        self.now = clock.now_ns()
        self.sees_target = True
        self.rng = np.random.default_rng(1)

    def send(self, topic: Topic, source: str, make: Any, age_ms: int = 0, entity: str = "") -> None:
        bus = self.buses[source]
        bus.publish(topic, make(bus.header(entity or source, self.now - age_ms * MS)))

    def sense(self, look: bool) -> None:
        for name, (x, y, z) in PLACES.items():
            noise = self.rng.normal(0.0, 0.01, 3).tolist()
            self.send(VEHICLE_STATUS, name, _flying)
            self.send(ODOMETRY, name, _odometry, age_ms=5)
            position = (x + noise[0], -y + noise[1], 4.12 - z + noise[2])
            if look:
                self.send(OBSERVATION, "ceiling", lambda h, n=name, p=position: _sight(h, n, p), age_ms=120)
            if look and self.sees_target:
                base = TARGET - np.array([x + 0.09, y, z])
                relative = tuple((base_from_tilted_optical(math.radians(45)).T @ base + noise).tolist())
                self.send(OBSERVATION, name, lambda h, p=relative: _sight(h, "turtlebot", p), age_ms=150)

    def run(self, ticks: int, look: bool = True, pause_s: float = 0.0) -> None:
        for _ in range(ticks):
            self.now += 20 * MS
            self.sense(look)
            self.tracking.tick(self.now)
            time.sleep(pause_s)

    def messages(self) -> dict[str, list[Any]]:
        found: dict[str, list[Any]] = {}
        for received in self.heard.drain():
            found.setdefault(received.key.topic.name, []).append(received.message)
        return found


def _flying(header: Header) -> Message:
    return VehicleStatus(header=header, flight_state=FlightState.FLYING, mode="TRACK")


def _odometry(header: Header) -> Message:
    covariance = (0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.01)
    return Odometry(
        header=header, velocity_m_s=(0, 0, 0), velocity_covariance=covariance, yaw_rad=0, roll_rad=0, pitch_rad=0,
        height_m=1.3,
    )  # fmt: skip


def _sight(header: Header, subject: str, position: tuple[float, float, float]) -> Message:
    return RelativeObservation(
        header=header, observer=header.entity, subject=subject, camera=f"{header.entity}_camera", position_m=position,
        yaw_rad=0.0, covariance=COVARIANCE,
    )  # fmt: skip
