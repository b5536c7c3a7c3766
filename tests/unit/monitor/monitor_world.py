"""A bus with the monitor's screen on it, and shorthands to publish as the other processes."""

import io
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from rich.console import Console

from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.monitor.screen import Screen
from groundstation.monitor.state import Cast, MonitorState
from groundstation.monitor.table import render

S = 1_000_000_000
NOW = 100 * S
CAST = Cast(
    "lab", {"drone_1": 0.15, "drone_2": 0.15}, ("turtlebot",), ("ceiling",), {"drone_1": 720.0, "drone_2": 720.0},
    room_m=(8.0, 6.0),
)  # fmt: skip


class World:
    """A bus with a screen on it, and shorthands to publish as the other processes."""

    def __init__(self) -> None:
        exchange = MemoryExchange()
        self._exchange = exchange
        self.output = io.StringIO()
        console = Console(file=self.output, force_terminal=True, width=140, height=40)
        self.screen = Screen(MemoryBus(exchange, "lab", "monitor"), CAST, 0, console)

    @property
    def state(self) -> MonitorState:
        return self.screen.state

    def header(self, entity: str, age_s: float = 0.0) -> m.Header:
        return m.Header(NOW - round(age_s * S), "here", entity, entity, 1)

    def say(self, topic: t.Topic, message: m.Message) -> None:
        MemoryBus(self._exchange, "lab", message.header.source).publish(topic, message)

    def vehicle(
        self, name: str, mode: str = "TRACK", battery: float | None = 0.8, age_s: float = 0.0, **more: Any
    ) -> None:
        state, rate_hz = more.pop("flight_state", m.FlightState.FLYING), more.pop("rate_hz", 199.7)
        header = self.header(name, age_s)
        self.say(
            t.VEHICLE_STATUS,
            m.VehicleStatus(header=header, flight_state=state, mode=mode, battery=battery, rate_hz=rate_hz, **more),
        )

    def estimate(
        self,
        target_age_s: float = 0.1,
        age_s: float = 0.0,
        *searches: m.TargetSearch,
        drone_age_s: float = 0.2,
        drone_2: Mapping[str, Any] | None = MappingProxyType({}),
    ) -> None:
        wide = (0.04, 0.0, 0.0, 0.01)
        robot = tuple(0.01 if index % 5 == 0 else 0.0 for index in range(16))
        second = ("drone_2", "robot", (-1.5, 0.5, 1.3, 0.0), robot, (0.0,) * 3, True, 0.2)
        entities = (
            m.EntityEstimate("drone_1", "robot", (1.25, -0.5, 1.3, 0.0), robot, (0.0,) * 3, True, drone_age_s),
            *([] if drone_2 is None else [m.EntityEstimate(*second, **drone_2)]),
            m.EntityEstimate("turtlebot", "target", (0.75, 0.25), wide, (0.0, 0.0), True, target_age_s),
        )
        header = self.header("team", age_s)
        self.say(t.ESTIMATE, m.Estimate(header=header, entities=entities, epoch=1, searches=searches))

    def camera(self, name: str, connected: bool = True, **more: Any) -> None:
        header = self.header(name)
        figures = {"fps": 10.0, "age_ms": 0.0, "frames": 9, "skipped": 0, "detections": 0} | more
        self.say(t.CAMERA_STATUS, m.CameraStatus(header=header, connected=connected, **figures))

    def status(self, name: str, state: m.Lifecycle = m.Lifecycle.READY, age_s: float = 0.0, detail: str = "") -> None:
        header = self.header(name, age_s)
        self.say(
            t.PROCESS_STATUS,
            m.ProcessStatus(header=header, state=state, pid=1, cpu=0.34, ticks=100, overruns=2, detail=detail),
        )

    def text(self) -> str:
        self.screen._due_ns = 0
        self.screen.turn(NOW)
        console = Console(record=True, width=140, file=io.StringIO())
        console.print(render(self.state, NOW))
        return console.export_text()


def sighting(world: World, observer: str) -> m.RelativeObservation:
    return m.RelativeObservation(
        header=world.header(observer, 0.1), observer=observer, subject="turtlebot", camera="drone_1_camera",
        position_m=(0.0, 0.0, 1.0), yaw_rad=None, covariance=(0.0,) * 9,
    )  # fmt: skip


def plan(world: World) -> m.Plan:
    return m.Plan(
        header=world.header("team"), topology="drone_1/drone_2", cost=0.0123, controls=(), edges=(),
        alternatives=(m.Alternative("drone_1,drone_2", 0.0150), m.Alternative("drone_1/drone_2", 0.0123)),
        solver=m.SolverReport("converged", 40, 0.012, 2, 1), mode="multistart",
    )  # fmt: skip
