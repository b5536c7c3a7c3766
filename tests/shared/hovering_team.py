"""A tracker that gets messages about a target from two hovering drones and a ceiling camera."""

import math
from typing import Any

import numpy as np

from groundstation.bus.messages import FlightState, Header, Odometry, RelativeObservation, VehicleStatus, Verdict
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.rotations import base_from_tilted_optical
from groundstation.tracker import Tracker, tracker_from_field

MS, START = 1_000_000, 7_000_000_000_000
COVARIANCE = tuple(np.diag([1e-4, 1e-4, 4e-4, 1e-3]).ravel().tolist())
TILTED = base_from_tilted_optical(math.radians(45))
PLACES = {"drone_1": np.array([-0.9, 0.5, 1.3]), "drone_2": np.array([-0.9, -0.7, 1.3])}
TARGET = np.array([0.2, 0.3, 0.4])


class Flight:
    """Two hovering drones, a target at rest, and cameras without noise."""

    def __init__(self, field: ResolvedField) -> None:
        self.tracker: Tracker = tracker_from_field(field, "here", 3)
        self.now = START
        self.seq = 0
        self.target = TARGET.copy()
        self.places = {name: place.copy() for name, place in PLACES.items()}
        self.corrections: list[Any] = []
        self.notices: list[Any] = []
        self.unseen = set[str]()  # drones outside of the ceiling camera's view

    def header(self, entity: str, age_ms: int = 0, clock: str = "here") -> Header:
        self.seq += 1
        return Header(self.now - age_ms * MS, clock, entity, entity, self.seq)

    def ingest(self, message: Any, key: str = "") -> Verdict | None:
        return self.tracker.ingest(key or f"{type(message).__name__}/{message.header.entity}", message, self.now)

    def fly(self, *names: str, state: FlightState = FlightState.FLYING) -> None:
        for name in names:
            assert self.ingest(VehicleStatus(header=self.header(name), flight_state=state, mode="TRACK")) is None

    def odometry(self, name: str, **changes: Any) -> Odometry:
        trembling = 1e-9 * self.seq  # constant values would count as a frozen sensor
        values: dict[str, Any] = {"velocity_m_s": (0.0, 0.0, 0.0), "yaw_rad": 0.0, "height_m": 1.3}
        values |= {"roll_rad": trembling, "pitch_rad": 0.0}
        return Odometry(header=self.header(name), velocity_covariance=(0.01,) * 9, **(values | changes))

    def ceiling(self, name: str, age_ms: int = 50, **changes: Any) -> RelativeObservation:
        x, y, z = self.places[name]
        position = (float(x), float(-y), 4.2 - float(z) - 0.08)
        return self.sighting("ceiling", name, position, 0.0, age_ms, **changes)

    def onboard(self, name: str, age_ms: int = 50, **changes: Any) -> RelativeObservation:
        base = self.target - self.places[name] - np.array([0.09, 0.0, 0.0])
        return self.sighting(name, "turtlebot", tuple((TILTED.T @ base).tolist()), 0.3, age_ms, **changes)

    def sighting(
        self, observer: str, subject: str, position: tuple[float, ...], yaw: float | None, age_ms: int, **changes: Any
    ) -> RelativeObservation:
        position = (position[0] + 1e-9 * self.seq, *position[1:])
        values = {"position_m": position, "yaw_rad": yaw, "covariance": COVARIANCE, "camera": f"{observer}_camera"}
        header = changes.pop("header", None) or self.header(observer, age_ms)
        return RelativeObservation(header=header, observer=observer, subject=subject, **(values | changes))

    def run(self, seconds: float, look: bool = True, onboard: bool = True) -> None:
        for _ in range(round(seconds * 50)):
            self.now += 20 * MS
            for name in self.places:
                assert self.ingest(self.odometry(name)) is None
                if look and name not in self.unseen:
                    assert self.ingest(self.ceiling(name)) is None
                if onboard:
                    assert self.ingest(self.onboard(name)) is None
            self.tracker.advance(self.now)
            self.corrections += self.tracker.take_corrections()
            self.notices += self.tracker.take_notices()
