"""Stand-ins for supervisor, operator and tracker; this tracker publishes the true states."""

import itertools
import math
import threading
import time

import msgspec

from groundstation.bus.api import Bus, Subscription
from groundstation.bus.messages import Command, EntityEstimate, Estimate, Lease, VelocitySetpoint, Verb
from groundstation.bus.topics import (
    COMMAND,
    COMMAND_ACK,
    ESTIMATE,
    EVENT,
    IMU,
    LEASE,
    ODOMETRY,
    PROCESS_STATUS,
    RAW_RX,
    RAW_TX,
    SETPOINT,
    VEHICLE_STATUS,
)
from groundstation.process.heartbeat import SUPERVISOR_SLOT, HeartbeatBlock
from groundstation.process.priority import go_first
from groundstation.time_units import NS_PER_S
from sim_bridge.conformance.record import Heard, Record
from sim_bridge.conformance.subject import NAME

HEARD = (ODOMETRY, IMU, VEHICLE_STATUS, COMMAND_ACK, EVENT, PROCESS_STATUS, RAW_RX, RAW_TX)
LIFETIME_MS = 300
_PERIOD_S = 0.02
_COVARIANCE = tuple(4e-4 if place % 5 == 0 else 0.0 for place in range(16))
_STILL = (0.0, 0.0, 0.0)


class Upstream:
    """Publishes every 20 ms from a thread, according to its attributes.

    leases, beats, sees, speaks: whether leases, beats of the supervisor, estimates, setpoints are sent; wanted:
    velocity [m/s; base_stabilized] and turn [rad/s] of the setpoints; converged, epoch: their fields.
    """

    def __init__(self, bus: Bus, stranger: Bus, beats: HeartbeatBlock, record: Record) -> None:
        self.leases = self.beats = self.sees = self.speaks = self.converged = True
        self.wanted: tuple[tuple[float, float, float], float] = (_STILL, 0.0)
        self.epoch = 1
        self._bus, self._stranger, self._block, self._record = bus, stranger, beats, record
        self._heard: dict[str, Subscription] = {topic.name: bus.subscribe([topic]) for topic in HEARD}
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._numbers = itertools.count()
        self._thread = threading.Thread(target=self._turn, name="upstream", daemon=True)

    def start(self) -> None:
        """Begin to publish."""
        self._thread.start()

    def close(self) -> None:
        """Stop publishing."""
        self._ended.set()
        self._thread.join()

    def _turn(self) -> None:
        go_first()
        due = time.monotonic()
        for tick in itertools.count():
            if self._ended.is_set():
                return
            with self._lock:
                self._say(tick)
            self._listen()
            due = max(due + _PERIOD_S, time.monotonic() - _PERIOD_S)
            time.sleep(max(0.0, due - time.monotonic()))

    def _say(self, tick: int) -> None:
        if self.beats:
            self._block.beat(SUPERVISOR_SLOT)
        if self.leases and tick % 5 == 0:
            now_ns = time.monotonic_ns()
            self._bus.publish(LEASE, Lease(header=self._bus.header("team"), holder="kit", expires_ns=now_ns + NS_PER_S))
        moments = self._record.moments
        if not moments:
            return
        aloft = not moments[-1].on_ground
        if self.sees:
            estimate = Estimate(header=self._bus.header("team"), entities=self._seen() if aloft else (), epoch=1)
            self._bus.publish(ESTIMATE, estimate)
        if self.speaks and aloft:
            self._bus.publish(SETPOINT, self.setpoint(self._bus))

    def _seen(self) -> tuple[EntityEstimate, ...]:
        now = self._record.moments[-1]
        mean = (*now.position, math.remainder(now.attitude[2], math.tau))
        return (EntityEstimate(NAME, "robot", mean, _COVARIANCE, now.velocity, True, 0.0),)

    def setpoint(self, bus: Bus, **changes: object) -> VelocitySetpoint:
        """Return the present setpoint, with changes of its fields."""
        velocity, turn = self.wanted
        made = VelocitySetpoint(
            header=bus.header(NAME),
            velocity_m_s=velocity,
            yaw_rate_rad_s=turn,
            lifetime_ms=LIFETIME_MS,
            epoch=self.epoch,
            converged=self.converged,
        )
        return msgspec.structs.replace(made, **changes)

    def _listen(self) -> None:
        for name, subscription in self._heard.items():
            heard = self._record.messages[name]
            heard.extend(Heard(time.monotonic_ns(), received) for received in subscription.drain())

    def say(self, name: str, setpoint: VelocitySetpoint, seq: int | None = None) -> None:
        """Publish one unusual setpoint as the tracker or, by name "stranger", as another sender."""
        if seq is not None:
            setpoint = msgspec.structs.replace(setpoint, header=msgspec.structs.replace(setpoint.header, seq=seq))
        with self._lock:
            self.bus_of(name).publish(SETPOINT, setpoint)

    def bus_of(self, name: str) -> Bus:
        """Return the bus of the tracker and operator ("kit"), or that of a stranger."""
        return self._stranger if name == "stranger" else self._bus

    def order(
        self, name: str, verb: Verb, *, scope: tuple[str, ...] = (NAME,), issuer: str = "kit", lives_s: float = 5.0
    ) -> Command:
        """Give a command, and keep its id in the record under a name."""
        with self._lock:
            bus = self.bus_of("stranger" if issuer == "stranger" else "kit")
            expires_ns = time.monotonic_ns() + round(lives_s * NS_PER_S)
            made = Command(
                header=bus.header("team"),
                id=f"{name}-{next(self._numbers)}",
                verb=verb,
                scope=scope,
                issuer=issuer,
                expires_ns=expires_ns,
            )
            self._record.commands[name] = made.id
            bus.publish(COMMAND, made)
        return made

    def repeat(self, command: Command) -> None:
        """Give a command once more, with the same id."""
        with self._lock:
            self._bus.publish(COMMAND, command)
