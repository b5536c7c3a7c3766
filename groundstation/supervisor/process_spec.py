"""A row of the process table: entry, permitted silence, and place in the shut-down of one process."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum, StrEnum

from groundstation.process.heartbeat import SUPERVISOR_SLOT


class Restart(StrEnum):
    """The consequence of a process's end for the run."""

    ALWAYS = "ALWAYS"
    ENDS_RUN = "ENDS_RUN"


class StopOrder(IntEnum):
    """Shut-down goes through these in order; within one, processes stop together.

    `start.py` starts those from CONNECTS on first, because all others communicate through them.
    """

    DECIDES = 0
    DRIVES = 1
    EMULATES = 2
    RECORDS = 3
    CONNECTS = 4
    GUARDS = 5


@dataclass(frozen=True, slots=True)
class FailsafeDatagrams:
    """Datagrams of supervisor or guardian for a drone whose driver died or hangs, in the drone's own protocol.

    hover is repeated until the driver is READY again; land_after_s after its last beat it is land instead. transport:
    "module:function" that makes their transport from `way` and a sender's number, "" for UDP. called: whether vehicles
    call the driver, so that their address is that of their last datagram. interface: network adapter of plain UDP, ""
    for any.
    """

    address: str
    port: int
    hover: bytes
    land: bytes
    land_after_s: float = 3.0
    transport: str = ""
    way: str = ""
    called: bool = False
    interface: str = ""


@dataclass(frozen=True, slots=True)
class ProcessSpec:
    """One process of the table.

    entry: "module:function" run with a Child, or else command: an argument list in which "{spec}" becomes the path of a
    JSON file holding section plus "child". numbered: each start gets a higher "epoch" in its section. silence_limit_s:
    an older heartbeat starts its failsafe datagrams; hang_limit_s: then it is killed (both after READY).
    restart_delay_s: pause before even the first restart. required: the run cannot start without it. awaited: a start
    waits for it, if only for a moment. on_terminal: it writes to the operator's terminal. entities: the vehicles or
    camera of a device. kernels: it uses compiled kernels, which are made before anything starts. nice: its share of the
    processor (docs/decisions/0137). shows_end: it stays until the run is judged (docs/decisions/0152). at_most_hz: by
    key, how many samples a second are enough for it (docs/decisions/0169). guest: another package's code that runs in
    it, and may keep it from its heartbeat.
    """

    name: str
    role: str
    entry: str = ""
    command: tuple[str, ...] = ()
    section: str = "{}"
    numbered: bool = False
    restart: Restart = Restart.ALWAYS
    restart_delay_s: float = 0.0
    required: bool = True
    awaited: bool = True
    silence_limit_s: float = 0.4
    hang_limit_s: float = 0.8
    start_limit_s: float = 60.0
    stop_order: StopOrder = StopOrder.DRIVES
    stop_limit_s: float = 3.0
    failsafe_datagrams: FailsafeDatagrams | None = None
    on_bus: bool = True
    on_terminal: bool = False
    keep_open: tuple[int, ...] = ()
    entities: tuple[str, ...] = ()
    kernels: bool = False
    nice: int = 0
    shows_end: bool = False
    guest: str = ""
    at_most_hz: Mapping[str, float] = field(default_factory=dict)

    @property
    def suspect(self) -> str:
        """Return the words that name its guest after the report of a hang, "" without one."""
        return f"; {self.guest} runs in it" if self.guest else ""

    @property
    def is_router(self) -> bool:
        """Return whether it is the router."""
        return self.stop_order is StopOrder.CONNECTS


def slot_of(index: int) -> int:
    """Return the heartbeat slot of the row at an index of the table."""
    return SUPERVISOR_SLOT + 1 + index
