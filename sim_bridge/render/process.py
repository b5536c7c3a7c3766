"""One process per emulated camera: truth in by shared memory, pictures out over the network."""

import math
import os
import signal
import threading
import time
from collections.abc import MutableSequence, Sequence
from multiprocessing.connection import Connection
from types import FrameType

import cv2
import numpy as np

from groundstation.arrays import Array
from groundstation.time_units import NS_PER_MS, NS_PER_S
from sim_bridge.render.outputs import Output, open_output
from sim_bridge.render.spec import Outage, OutageKind, RenderSpec
from sim_bridge.truth import TruthBoard

_IDLE_S = 0.2
# TCP: lost data are sent again after a time-out, at least 200 ms on Linux (RFC 6298 asks for more), and later data
# wait for them.
_REPEATED_AFTER_MS = 200.0


def run(spec: RenderSpec, modes: Connection | None = None, tally: MutableSequence[int] | None = None) -> int:
    """Render and serve until SIGTERM or until the parent has gone; returns the exit code.

    modes: the vehicle's settings of its own video, as they change; tally: see _Exposures.
    """
    stop: list[int] = []
    _obey_signals(stop)
    cv2.setNumThreads(1)
    truth = TruthBoard.attach(spec.truth_name, spec.bodies)
    output = open_output(spec, modes)
    try:
        _Exposures(spec, truth, output, [0, 0] if tally is None else tally).run(stop)
    finally:
        output.close()
        truth.close()
    return 0


def _obey_signals(stop: list[int]) -> None:
    """Note SIGTERM in a list: an Event waits for a lock that the interrupted loop may hold."""

    def request_stop(number: int, _frame: FrameType | None) -> None:
        stop.append(number)

    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, request_stop)
        signal.signal(signal.SIGINT, signal.SIG_IGN)


class FrameDelay:
    """Delay, jitter and loss of frames on the network; their order is kept.

    Where lost frames are sent again, none is missing: they come late, and so do those that wait behind them.
    """

    def __init__(self, spec: RenderSpec) -> None:
        self._scenario = spec.scenario
        self._repeats = spec.own is not None and spec.own.repeats
        self._random = np.random.default_rng([spec.seed, 7, *spec.camera.encode()])
        self._last_ns = 0

    def release_ns(self, exposure_ns: int, held_until_ns: int = 0) -> int | None:
        """Return when a frame arrives that the link holds back until a time, or None when it is lost."""
        lost = self._random.random() < self._scenario.frame_loss
        jitter_ms = self._random.uniform(-1.0, 1.0) * self._scenario.video_jitter_ms
        if lost and not self._repeats:
            return None
        delay_ms = max(0.0, self._scenario.video_delay_ms + jitter_ms) + lost * _REPEATED_AFTER_MS
        self._last_ns = max(self._last_ns, exposure_ns + round(delay_ms * NS_PER_MS), held_until_ns)
        return self._last_ns


def active_outage(outages: tuple[Outage, ...], seconds: float) -> OutageKind | None:
    """Return the stream's failure at a time since the first true state, if any; a cut goes first, a stall last."""
    return min((one.kind for one in _active(outages, seconds)), default=None)


def held_until_s(outages: tuple[Outage, ...], seconds: float) -> float:
    """Return until when what is sent at a time is held back [s since the first true state]; 0: it is not."""
    ends = (one.end_s for one in _active(outages, seconds) if one.kind is OutageKind.HELD_BACK)
    return max((end for end in ends if end is not None), default=0.0)


def _active(outages: tuple[Outage, ...], seconds: float) -> list[Outage]:
    return [one for one in outages if one.start_s <= seconds and (one.end_s is None or seconds < one.end_s)]


class _Exposures:
    """The camera's loop: exposures on an absolute schedule.

    tally: counts the pictures, and those among them that were not ready when they should have arrived.
    """

    def __init__(self, spec: RenderSpec, truth: TruthBoard, output: Output, tally: MutableSequence[int]) -> None:
        self._spec, self._truth, self._output, self._tally = spec, truth, output, tally
        self._link = FrameDelay(spec)
        self._first_ns = 0
        self._last_ns = 0

    def run(self, stop: Sequence[int]) -> None:
        """Expose until something stands in `stop`."""
        period_ns = round(NS_PER_S / self._spec.scenario.fps)
        next_ns = time.monotonic_ns()
        while not stop and self._parent_lives():
            wait_s = (next_ns - time.monotonic_ns()) / NS_PER_S
            if wait_s > 0.0:
                time.sleep(min(wait_s, _IDLE_S))
                continue
            self._expose()
            next_ns += period_ns
            if time.monotonic_ns() - next_ns > NS_PER_S:  # frozen for a while: missed exposures are not repeated
                next_ns = time.monotonic_ns()

    def _parent_lives(self) -> bool:
        return self._spec.parent_pid in (0, os.getppid())

    def _expose(self) -> None:
        exposure_ns, states = self._truth.read()
        if exposure_ns in (0, self._last_ns):  # nothing true yet, or the world stands still: no new picture
            return
        self._first_ns = self._first_ns or exposure_ns
        self._last_ns = exposure_ns
        now_s = (exposure_ns - self._first_ns) / NS_PER_S
        outages = self._spec.scenario.outages
        outage = active_outage(outages, now_s)
        self._output.set_accepting(outage is not OutageKind.CUT)
        held_until_ns = self._first_ns + round(held_until_s(outages, now_s) * NS_PER_S)
        release_ns = self._link.release_ns(exposure_ns, held_until_ns)
        if (
            release_ns is None
            or outage in (OutageKind.CUT, OutageKind.STALL)
            or not self._output.clients
            or self._is_nowhere(states)
        ):
            return
        self._output.show(states, exposure_ns, release_ns, now_s)
        self._tally[1] += time.monotonic_ns() > release_ns
        self._tally[0] += 1

    def _is_nowhere(self, states: Array) -> bool:
        carrier = self._spec.mount.body
        return bool(carrier) and math.isnan(states[self._spec.bodies.index(carrier), 0])
