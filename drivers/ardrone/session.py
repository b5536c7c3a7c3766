"""Bootstrap and configuration of the drone: all commands but REF and PCMD. Pure but for the given inquirer.

WIRE (docs/reference/ardrone.md 3, 5.1): CONFIG until state bit 6 rises, CTRL 5 until it falls, then the next key. A
CONFIG sent while bit 6 is still up is lost, therefore each key waits for the whole cycle of the one before. A late
duplicate can still raise the bit for a key that was lost: so at the end all keys are read back over the control port,
if the drone has one, and differing ones are written again, at most three times in all.
"""

from collections import deque
from collections.abc import Callable
from enum import StrEnum
from typing import Protocol

from drivers.ardrone.desired_config import FULL_NAVDATA, Ids, Wish
from drivers.ardrone.dump import differences, parse_dump
from drivers.ardrone.identity import Identity, Model, identity_from_dump, identity_from_version
from drivers.ardrone.wire import at
from drivers.ardrone.wire.at import AtCommand
from drivers.ardrone.wire.state import StateBit
from groundstation.bus.messages import Severity
from groundstation.bus.notice import Notice
from groundstation.time_units import NS_PER_MS, NS_PER_S

_REQUEST_PERIOD_NS = 100 * NS_PER_MS
_REQUEST_AFTER_NS = NS_PER_S
DISCONNECTED_NS = 2 * NS_PER_S
_STAGE_NS = NS_PER_S
_DUMP_PERIOD_NS = 300 * NS_PER_MS
# WIRE: a dump raises bit 6 as well. Its text may arrive before the packet with the bit.
_SETTLE_NS = 300 * NS_PER_MS
_ROUNDS = _ASKS = 3
_RETRY_NS = 5 * NS_PER_S
_FLAT_TRIMS = 3
# A drone may for a while report the mode that it was commanded to leave.
_FORGOTTEN_NS = NS_PER_S

_NOT_READ = Notice(
    Severity.WARNING,
    "its settings were written, but not read back: its control port (TCP 5559) gives none",
    "restart the drone if it does not keep to its limits, and look at the link",
)


class SessionPhase(StrEnum):
    """State of the session; FAILED: a required setting was not confirmed; another attempt follows."""

    SEARCHING = "SEARCHING"
    CONFIGURING = "CONFIGURING"
    VERIFYING = "VERIFYING"
    TRIMMING = "TRIMMING"
    READY = "READY"
    FAILED = "FAILED"


class _Cycle(StrEnum):
    CLEAR = "CLEAR"
    SET = "SET"
    ACKNOWLEDGE = "ACKNOWLEDGE"


class Inquirer(Protocol):
    """Queries the drone over TCP, in a thread; an answer is None while awaited, and empty if there is none.

    listening: whether the control port is connected, so that a dump can be requested.
    """

    @property
    def version(self) -> str | None:
        """Return the text of version.txt."""

    @property
    def dump(self) -> bytes | None:
        """Return the configuration dump."""

    @property
    def listening(self) -> bool:
        """Return whether a dump would be received."""

    def ask_version(self) -> None:
        """Begin to read version.txt."""

    def ask_dump(self) -> None:
        """Connect to the control port and wait for a dump."""


class ArdroneSession:
    """Brings one drone from silence to full navdata with our limits, and again when the drone forgets us.

    obeyed: whether it has acknowledged our last setting; before, it may ignore all our commands.
    """

    def __init__(
        self,
        wishes_for: Callable[[Identity, bool], tuple[Wish, ...]],
        ids: Ids,
        inquirer: Inquirer,
        flat_trim: bool = True,
        serial_needed: bool = False,
    ) -> None:
        self._wishes_for = wishes_for
        self._ids = ids
        self._inquirer = inquirer
        self._trims, self._trims_left = _FLAT_TRIMS if flat_trim else 0, 0
        self._serial_needed = serial_needed
        self._next_request_ns = self._next_dump_ns = 0
        self._stage_ns = self._began_ns = 0
        self._round = self._asks = 0
        self._with_ids = False
        self._cycle = _Cycle.CLEAR
        self._queue: deque[Wish] = deque()
        self._wanted: tuple[Wish, ...] = ()
        self._doubtful: set[Wish] = set()
        self._problem = self._told = ""
        self._full_ns = 0
        self.identity = Identity()
        self.phase = SessionPhase.SEARCHING
        self.obeyed = False
        self.news: deque[Notice] = deque(maxlen=32)

    @property
    def detail(self) -> str:
        """Return the awaited or missing step, or ""."""
        match self.phase:
            case SessionPhase.SEARCHING:
                return "waiting for navdata"
            case SessionPhase.CONFIGURING:
                return f"configuring {self._queue[0].key}" if self._queue else "asking for the firmware's version"
            case SessionPhase.VERIFYING:
                return "reading the configuration back"
            case SessionPhase.TRIMMING:
                return "waits until it stands still and level"
            case _:
                return self._problem

    def request_due(self, now_ns: int, silence_ns: int) -> bool:
        """Return whether to request navdata now: every 100 ms while there is none."""
        silent = self.phase is SessionPhase.SEARCHING or silence_ns > _REQUEST_AFTER_NS
        if not silent or now_ns < self._next_request_ns:
            return False
        self._next_request_ns = now_ns + _REQUEST_PERIOD_NS
        return True

    def step(
        self, now_ns: int, state: int, silence_ns: int, seen: Model = Model.UNKNOWN, still: bool = True
    ) -> list[AtCommand]:
        """Return the commands to add to the next datagram.

        state, silence_ns: the newest state word and its age; seen: the generation by navdata, if known; still: whether
        it stands still and level.
        """
        if silence_ns > DISCONNECTED_NS:
            self.phase, self.obeyed = SessionPhase.SEARCHING, False
            return []
        if self._must_begin(now_ns, state):
            self._begin(now_ns)
        pending = bool(state & StateBit.COMMAND)
        if self.phase is SessionPhase.CONFIGURING:
            return self._configure(now_ns, pending, seen)
        if self.phase is SessionPhase.VERIFYING:
            return self._verify(now_ns, pending)
        if pending:
            return [at.ctrl(at.CTRL_ACK)]  # a late duplicate raised the bit
        return self._trim(state, still) if self.phase is SessionPhase.TRIMMING else []

    def _must_begin(self, now_ns: int, state: int) -> bool:
        if not state & (StateBit.NAVDATA_BOOTSTRAP | StateBit.NAVDATA_DEMO):
            self._full_ns = now_ns
        forgotten = now_ns - self._full_ns > _FORGOTTEN_NS
        match self.phase:
            case SessionPhase.SEARCHING:
                return True
            case SessionPhase.FAILED:
                return now_ns - self._stage_ns > _RETRY_NS
            case SessionPhase.CONFIGURING:
                return forgotten and bool(self._wanted)  # it left the bootstrap earlier, and is back in it
            case _:
                return forgotten

    def _begin(self, now_ns: int) -> None:
        self.phase, self._problem, self.obeyed = SessionPhase.CONFIGURING, "", False
        self._began_ns = self._full_ns = now_ns
        self._round = 0
        self._trims_left = self._trims
        self._wanted = ()
        self._doubtful.clear()
        self._queue = deque([FULL_NAVDATA])
        self._with_ids = False
        self.identity = Identity()
        self._inquirer.ask_version()
        self._enter(_Cycle.CLEAR, now_ns)

    def _enter(self, cycle: _Cycle, now_ns: int) -> None:
        self._cycle, self._stage_ns = cycle, now_ns

    # -- writing ------------------------------------------------------------------------------------------------------

    def _configure(self, now_ns: int, pending: bool, seen: Model) -> list[AtCommand]:
        if not self._queue and not self._find_out(now_ns, seen):
            return []
        late = now_ns - self._stage_ns > _STAGE_NS
        if self._cycle is _Cycle.CLEAR and not pending:
            self._enter(_Cycle.SET, now_ns)
        elif self._cycle is _Cycle.SET and (pending or late):
            self.obeyed = not late
            if late:
                self._doubtful.add(self._queue[0])
            self._enter(_Cycle.ACKNOWLEDGE, now_ns)
        elif self._cycle is _Cycle.ACKNOWLEDGE and not pending:
            self._queue.popleft()
            self._enter(_Cycle.CLEAR, now_ns)
            return (
                self._configure(now_ns, pending, seen) if self._queue or not self._wanted else self._read_back(now_ns)
            )
        elif late:
            self._fail(now_ns, f"the drone does not take back its acknowledgement of {self._queue[0].key}")
            return []
        return self._write(self._queue[0]) if self._cycle is _Cycle.SET else [at.ctrl(at.CTRL_ACK)]

    def _write(self, wish: Wish) -> list[AtCommand]:
        # WIRE: CONFIG_IDS goes right before each CONFIG, in the same datagram.
        ids = [at.config_ids(*self._ids)] if self._with_ids else []
        return [*ids, at.config(wish.key, wish.value)]

    def _find_out(self, now_ns: int, seen: Model) -> bool:
        """Choose the settings to write once the firmware is known, or will stay unknown; returns whether that is so."""
        version = self._inquirer.version
        if version is None:
            return False
        identity = identity_from_version(version)
        if identity.model is Model.UNKNOWN:
            identity = Identity(seen)
        self._want(identity, identity.has_ids)
        self._queue = deque(self._wanted)
        self._enter(_Cycle.CLEAR, now_ns)
        return True

    def _want(self, identity: Identity, with_ids: bool) -> None:
        self.identity, self._with_ids = identity, with_ids
        self._wanted = (FULL_NAVDATA, *self._wishes_for(identity, with_ids))

    # -- reading back -------------------------------------------------------------------------------------------------

    def _read_back(self, now_ns: int) -> list[AtCommand]:
        self.phase = SessionPhase.VERIFYING
        self._round += 1
        self._asks = 0
        self._ask(now_ns)
        return []

    def _ask(self, now_ns: int) -> None:
        self._asks += 1
        self._next_dump_ns, self._stage_ns = 0, now_ns
        self._inquirer.ask_dump()

    def _verify(self, now_ns: int, pending: bool) -> list[AtCommand]:
        dump = self._inquirer.dump
        if dump is None:
            if not self._inquirer.listening or now_ns < self._next_dump_ns:
                return []
            self._next_dump_ns, self._stage_ns = now_ns + _DUMP_PERIOD_NS, now_ns
            return [at.ctrl(at.CTRL_CONFIG_GET)]
        asked_ns = now_ns - self._stage_ns
        if (dump and asked_ns < _SETTLE_NS) or (pending and asked_ns < 2 * _STAGE_NS):
            return [at.ctrl(at.CTRL_ACK)]
        if dump or self._asks == _ASKS:
            self._judge(now_ns, parse_dump(dump))
        else:
            self._ask(now_ns)
        return []

    def _trim(self, state: int, still: bool) -> list[AtCommand]:
        if self._trims_left and not state & StateBit.FLY:
            if not still:
                return []  # in somebody's hands its tilt would be taken for level
            self._trims_left -= 1  # several times, since datagrams get lost without acknowledgement
            return [at.ftrim()]
        self.phase = SessionPhase.READY
        return []

    def _judge(self, now_ns: int, stored: dict[str, str]) -> None:
        """Write missing settings again, give up, or accept the result."""
        if stored:
            told = identity_from_dump(stored)
            self.identity = told if told.firmware or self.identity.model is Model.UNKNOWN else self.identity
            differing = dict(differences(((wish.key, wish.value) for wish in self._wanted), stored))
            wrong = {wish: differing[wish[:2]] for wish in self._wanted if wish[:2] in differing}
        else:
            wrong = dict.fromkeys(self._doubtful, "not known")
        required = [wish for wish in wrong if wish.required]
        if wrong and self._round < _ROUNDS:
            if any(wish.key.startswith("custom:") for wish in wrong):
                self._want(self.identity, with_ids=False)  # it keeps no sets: keys written for a set were ignored
                self._queue = deque(self._wanted)
            else:
                self._queue = deque(wish for wish in self._wanted if wish in wrong)
            self._doubtful.clear()
            self.phase = SessionPhase.CONFIGURING
            self._enter(_Cycle.CLEAR, now_ns)
        elif required:
            wish = required[0]
            self._fail(now_ns, f"{wish.key} is {wrong[wish]} on the drone, and {wish.value} was written")
        elif self._serial_needed and not self.identity.serial:
            self._fail(now_ns, "its serial number was not read")
        else:
            self.phase = SessionPhase.TRIMMING
            self.news.extend(() if stored else (_NOT_READ,))
            self._confirm(now_ns, wrong)

    def _confirm(self, now_ns: int, wrong: dict[Wish, str]) -> None:
        elapsed_s = (now_ns - self._began_ns) * 1e-9
        self.news.append(Notice(Severity.INFO, f"{self.identity.text}: configured in {elapsed_s:.1f} s"))
        for wish, stored in wrong.items():
            self.news.append(Notice(Severity.WARNING, f"{wish.key} stays {stored}, though {wish.value} was written"))

    def _fail(self, now_ns: int, problem: str) -> None:
        if problem != self._told:
            remedy = "restart the drone, and see that no other program speaks to it"
            self.news.append(Notice(Severity.ERROR, f"not configured: {problem}", remedy))
        self.phase, self._stage_ns, self.obeyed = SessionPhase.FAILED, now_ns, False
        self._problem = self._told = problem
