"""Check of the programs that use the processor beside a flight."""

import os
import time
from collections.abc import Callable
from pathlib import Path

from groundstation.doctor.finding import Finding, Level, judged
from groundstation.process.stat_file import stat_of

_PROC = Path("/proc")
_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_USER, _SYSTEM = 11, 12  # times that a process ran, among the fields of its record
_WATCHED_S = 1.0
# A flight of two drones needs two cores to itself.
_LOAD_SHOULD, _NAMED, _NAMED_CORES = 0.5, 3, 0.1


def load(pause: Callable[[float], None] = time.sleep) -> Finding:
    """Return a finding on the load (mean of a minute) and the programs that use most of the processor now."""
    cores, mean = len(os.sched_getaffinity(0)), os.getloadavg()[0]
    found = f"{mean:.1f} on {cores} core{'s' * (cores > 1)}"
    if busiest := _busiest(pause):
        found += f"; busiest now: {', '.join(busiest)}"
    remedy = "end other programs before a flight: they keep it from the processor"
    return judged(mean < _LOAD_SHOULD * cores, Level.SHOULD, "load", found, remedy)


def _busiest(pause: Callable[[float], None]) -> list[str]:
    """Return the programs that used most cores while it waited, with how many; this one and idle ones left out."""
    before, began_s = _used_s(), time.monotonic()
    pause(_WATCHED_S)
    after, elapsed_s = _used_s(), time.monotonic() - began_s
    shares = {pid: (used_s - before[pid]) / elapsed_s for pid, used_s in after.items() if pid in before}
    shares.pop(os.getpid(), None)
    most = sorted(shares, key=lambda pid: -shares[pid])[:_NAMED]
    return [f"{_name(pid)} ({pid}) {shares[pid]:.1f} cores" for pid in most if shares[pid] >= _NAMED_CORES]


def _used_s() -> dict[int, float]:
    """Return the processor time of each process of this computer [s]."""
    records = {int(each.name): stat_of(int(each.name)) for each in _PROC.iterdir() if each.name.isdigit()}
    return {
        pid: (int(fields[_USER]) + int(fields[_SYSTEM])) / _TICKS_PER_S
        for pid, fields in records.items()
        if fields is not None
    }


def _name(pid: int) -> str:
    try:
        return (_PROC / str(pid) / "comm").read_text().strip()
    except OSError:
        return "a program that has ended"
