"""Take-off one by one: the next drone starts once the one before is seen in flight, and none after a likely mix-up.

A state machine without clock or bus: `step` gets the time and returns the commands.
"""

from collections.abc import Collection
from dataclasses import dataclass
from enum import Enum, auto

from groundstation.bus.messages import AckStage, Verb
from groundstation.runtime.acknowledgements import Progress
from groundstation.runtime.lift_off import LiftOffWatch, Mistake, is_seen_in_flight, why_unseen
from groundstation.runtime.team import Member, TeamStatus
from groundstation.time_units import NS_PER_S


@dataclass(frozen=True, slots=True)
class TakeOffLimits:
    """How long each step may take [s]; a drone that never connects, lifts off or is seen does not hold the others."""

    connect_s: float = 5.0
    retry_s: float = 0.3
    lift_off_s: float = 15.0
    unseen_s: float = 10.0

    @property
    def longest_s(self) -> float:
        """Return how long one drone may hold up the next."""
        return self.connect_s + self.lift_off_s + self.unseen_s


@dataclass(frozen=True, slots=True)
class TakeOffCommand:
    """A command of the sequence to one drone, with a reason if it is a landing."""

    verb: Verb
    drone: str
    reason: str = ""


class _Step(Enum):
    CONNECT = auto()
    LIFT_OFF = auto()
    BE_SEEN = auto()


class TakeOff:
    """One take-off of the given drones, except those that fly already; finished when no drone is waiting.

    up: drones that flew already (flew) or were seen in flight; left_out: the others, with reasons; awaits: those of
    them that only a person may start now; mistake: the likely mix-up that ended the sequence early. It lands only
    drones that it lifted.
    """

    def __init__(
        self, drones: tuple[str, ...], limits: TakeOffLimits, now_ns: int, flying: Collection[str] = ()
    ) -> None:
        each = dict.fromkeys(drones)  # a second entry would start a drone again that was stopped
        self._waiting = [name for name in each if name not in flying]
        self._limits = limits
        self._step_ns = now_ns
        self._step = _Step.CONNECT
        self._ordered_ns = 0
        self._refusal = ""
        self._watch = LiftOffWatch()
        self._lifts = False
        self.up = [name for name in each if name in flying]
        self.flew = set(self.up)
        self.left_out: dict[str, str] = {}
        self.awaits: set[str] = set()
        self.mistake: Mistake | None = None

    @property
    def finished(self) -> bool:
        """Return whether every drone is up or left out."""
        return not self._waiting

    @property
    def current(self) -> str:
        """Return the drone whose turn it is, or ""."""
        return self._waiting[0] if self._waiting else ""

    @property
    def waiting(self) -> tuple[str, ...]:
        """Return the drones that have yet to be seen in flight."""
        return tuple(self._waiting)

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

    def step(self, now_ns: int, team: TeamStatus, progress: Progress | None) -> TakeOffCommand | None:
        """Return the next command; progress: the answers to the last TAKEOFF of the current drone."""
        if self.finished:
            return None
        member = team.members[self.current]
        if not self._lifts and member.flies:
            # Who fell silent, or whose driver started anew, may turn out to be in the air: it is not this sequence's.
            self.flew.add(self.current)
            self._note_up(now_ns)
            return None
        mistake = self._watch.step(now_ns, self.current, team.members) if self._lifts else None
        if mistake is not None:
            return self._stop(mistake)
        if self._lifts and member.up and self._step is not _Step.BE_SEEN:
            self._go_to(_Step.BE_SEEN, now_ns)
        match self._step:
            case _Step.CONNECT:
                team.note_floor(now_ns)
                return self._connect(now_ns, member.connected(now_ns), member.detail)
            case _Step.LIFT_OFF:
                return self._lift_off(now_ns, progress)
            case _Step.BE_SEEN:
                return self._be_seen(now_ns, member)

    def _connect(self, now_ns: int, connected: bool, detail: str) -> TakeOffCommand | None:
        if connected and now_ns - self._ordered_ns >= self._limits.retry_s * NS_PER_S:
            self._ordered_ns, self._lifts = now_ns, True
            order = TakeOffCommand(Verb.TAKEOFF, self.current)
            self._go_to(_Step.LIFT_OFF, now_ns, keep_time=bool(self._refusal))
            return order
        if self._late(now_ns, self._limits.connect_s):
            return self._leave_out(self._refusal or detail or "its driver has no connection to it", now_ns)
        return None

    def _lift_off(self, now_ns: int, progress: Progress | None) -> TakeOffCommand | None:
        if progress is not None and progress.stage is AckStage.REFUSED:
            if progress.final:
                self.awaits.add(self.current)
                return self._leave_out(f"refused: {progress.reason}", now_ns)
            # Some reasons pass (no lease received yet, trim not done): ask again for a while.
            self._refusal, self._lifts = f"refused: {progress.reason}", False
            self._go_to(_Step.CONNECT, now_ns, keep_time=True)
            return None
        if self._late(now_ns, self._limits.lift_off_s):
            return self._leave_out("did not lift off", now_ns, land=True)
        return None

    def _be_seen(self, now_ns: int, member: Member) -> TakeOffCommand | None:
        if is_seen_in_flight(member, now_ns):
            self._note_up(now_ns)
            self._ordered_ns = now_ns  # the next one's driver must first receive this one's place
        elif self._late(now_ns, self._limits.unseen_s):
            why = why_unseen(member, now_ns, self._limits.unseen_s)
            return self._leave_out(f"{why}: it lands again", now_ns, land=True)
        return None

    def _stop(self, mistake: Mistake) -> TakeOffCommand:
        self.mistake = mistake
        flying, *others = self._waiting
        self.left_out |= {flying: mistake.text} | dict.fromkeys(others, "the take-off was stopped")
        self._waiting.clear()
        return TakeOffCommand(Verb.LAND, flying, mistake.text)

    def _leave_out(self, reason: str, now_ns: int, land: bool = False) -> TakeOffCommand | None:
        name = self._waiting.pop(0)
        self.left_out[name] = reason
        self._next(now_ns)
        return TakeOffCommand(Verb.LAND, name, reason) if land else None

    def _note_up(self, now_ns: int) -> None:
        self.up.append(self._waiting.pop(0))
        self._next(now_ns)

    def _next(self, now_ns: int) -> None:
        self._refusal, self._ordered_ns, self._lifts = "", 0, False
        self._go_to(_Step.CONNECT, now_ns)

    def _go_to(self, step: _Step, now_ns: int, keep_time: bool = False) -> None:
        self._step = step
        if not keep_time:
            self._step_ns = now_ns

    def _late(self, now_ns: int, limit_s: float) -> bool:
        return now_ns - self._step_ns >= limit_s * NS_PER_S
