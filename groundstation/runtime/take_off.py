"""Take-off one by one: the next drone after the former flies and is seen by a camera.

A state machine without clock or bus: `step` gets the time and returns what to order.
"""

from dataclasses import dataclass
from enum import Enum, auto

from groundstation.bus.messages import AckStage, Verb
from groundstation.runtime.acknowledgements import Progress
from groundstation.runtime.team import Team

_NS_PER_S = 1_000_000_000


@dataclass(frozen=True, slots=True)
class TakeOffLimits:
    """How long each step may take [s]; a drone that never connects, lifts off or is seen does not hold the others."""

    connect_s: float = 5.0
    retry_s: float = 0.3
    lift_off_s: float = 15.0
    unseen_s: float = 10.0


@dataclass(frozen=True, slots=True)
class Order:
    """What the sequence wants said to one drone, and why if it is a landing."""

    verb: Verb
    drone: str
    reason: str = ""


class _Step(Enum):
    CONNECT = auto()
    LIFT_OFF = auto()
    BE_SEEN = auto()


class TakeOff:
    """One sequence over the given drones; finished when nobody is left waiting."""

    def __init__(self, drones: tuple[str, ...], limits: TakeOffLimits, now_ns: int) -> None:
        self._waiting = list(drones)
        self._limits = limits
        self._began_ns = self._step_ns = now_ns
        self._step = _Step.CONNECT
        self._ordered_ns = 0
        self._refusal = ""
        self.up: list[str] = []
        self.left_out: dict[str, str] = {}

    @property
    def finished(self) -> bool:
        """Whether every drone is up or left out."""
        return not self._waiting

    @property
    def current(self) -> str:
        """The drone whose turn it is, or ""."""
        return self._waiting[0] if self._waiting else ""

    def drop(self, drone: str, reason: str, now_ns: int) -> None:
        """Leave out a drone that someone stopped; the others go on."""
        if drone in self._waiting:
            was_current = drone == self.current
            self._waiting.remove(drone)
            self.left_out[drone] = reason
            if was_current:
                self._next(now_ns)
        elif drone in self.up:
            self.up.remove(drone)
            self.left_out[drone] = reason

    def step(self, now_ns: int, team: Team, progress: Progress | None) -> Order | None:
        """Return what to order now; progress: the answers to the last TAKEOFF of the current drone."""
        if self.finished:
            return None
        member = team.members[self.current]
        if member.up and self._step is not _Step.BE_SEEN:
            self._go_to(_Step.BE_SEEN, now_ns)
        match self._step:
            case _Step.CONNECT:
                return self._connect(now_ns, member.connected(now_ns), member.detail)
            case _Step.LIFT_OFF:
                return self._lift_off(now_ns, progress)
            case _Step.BE_SEEN:
                return self._be_seen(now_ns, member.seen_in_flight)

    def _connect(self, now_ns: int, connected: bool, detail: str) -> Order | None:
        if connected and now_ns - self._ordered_ns >= self._limits.retry_s * _NS_PER_S:
            self._ordered_ns = now_ns
            order = Order(Verb.TAKEOFF, self.current)
            self._go_to(_Step.LIFT_OFF, now_ns, keep_time=bool(self._refusal))
            return order
        if self._late(now_ns, self._limits.connect_s):
            return self._leave_out(self._refusal or detail or "its driver has no connection to it", now_ns)
        return None

    def _lift_off(self, now_ns: int, progress: Progress | None) -> Order | None:
        if progress is not None and progress.stage is AckStage.REFUSED:
            # Some reasons pass (lease not heard yet, trim not done): ask again for a while.
            self._refusal = f"refused: {progress.reason}"
            self._go_to(_Step.CONNECT, now_ns, keep_time=True)
            return None
        if self._late(now_ns, self._limits.lift_off_s):
            return self._leave_out("did not lift off", now_ns, land=True)
        return None

    def _be_seen(self, now_ns: int, seen: bool) -> Order | None:
        if seen:
            self.up.append(self._waiting.pop(0))
            self._next(now_ns)
        elif self._late(now_ns, self._limits.unseen_s):
            reason = f"not seen by any camera for {self._limits.unseen_s:g} s"
            return self._leave_out(reason, now_ns, land=True)
        return None

    def _leave_out(self, reason: str, now_ns: int, land: bool = False) -> Order | None:
        name = self._waiting.pop(0)
        self.left_out[name] = reason
        self._next(now_ns)
        return Order(Verb.LAND, name, reason) if land else None

    def _next(self, now_ns: int) -> None:
        self._refusal, self._ordered_ns = "", 0
        self._go_to(_Step.CONNECT, now_ns)

    def _go_to(self, step: _Step, now_ns: int, keep_time: bool = False) -> None:
        self._step = step
        if not keep_time:
            self._step_ns = now_ns

    def _late(self, now_ns: int, limit_s: float) -> bool:
        return now_ns - self._step_ns >= limit_s * _NS_PER_S
