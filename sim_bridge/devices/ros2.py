"""An emulated vehicle behind a ROS 2 node, and the node's Zenoh router; it moves as the emulated Tello does.

The node is strict, as drivers are: it flies only after its take-off order, and stops when no velocity has come for
0.5 s.
"""

import math
import os
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from drivers.rmw_zenoh.wire import graph, vehicle
from drivers.rmw_zenoh.wire.cdr import WireError
from groundstation.errors import GroundStationError
from groundstation.vectors import Vector3
from sim_bridge.devices.ros2_router import Ros2Router
from sim_bridge.devices.tello import TelloBody
from sim_bridge.launch_spec import LaunchSpec
from sim_bridge.scenario import Scenario
from sim_bridge.site import SiteDrone
from sim_bridge.world.airframe import STANDING_HEIGHT_M
from sim_bridge.world.readings import Readings
from sim_bridge.wrong_values import WrongValues, wrong_values_of

_TICK_S, _ODOMETRY_TICKS, _BATTERY_TICKS, _HELD_TICKS = 0.005, 7, 100, 100
_CLIMB_M_S, _DESCENT_M_S = 0.5, 0.4
_STILL: Vector3 = (0.0, 0.0, 0.0)
_HASH = "RIHS01_" + "0" * 64  # of types whose readers ask for any
_DEFAULTS: dict[str, Any] = {
    "namespace": "", "domain": 0, "port": 7447, "distro": "jazzy", "odometry": "odom", "battery": "battery",
    "velocity": "cmd_vel", "velocity_type": "twist", "orders": "topics", "take_off": "takeoff", "land": "land",
    "cut": "reset", "take_off_m": 0.8, "standing_z_m": 0.0,
}  # fmt: skip


class Ros2Emulator:
    """Router, topics and services of one body; `sim_bridge.world.emulation.Emulator`."""

    def __init__(
        self, name: str, address: str, section: dict[str, Any], body: TelloBody, wrong: WrongValues | None = None
    ) -> None:
        self.silent = self.deaf = False
        self._body, self._wrong, self._section = body, wrong, _DEFAULTS | section
        self._waiting: deque[tuple[str, bytes]] = deque()
        self._bell = os.eventfd(0, os.EFD_NONBLOCK)
        self._order, self._ticks = "", 0
        self._heard_tick = -_HELD_TICKS
        endpoint = f"tcp/{address}:{self._section['port']}"
        try:
            self._router = Ros2Router(name, endpoint)
        except GroundStationError:
            os.close(self._bell)
            raise
        self._declare()

    def _key(self, name: str, kind: str) -> str:
        """Return the key of a topic or service, as the node's section names it."""
        topic, own = str(self._section[name]), self._section
        absolute = topic if topic.startswith("/") or not own["namespace"] else f"{own['namespace']}/{topic}"
        hashed = "TypeHashNotSupported" if own["distro"] == "humble" else vehicle.HASHES.get(kind, _HASH)
        return graph.topic_key(own["domain"], absolute, kind, hashed)

    def _declare(self) -> None:
        stamped = self._section["velocity_type"] == "twist_stamped"
        velocity = self._key("velocity", vehicle.TWIST_STAMPED if stamped else vehicle.TWIST)
        self._router.session.declare_subscriber(velocity, self._taker("velocity"))
        for order in ("take_off", "land", "cut"):
            if self._section["orders"] == "services":
                key = self._key(order, vehicle.TRIGGER)
                self._router.session.declare_queryable(key, self._server(order, key))
            else:
                self._router.session.declare_subscriber(self._key(order, vehicle.EMPTY), self._taker(order))
        self._odometry = self._router.publisher(self._key("odometry", vehicle.ODOMETRY))
        self._charge = self._router.publisher(self._key("battery", vehicle.BATTERY))

    def _taker(self, what: str) -> Callable[[Any], None]:
        return lambda sample: self._ring(what, sample.payload.to_bytes())

    def _server(self, what: str, key: str) -> Callable[[Any], None]:
        def serve(query: Any) -> None:
            self._ring(what, query.payload.to_bytes() if query.payload is not None else b"")
            query.reply(key, vehicle.encode_answer(True, ""), attachment=query.attachment)

        return serve

    def _ring(self, what: str, payload: bytes) -> None:
        """Queue a message for the loop; called on the network's thread."""
        self._waiting.append((what, payload))
        with suppress(OSError):
            os.eventfd_write(self._bell, 1)

    def fileno(self) -> int:
        """Return a descriptor that becomes readable when a message waits."""
        return self._bell

    def receive(self) -> None:
        """Obey all waiting messages."""
        with suppress(BlockingIOError):
            os.eventfd_read(self._bell)
        while self._waiting:
            what, payload = self._waiting.popleft()
            if not self.deaf:
                self._obey(what, payload)

    def _obey(self, what: str, payload: bytes) -> None:
        body = self._body
        if what == "cut":
            body.motors_on, self._order = False, ""
        elif what == "land" and body.motors_on:
            self._order = "land"
        elif what == "take_off" and not body.motors_on:
            self._order, body.motors_on = "take_off", True
        elif what == "velocity" and body.motors_on and not self._order:
            with suppress(WireError):
                body.wanted = vehicle.decode_twist(payload, self._section["velocity_type"] == "twist_stamped")
                self._heard_tick = self._ticks

    def send(self) -> None:
        """End a tick: continue the present order, and publish what is due."""
        self._ticks += 1
        if self._body.motors_on:
            self._go_on()
        if self.silent:
            return
        if self._ticks % _ODOMETRY_TICKS == 0:
            self._router.publish(self._odometry, self._told())
        if self._ticks % _BATTERY_TICKS == 0:
            self._router.publish(
                self._charge, vehicle.encode_battery(self._ticks * 5_000_000, self._readings().battery)
            )

    def _go_on(self) -> None:
        body = self._body
        if self._order == "take_off":
            body.wanted = ((0.0, 0.0, _CLIMB_M_S), 0.0)
            if body.airframe.z >= self._section["take_off_m"]:
                self._order, body.wanted = "", (_STILL, 0.0)
        elif self._order == "land":
            body.wanted = ((0.0, 0.0, -_DESCENT_M_S), 0.0)
            if not body.airborne:
                self._order, body.motors_on, body.wanted = "", False, (_STILL, 0.0)
        elif self._ticks - self._heard_tick > _HELD_TICKS:
            body.wanted = (_STILL, 0.0)

    def _readings(self) -> Readings:
        told = self._body.senses.readings(self._ticks, self._body.battery)
        up = told.height - STANDING_HEIGHT_M + self._section["standing_z_m"]
        told = replace(told, height=up, position=(*told.position[:2], up))
        return self._wrong.report(self._ticks * _TICK_S, told) if self._wrong else told

    def _told(self) -> bytes:
        """Return the Odometry of this tick: pose in odom, velocity along the vehicle's own, tilted axes."""
        told = self._readings()
        turn, lean = _about(2, told.yaw), _product(_about(1, told.pitch), _about(0, told.roll))
        x, y, z, w = lean
        velocity = _turned((-x, -y, -z, w), told.velocity)
        where = (told.position[0], told.position[1], told.height)
        message = vehicle.OdometryMessage(told.ticks * 5_000_000, where, _product(turn, lean), velocity, told.gyros)
        return vehicle.encode_odometry(message, "odom", "base_link")

    def close(self) -> None:
        """End node and router."""
        self._router.close()
        os.close(self._bell)


def _about(axis: int, angle: float) -> vehicle.Quaternion:
    parts = [0.0, 0.0, 0.0]
    parts[axis] = math.sin(angle / 2)
    return (parts[0], parts[1], parts[2], math.cos(angle / 2))


def _product(one: vehicle.Quaternion, two: vehicle.Quaternion) -> vehicle.Quaternion:
    (a, b, c, d), (e, f, g, h) = one, two
    return (
        d * e + a * h + b * g - c * f,
        d * f - a * g + b * h + c * e,
        d * g + a * f - b * e + c * h,
        d * h - a * e - b * f - c * g,
    )


def _turned(by: vehicle.Quaternion, vector: Vector3) -> Vector3:
    x, y, z, w = by
    turned = _product(_product(by, (*vector, 0.0)), (-x, -y, -z, w))
    return turned[:3]


class Ros2Emulation:
    """Vehicles behind ROS 2 nodes; `sim_bridge.world.emulation.Emulation`."""

    def body(self, drone: SiteDrone, scenario: Scenario, tick_s: float, rng: np.random.Generator) -> TelloBody:
        """Return a vehicle on its pad."""
        return TelloBody(drone, scenario, tick_s, rng)

    def open(self, name: str, body: TelloBody, onboard: None, order: LaunchSpec) -> Ros2Emulator:
        """Return the node of a vehicle, with a router of its own."""
        wrong = wrong_values_of(order.scenario.faults, name)
        return Ros2Emulator(name, order.addresses[name], order.site.drones[name].section("ros2"), body, wrong)


EMULATION = Ros2Emulation()
