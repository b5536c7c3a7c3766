"""Loops with deadlines go first: the calling thread runs ahead of ordinary ones, where the system lets it."""

import os
from contextlib import suppress
from enum import IntEnum


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
