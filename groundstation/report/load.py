"""The load of a run: CPU, deadlines, planner time, lost messages."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array
from groundstation.report.accuracy import STALE_S
from groundstation.report.certainty import longest_s
from groundstation.report.interval import Span, flight_spans, within
from groundstation.report.tracks import ProcessTrack, RunData

TRACKER = "tracker"
_PID, _TICKS, _OVERRUNS, _OVERFLOWED = range(4)
# Share of a second waited, and cores that others used. Alone on a computer of two cores, nobody waits for more than a
# tenth of a second; other programs use 0.1. Whoever hardly ran at all was kept from it by less than half a core.
_STARVED = ((0.3, 0.5), (0.9, 0.3))


def cpu_cores(data: RunData) -> dict[str, float]:
    """Return mean cores used per process over the whole run (a process that ran half of it counts half)."""
    if not data.processes:
        return {}
    first = min(float(track.time_s[0]) for track in data.processes.values())
    last = max(float(track.time_s[-1]) for track in data.processes.values())
    span = max(last - first, 1e-9)
    # Each status covers the time since the previous one.
    return {
        name: float(np.sum(track.cpu[1:] * np.diff(track.time_s)) / span)
        for name, track in sorted(data.processes.items())
    }


def _steps(counters: Array, column: int) -> Array:
    """Return the rises of a counter since the status before (n); at restarts it begins at zero again."""
    values, pids = counters[:, column], counters[:, _PID]
    rises = np.where(pids[1:] == pids[:-1], np.diff(values), values[1:])
    return np.concatenate((values[:1], np.maximum(rises, 0.0)))


def _rise(counters: Array, column: int) -> float:
    return float(_steps(counters, column).sum())


def tracker_deadlines(data: RunData) -> tuple[int, int, float | None]:
    """Return the tracker's ticks, missed deadlines, and tick rate [Hz] while it ticked (None if it never did).

    They are those of the flights: on the floor it has little to do.
    """
    track, spans = data.processes.get(TRACKER), flight_spans(data)
    if track is None:
        return 0, 0, None
    counted = within(track.time_s, spans)
    ticks, missed = (int(_steps(track.counters, column)[counted].sum()) for column in (_TICKS, _OVERRUNS))
    return ticks, missed, _rate(track, spans)


def _rate(track: ProcessTrack, spans: Sequence[Span]) -> float | None:
    ticking = track.counters[:, _TICKS] > 0
    times, counters = track.time_s[ticking], track.counters[ticking]
    counted = within(times, spans)[1:]  # each status covers the time since the previous one
    if not counted.any():
        return None
    return float(_steps(counters, _TICKS)[1:][counted].sum() / max(np.diff(times)[counted].sum(), 1e-9))


def overflowed(data: RunData) -> dict[str, int]:
    """Return messages lost in queues, for the processes that lost any."""
    lost = {name: int(_rise(track.counters, _OVERFLOWED)) for name, track in data.processes.items()}
    return {name: count for name, count in sorted(lost.items()) if count}


def sim_overrun_percent(data: RunData) -> float | None:
    """Return late ticks of the simulator in percent, or late pictures if that is more; None without a simulator."""
    if data.sim_counters is None:
        return None
    ticks, overruns, pictures, late = data.sim_counters[-1]
    return float(100.0 * max(overruns / max(ticks, 1.0), late / max(pictures, 1.0)))


def starved_s(data: RunData, start_s: float, end_s: float) -> float:
    """Return for how long a process waited for a core while other programs of the computer used them [s]."""
    seconds = np.arange(start_s, end_s)
    waited, others = np.zeros(len(seconds)), np.zeros(len(seconds))
    for track in data.processes.values():
        status = np.searchsorted(track.time_s, seconds)  # each covers the time before it; behind the last: nothing
        waited = np.fmax(waited, np.append(track.waited, 0.0)[status])
        others = np.fmax(others, np.append(track.others_cpu, 0.0)[status])
    starved = [(waited >= share) & (others >= cores) for share, cores in _STARVED]
    return float(np.count_nonzero(np.any(starved, axis=0)))


def waited(data: RunData, start_s: float, end_s: float) -> dict[str, float]:
    """Return the share of a time for which each process waited for a core; only for processes that report it."""
    shares: dict[str, float] = {}
    for name, track in sorted(data.processes.items()):
        during = track.waited[(track.time_s > start_s) & (track.time_s <= end_s)]
        if len(during):
            shares[name] = float(np.mean(during))
    return shares


def planner_ms(data: RunData) -> tuple[float, float] | None:
    """Return median and 99th percentile of the planner's time in flight [ms]; None if it planned nothing there."""
    flown = within(np.array([plan.time_s for plan in data.plans]), flight_spans(data))
    if not flown.any():
        return None
    seconds = np.array([plan.message.solver.seconds for plan in data.plans])[flown]
    median, high = np.percentile(seconds, [50, 99])
    return float(median * 1000), float(high * 1000)


def unplanned_s(data: RunData, time_s: Array) -> float | None:
    """Return for how long at most every plan was too old to be flown while the tracker lived, at 10 Hz [s].

    None where it told nothing of anybody. Without a tracker drones hover as well, and that is reported otherwise.
    """
    lives = np.zeros(len(time_s), dtype=bool)
    for track in data.certainties.values():
        lives |= _age_s(track.time_s, time_s) <= STALE_S
    if not lives.any():
        return None
    old = _age_s(np.array([plan.time_s for plan in data.plans]), time_s) > data.resolved.planner.max_plan_age_s
    return longest_s(lives & old)


def _age_s(told_s: Array, time_s: Array) -> Array:
    """Return for each time that since the newest of what was told (m) [s]; infinite before the first."""
    index = np.searchsorted(told_s, time_s, side="right")
    age_s: Array = time_s - np.concatenate(([-np.inf], told_s))[index]
    return age_s


@dataclass(frozen=True, slots=True)
class ProcessLoad:
    """One process over a run: mean cores, ticks, missed deadlines, messages lost in its queues, restarts."""

    name: str
    cores: float
    ticks: int
    missed: int
    overflowed: int
    restarts: int


def process_loads(data: RunData) -> list[ProcessLoad]:
    """Return every process, the busiest first."""
    cores = cpu_cores(data)
    found = [
        ProcessLoad(
            name,
            cores[name],
            int(_rise(track.counters, _TICKS)),
            int(_rise(track.counters, _OVERRUNS)),
            int(_rise(track.counters, _OVERFLOWED)),
            len(set(track.counters[:, _PID].tolist())) - 1,
        )
        for name, track in data.processes.items()
    ]
    return sorted(found, key=lambda load: -load.cores)
