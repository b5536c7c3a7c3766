"""Loops with deadlines go first, and what all wait for gets a larger share, where the system lets them."""

import os
from contextlib import suppress
from enum import IntEnum
from pathlib import Path


class Rank(IntEnum):
    """The lowest real-time priorities: ahead of ordinary threads, behind all that the system itself runs in real time.

    TICK: milliseconds of work, many times a second; PLAN: tens of milliseconds, and ticks go before it.
    """

    PLAN = 1
    TICK = 2


def go_first(rank: Rank = Rank.TICK) -> bool:
    """Put the calling thread, not those it starts, ahead of ordinary ones; returns whether that is allowed.

    For loops that work a small share of each period and then sleep: senders, tracker, simulator.
    It needs CAP_SYS_NICE or `ulimit -r`; without it the thread runs like all others. The kernel keeps 5 % of each core
    for ordinary threads.
    """
    with suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_RR | os.SCHED_RESET_ON_FORK, os.sched_param(rank))
        return True
    return False


def take_larger_share(nice: int = -10) -> bool:
    """Let this process, with all threads that it starts from now on, have more of the processor than ordinary ones.

    For what others wait for and that never computes for long (docs/decisions/0137). Returns whether that is allowed.
    Linux shares the processor out by session first (autogroup), and nice acts within one: a session of its own gets
    both.
    """
    with suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, nice)
        if os.getsid(0) == os.getpid():
            with suppress(FileNotFoundError):  # a kernel without it
                Path("/proc/self/autogroup").write_text(str(nice))
        return True
    return False
