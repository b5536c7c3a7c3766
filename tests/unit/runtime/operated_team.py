"""Drones with their drivers on a memory bus, and the operator who commands them."""

from collections.abc import Iterator

from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import (
    OPERATOR,
    AckStage,
    Command,
    CommandAck,
    FlightState,
    Odometry,
    RelativeObservation,
    VehicleStatus,
    Verb,
)
from groundstation.bus.topics import COMMAND, COMMAND_ACK, OBSERVATION, ODOMETRY, VEHICLE_STATUS
from groundstation.runtime.marker_height import FixedCamera
from groundstation.runtime.operator import Operator
from groundstation.runtime.take_off import TakeOffLimits

MS = 1_000_000
LIMITS = TakeOffLimits(connect_s=5, lift_off_s=15, unseen_s=10)
CEILING_M, MARKER_M, FLIGHT_M = 4.2, 0.1, 0.8
CLEARED = "it was in an emergency"
CAMERAS = {"ceiling": FixedCamera(CEILING_M, (0.0, 0.0, -1.0))}


class Drone:
    """A driver with its drone: takes off in half a second, answers every command; as an AR.Drone in an emergency.

    marker: name of the marker on the drone; reports: whether it measures its height.
    """

    def __init__(
        self,
        exchange: MemoryExchange,
        name: str,
        seen: bool = True,
        refusal: str = "",
        marker: str = "",
        reports: bool = True,
    ) -> None:
        self.bus = MemoryBus(exchange, "lab", name)
        self.camera = MemoryBus(exchange, "lab", "ceiling")
        self.name, self.seen, self.refusal = name, seen, refusal
        self.marker, self.reports = marker or name, reports
        self.state, self.mode = FlightState.LANDED, "HOVER"
        self.commands = self.bus.subscribe([COMMAND])
        self.heard: list[Verb] = []
        self.change: tuple[int, FlightState, Command] | None = None
        self.last: dict[str, AckStage] = {}
        self.lost: AckStage | None = None  # the first answer of this stage does not arrive

    def turn(self, now_ns: int) -> None:
        for received in self.commands.drain():
            command = received.message
            assert isinstance(command, Command)
            if OPERATOR not in command.scope and (not command.scope or self.name in command.scope):
                self.obey(command, now_ns)
        if self.change and now_ns >= self.change[0]:
            self.state = self.change[1]
            self.answer(self.change[2], AckStage.EFFECTIVE)
            self.change = None
        header = self.bus.header(self.name)
        self.bus.publish(VEHICLE_STATUS, VehicleStatus(header=header, flight_state=self.state, mode=self.mode))
        height_m = 0.0 if self.state is FlightState.LANDED else FLIGHT_M
        self.measure(height_m if self.reports and height_m else None)
        if self.seen:
            self.observe(height_m)

    def obey(self, command: Command, now_ns: int) -> None:
        if command.id in self.last:
            self.answer(command, self.last[command.id])
            return
        self.heard.append(command.verb)
        self.answer(command, AckStage.RECEIVED)
        if self.state is FlightState.EMERGENCY and command.verb is Verb.TAKEOFF:
            self.state = FlightState.LANDED
            self.answer(command, AckStage.REFUSED, CLEARED, final=True)
            return
        if self.refusal and command.verb is Verb.TAKEOFF:
            self.answer(command, AckStage.REFUSED, self.refusal)
            return
        self.answer(command, AckStage.ACCEPTED)
        after = {Verb.TAKEOFF: FlightState.HOVERING, Verb.LAND: FlightState.LANDED}.get(command.verb, self.state)
        self.change = (now_ns + 500 * MS, after, command)

    def answer(self, command: Command, stage: AckStage, reason: str = "", final: bool = False) -> None:
        self.last[command.id] = stage
        if stage is self.lost:
            self.lost = None
            return
        header = self.bus.header(self.name)
        ack = CommandAck(
            header=header, command_id=command.id, verb=command.verb, stage=stage, reason=reason, final=final
        )
        self.bus.publish(COMMAND_ACK, ack)

    def measure(self, height_m: float | None) -> None:
        odometry = Odometry(
            header=self.bus.header(self.name),
            velocity_m_s=(0.0, 0.0, 0.0),
            velocity_covariance=(1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0),
            yaw_rad=0.0,
            roll_rad=0.0,
            pitch_rad=0.0,
            height_m=height_m,
        )
        self.bus.publish(ODOMETRY, odometry)

    def observe(self, height_m: float) -> None:
        observation = RelativeObservation(
            header=self.camera.header("ceiling"),
            observer="ceiling",
            subject=self.marker,
            camera="ceiling",
            position_m=(0.0, 0.0, CEILING_M - MARKER_M - height_m),
            yaw_rad=None,
            covariance=(1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0),
        )
        self.camera.publish(OBSERVATION, observation)


class Scene:
    def __init__(self) -> None:
        self.exchange = MemoryExchange()
        self.said: list[str] = []
        self.bus = MemoryBus(self.exchange, "lab", "supervisor")
        self.operator = Operator(self.bus, ("drone_1", "drone_2"), CAMERAS, LIMITS, self.said.append)
        self.drones: dict[str, Drone] = {}
        self.now_ns = clock.now_ns() // 10**9 * 10**9

    def add(self, name: str, **options: object) -> Drone:
        self.drones[name] = Drone(self.exchange, name, **options)  # type: ignore[arg-type]
        return self.drones[name]

    def run(self, seconds: float) -> Iterator[float]:
        for _ in range(round(seconds * 20)):
            self.now_ns += 50 * MS
            for drone in self.drones.values():
                drone.turn(self.now_ns)
            self.operator.step(self.now_ns)
            yield self.now_ns / 1e9

    def pass_(self, seconds: float) -> None:
        for _ in self.run(seconds):
            pass
