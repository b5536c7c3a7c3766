"""An operator whose drones answer as the test says, and another shell that orders."""

from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import OPERATOR, AckStage, Command, CommandAck, FlightState, VehicleStatus
from groundstation.bus.topics import COMMAND, COMMAND_ACK, VEHICLE_STATUS
from groundstation.runtime.operator import Operator
from groundstation.runtime.take_off import TakeOffLimits

S = 10**9
UP, DOWN = FlightState.HOVERING, FlightState.LANDED


class Desk:
    """An operator of drones with given telemetry, and another shell."""

    def __init__(self, run="", **states):
        exchange = MemoryExchange()
        self.said: list[str] = []
        self.now_ns = clock.now_ns() // S * S
        self.shell = MemoryBus(exchange, "lab", "cli_1")
        self.drones = {name: (MemoryBus(exchange, "lab", name), state) for name, state in states.items()}
        bus = MemoryBus(exchange, "lab", "supervisor", run)
        self.operator = Operator(bus, tuple(states), {}, TakeOffLimits(), self.said.append)
        self.given = self.shell.subscribe([COMMAND])
        self.answers = self.shell.subscribe([COMMAND_ACK], entity=OPERATOR)
        self.turn()

    def turn(self, seconds=0.1):
        for name, (bus, state) in self.drones.items():
            bus.publish(VEHICLE_STATUS, VehicleStatus(header=bus.header(name), flight_state=state, mode="HOVER"))
        self.now_ns += round(seconds * S)
        self.operator.step(self.now_ns)

    def command(self, verb, *scope, identity="r", age_s=0.0, lives_s=0.0):
        header = self.shell.header("team", self.now_ns - round(age_s * S))
        expires_ns = header.stamp_ns + round(lives_s * S) if lives_s else 0
        return Command(header=header, id=identity, verb=verb, scope=scope, issuer="cli_1", expires_ns=expires_ns)

    def send(self, command):
        self.shell.publish(COMMAND, command)
        self.turn()

    def ask(self, verb, *scope, identity="r"):
        self.send(self.command(verb, *scope, identity=identity))

    def confirm(self, *stages, refused=()):
        """Let every drone answer the newest command of the operator."""
        command = self.orders()[-1]
        for name in command.scope or tuple(self.drones):
            bus, _ = self.drones[name]
            for stage in (AckStage.REFUSED,) if name in refused else stages:
                ack = CommandAck(header=bus.header(name), command_id=command.id, verb=command.verb, stage=stage)
                bus.publish(COMMAND_ACK, ack)
        self.turn()

    def orders(self):
        self._orders = [*getattr(self, "_orders", []), *(r.message for r in self.given.drain())]
        return [command for command in self._orders if command.issuer == OPERATOR]

    def stages(self):
        answers = [r.message for r in self.answers.drain() if isinstance(r.message, CommandAck)]
        return [(ack.stage, ack.reason) for ack in answers]


DONE = (AckStage.RECEIVED, AckStage.ACCEPTED, AckStage.EFFECTIVE)
