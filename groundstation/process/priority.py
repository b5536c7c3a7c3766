"""Real-time priority for loops with deadlines, a larger share for processes that others wait for, if permitted."""

import os
import time
from contextlib import suppress
from enum import IntEnum
from pathlib import Path

LARGEST = -5  # of flight processes; emulators can have more (docs/decisions/0137)
_AUTOGROUP = Path("/proc/self/autogroup")
_TURNS, _TURN_S = 40, 0.05  # the kernel lets ordinary users change one session each 0.1 s, all of them together


class Rank(IntEnum):
    """The lowest real-time priorities: ahead of ordinary threads, behind all that the system itself runs in real time.

    TICK: milliseconds of work, many times a second; PLAN: tens of milliseconds, and ticks go before it.
    """

    PLAN = 1
    TICK = 2


def go_first(rank: Rank = Rank.TICK, *, heirs: bool = False) -> bool:
    """Put the calling thread, and with `heirs` all that it starts, ahead of ordinary ones; returns whether it may.

    For loops that work a small share of each period and then sleep, senders, tracker, simulator; and for stops.
    It needs CAP_SYS_NICE or `ulimit -r`; without it the thread runs like all others. The kernel keeps 5 % of each core
    for ordinary threads.
    """
    with suppress(OSError):
        policy = os.SCHED_RR if heirs else os.SCHED_RR | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(rank))
        return True
    return False


def take_share(nice: int = LARGEST) -> bool:
    """Give this thread and all that it starts from now on a share of the processor: a larger one for nice below 0.

    A large one is for processes that others wait for and that never compute for long (docs/decisions/0137). Returns
    whether it is allowed. If not, all others than LARGEST take less instead, so that the proportions hold. Linux shares
    the processor out by session first (autogroup), and nice acts within one: a session of its own gets both.
    """
    own_session = os.getsid(0) == os.getpid()
    with suppress(OSError):
        if _may_have_more():
            _set(nice, own_session)
            return True
        if own_session and nice > LARGEST:
            _set(nice - LARGEST, own_session)
    return False


def _may_have_more() -> bool:
    """Take the largest share, if permitted; return whether it is."""
    try:
        os.setpriority(os.PRIO_PROCESS, 0, LARGEST)
    except PermissionError:
        return False
    return True


def _set(nice: int, own_session: bool) -> None:
    with suppress(PermissionError):  # its share was smaller at the start
        os.setpriority(os.PRIO_PROCESS, 0, nice)
    for _ in range(_TURNS if own_session and _AUTOGROUP.exists() else 0):
        with suppress(BlockingIOError):
            _AUTOGROUP.write_text(str(nice))
            break
        time.sleep(_TURN_S)


def go_back() -> None:
    """Undo both for the calling thread."""
    with suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        take_share(0)
