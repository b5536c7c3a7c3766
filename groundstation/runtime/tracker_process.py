"""The tracker process. Started as `groundstation.runtime.tracker_process:run`.

Bus callbacks only enqueue; one loop ticks at the estimator's rate; one worker thread plans. Numba, and all that needs
it, is imported only after the kernel cache is chosen.
"""

from __future__ import annotations

import gc
import sys
from typing import TYPE_CHECKING

import msgspec

from groundstation.bus import clock
from groundstation.errors import GroundStationError
from groundstation.process import numba_cache
from groundstation.process.child import Child
from groundstation.process.priority import go_first
from groundstation.runtime.compile_kernels import compile_kernels
from groundstation.runtime.deadlines import Deadlines
from groundstation.time_units import NS_PER_S

if TYPE_CHECKING:
    from groundstation.runtime.tracker_loop import Tracking

_SWITCH_INTERVAL_S = 0.001  # how long the planner's thread may keep the interpreter from a tick that is due


def run(child: Child) -> int:
    """Run the tracker until it is stopped or its supervisor is gone; returns the exit code."""
    cache = numba_cache.activate()
    if numba_cache.is_complete(cache):
        child.starting("loading kernels")
    else:
        child.starting("compiling kernels (once per version, a minute or two)")
        compile_kernels(cache)
    from groundstation.runtime.tracker_loop import TrackerSection, Tracking
    from groundstation.runtime.warm_up import warm_up

    try:
        section = msgspec.json.decode(child.section, type=TrackerSection)
    except msgspec.DecodeError as error:
        raise GroundStationError(f"the tracker's section is malformed: {error}") from error
    warm_up(section.field)
    tracking = Tracking(child.bus, section)
    sys.setswitchinterval(_SWITCH_INTERVAL_S)
    gc.collect()
    gc.freeze()
    try:
        _loop(child, tracking)
    finally:
        tracking.close()
    return 0


def _loop(child: Child, tracking: Tracking) -> None:
    from groundstation.runtime.moved_cameras import MovedCameras

    period_ns = NS_PER_S // tracking.rate_hz
    deadlines = Deadlines(period_ns, clock.now_ns())
    moved = MovedCameras(child, tracking.tracker.mounts)
    tracking.notices += moved.recall(clock.now_ns())
    child.ready()
    go_first()
    while not child.stop_requested and child.supervisor_alive:
        now_ns = clock.now_ns()
        deadlines.start_tick(now_ns)
        child.beat()
        tracking.tick(now_ns)
        moved.note()
        for notice in tracking.notices:
            child.event(notice.severity, notice.text, notice.remedy, notice.entity or None)
        tracking.notices.clear()
        child.tick_status(deadlines.ticks, deadlines.overruns, tracking.inbox.overflowed)
        child.sleep_until(deadlines.next_ns)
