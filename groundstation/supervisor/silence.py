"""Decides who sends to a drone whose driver is silent, and which command. Pure: signs of life in, commands out.

Precedence: the driver; the supervisor; the guardian. Both substitutes derive their commands from the driver's last beat
alone, so that they agree whenever they overlap. Proof: tests/property/test_somebody_speaks.py.
"""

from dataclasses import dataclass
from enum import Enum

from groundstation.process.heartbeat import HeartbeatBlock, SlotState
from groundstation.time_units import NS_PER_MS, NS_PER_S

# Driver and supervisor count as silent after this. It is shorter than the supervisor's limit for drivers (0.4 s), else
# the guardian would come too late.
SILENCE_NS = 300 * NS_PER_MS
# By then the supervisor has sent (0.4 s, and its turn), unless it has just woken up itself.
OVERDUE_NS = 450 * NS_PER_MS
# The supervisor's limit for a hanging driver: one replaced for this long must not come back and contradict.
HANG_NS = 800 * NS_PER_MS
# The watchdog's limit: without a supervisor that could take over again, hovering has no purpose.
BRAKE_NS = NS_PER_S


class FailsafeCommand(Enum):
    """The command for a drone without driver."""

    NONE = 0
    HOVER = 1
    LAND = 2


class SupervisorState(Enum):
    """Whether the supervisor sends for silent drivers: SPEAKS does; not while it STOPS the run, nor FROZEN or DEAD."""

    SPEAKS = 0
    STOPS = 1
    FROZEN = 2
    DEAD = 3


@dataclass(frozen=True, slots=True)
class SupervisorSigns:
    """Signs of life of the supervisor: its last beat, whether it lives, whether it stops the run."""

    beat_ns: int
    alive: bool = True
    stops: bool = False

    def state(self, now_ns: int) -> SupervisorState:
        """Return its present state."""
        if not self.alive:
            return SupervisorState.DEAD
        if now_ns - self.beat_ns >= SILENCE_NS:
            return SupervisorState.FROZEN
        return SupervisorState.STOPS if self.stops else SupervisorState.SPEAKS


@dataclass(frozen=True, slots=True)
class DriverSigns:
    """Signs of life of a driver's process: its slot of the heartbeat block, and whether the kernel still has it.

    worked: it finished its start once; ended: it reported that its work is done; gone: it is dead.
    """

    state: SlotState = SlotState.EMPTY
    beat_ns: int = 0
    worked: bool = False
    ended: bool = False
    gone: bool = False

    @property
    def driving(self) -> bool:
        """Return whether it controls the drone: it finished its start, and is neither ending nor dead."""
        return self.state in (SlotState.READY, SlotState.DEGRADED) and not self.ended and not self.gone

    def heard_silent_ns(self, now_ns: int, awake_since_ns: int) -> int:
        """Return how long it was silent while the listener was awake [ns]."""
        return max(0, now_ns - max(self.beat_ns, awake_since_ns))


def signs_of(block: HeartbeatBlock, slot: int, *, gone: bool = False) -> DriverSigns:
    """Return the signs of life in a slot; gone: the kernel reports that its process is dead."""
    return DriverSigns(block.state(slot), block.beat_ns(slot), block.has_worked(slot), block.has_ended(slot), gone)


def silent_since(signs: DriverSigns, before_ns: int, now_ns: int, awake_since_ns: int, limit_ns: int) -> int:
    """Return since when a drone has been without its driver [ns]; 0 if it has one, had none or needs none any more.

    before_ns: the same as last recorded; only a driver that finished its start resets it.
    """
    if not signs.worked:
        return before_ns
    if signs.ended:
        return 0
    if signs.driving:
        if now_ns - signs.beat_ns < limit_ns:
            return 0
        if signs.heard_silent_ns(now_ns, awake_since_ns) < limit_ns:
            return before_ns
    return before_ns or signs.beat_ns


def command_at(since_ns: int, now_ns: int, land_after_s: float) -> FailsafeCommand:
    """Return the command for a drone without a driver since a time (0: it has one)."""
    if not since_ns:
        return FailsafeCommand.NONE
    return FailsafeCommand.LAND if now_ns - since_ns >= land_after_s * NS_PER_S else FailsafeCommand.HOVER


@dataclass(frozen=True, slots=True)
class GuardDecision:
    """The guardian's decision for one drone.

    since_ns: to be recorded, if the guardian sends; kill: the driver hangs, and nobody else kills it; settled: the
    drone no longer needs a guardian.
    """

    command: FailsafeCommand
    since_ns: int
    kill: bool
    settled: bool


class Guard:
    """The guardian's rule for one drone; remembers only since when anybody has sent LAND."""

    def __init__(self, land_after_s: float, landing_s: float) -> None:
        self._land_after_s, self._landing_s = land_after_s, landing_s
        # LAND comes earlier by this when a live driver would also land earlier.
        self._earlier_ns = max(0, round(land_after_s * NS_PER_S) - BRAKE_NS)
        self._land_since_ns = 0

    def step(
        self, now_ns: int, signs: DriverSigns, before_ns: int, supervisor: SupervisorSigns, awake_since_ns: int
    ) -> GuardDecision:
        """Return the action now; before_ns: recorded time since which others send for the driver."""
        state = supervisor.state(now_ns)
        heard_silent_ns = signs.heard_silent_ns(now_ns, awake_since_ns)
        overdue = signs.driving and not before_ns and heard_silent_ns >= OVERDUE_NS
        supervised = state is SupervisorState.SPEAKS and not overdue
        since_ns = before_ns
        if not supervised:
            since_ns = silent_since(signs, before_ns, now_ns, awake_since_ns, SILENCE_NS)
            since_ns = since_ns and self._as_driver_would(since_ns, before_ns, supervisor.beat_ns, state)
        command = command_at(since_ns, now_ns, self._land_after_s)
        self._land_since_ns = (self._land_since_ns or now_ns) if command is FailsafeCommand.LAND else 0
        landed = command is FailsafeCommand.LAND and now_ns - self._land_since_ns >= self._landing_s * NS_PER_S
        # Before LAND is sent, a hanging driver is killed: it might wake up and take LAND back.
        hangs = heard_silent_ns >= HANG_NS or command is FailsafeCommand.LAND
        lost = state in (SupervisorState.FROZEN, SupervisorState.DEAD)
        return GuardDecision(
            command=FailsafeCommand.NONE if supervised else command,
            since_ns=since_ns,
            kill=lost and bool(since_ns) and signs.driving and hangs,
            settled=landed or (not since_ns and not signs.driving),
        )

    def _as_driver_would(self, since_ns: int, before_ns: int, supervisor_ns: int, state: SupervisorState) -> int:
        """Return the time that leads to LAND when a live driver would have landed because of the supervisor's silence.

        So a driver that dies while it lands for that reason is not followed by hover.
        """
        match state:
            case SupervisorState.DEAD:
                return max(1, min(since_ns, supervisor_ns - self._earlier_ns))
            case SupervisorState.FROZEN:
                return max(1, min(since_ns, supervisor_ns))
            case SupervisorState.STOPS:
                return before_ns or max(1, since_ns - self._earlier_ns)
            case SupervisorState.SPEAKS:
                return since_ns
