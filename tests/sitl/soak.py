"""Flies for long and watches the memory of every process: `make soak MINUTES=30`.

Prints, for each process, its resident memory after the first third of the time and at the end, and the slope between.
Exit code 1: a process grows by more than 0.5 MB a minute, or one was started again.
"""

import argparse
import os
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from conftest import SitlRun

PERIOD_S = 5.0
MOST_MB_PER_MIN = 0.5


def resident_mb(pid: int) -> float | None:
    """Return the resident memory of a process [MB], or None if it is gone."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
    except (OSError, IndexError):
        return None
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def watch(run: SitlRun, minutes: float) -> dict[str, list[tuple[float, int, float]]]:
    """Return (time [min], pid, memory [MB]) of each process while all drones track."""
    found: defaultdict[str, list[tuple[float, int, float]]] = defaultdict(list)
    began = time.monotonic()
    while (passed_min := (time.monotonic() - began) / 60.0) < minutes and run.process.poll() is None:
        run.listen()
        run.history.clear()  # this process must not grow itself
        for record in (run.record.supervisor, *run.record.processes):
            memory_mb = resident_mb(record.pid)
            if memory_mb is not None:
                found[record.name].append((passed_min, record.pid, memory_mb))
        time.sleep(PERIOD_S)
    return found


def slope(samples: list[tuple[float, int, float]]) -> tuple[float, float, float]:
    """Return memory at the end of the first third and at the end [MB], and the slope between [MB/min]."""
    late = np.array([(at, memory) for at, _, memory in samples[len(samples) // 3 :]])
    growth = float(np.polyfit(late[:, 0], late[:, 1], 1)[0]) if len(late) > 2 else 0.0
    return float(late[0, 1]), float(late[-1, 1]), growth


def main() -> int:
    """Fly, and judge."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--field", default="lab")
    told = parser.parse_args()
    wrong = 0
    with tempfile.TemporaryDirectory(prefix="skein-soak-") as folder:
        run = SitlRun(Path(folder), "sitl", told.field)
        try:
            run.until_tracking()
            found = watch(run, told.minutes)
        finally:
            run.close()
    for name, samples in sorted(found.items()):
        first, last, growth = slope(samples)
        again = len({pid for _, pid, _ in samples}) - 1
        bad = growth > MOST_MB_PER_MIN or again > 0
        wrong += bad
        restarts = f", started again {again} times" if again else ""
        print(f"{'NO' if bad else 'ok'}  {name:16} {first:7.1f} -> {last:7.1f} MB  {growth:+.2f} MB/min{restarts}")
    return 1 if wrong or not found else 0


if __name__ == "__main__":
    sys.exit(main())
