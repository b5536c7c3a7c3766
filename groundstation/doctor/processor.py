"""Cores, clock and the right to run in real time."""

import os
import threading
from pathlib import Path

from groundstation.doctor.finding import Finding, Level, judged
from groundstation.process.priority import go_first

_CORES_MUST, _CORES_SHOULD = 2, 4
_CLOCK = Path("/sys/devices/system/clocksource/clocksource0/current_clocksource")
_GOVERNOR = Path("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")
# Clocks that are read without a system call; the others cost microseconds, or jump when the host moves the guest.
_FAST_CLOCKS = frozenset({"tsc", "kvm-clock", "hyperv_clocksource_tsc_page", "arch_sys_counter"})


def cores() -> Finding:
    """Return how many cores this process may use: a team of two and its emulation need two."""
    count = len(os.sched_getaffinity(0))
    remedy = "use a machine with more cores, or give the container more (--cpus)"
    level = Level.MUST if count < _CORES_MUST else Level.SHOULD
    return judged(count >= _CORES_SHOULD, level, "cores", f"{count}", remedy)


def real_time_right() -> Finding:
    """Return whether loops with deadlines may run ahead of ordinary programs; tried in a thread that then ends."""
    allowed: list[bool] = []
    thread = threading.Thread(target=lambda: allowed.append(go_first()))
    thread.start()
    thread.join()
    found = "allowed" if allowed == [True] else "not allowed: on a busy machine setpoints come late"
    user = os.environ.get("USER") or "USER"
    remedy = (
        f"add '{user} - rtprio 10' to /etc/security/limits.conf and log in again; in a container: --cap-add SYS_NICE"
    )
    return judged(allowed == [True], Level.SHOULD, "real-time priority", found, remedy)


def clock_source(path: Path = _CLOCK) -> Finding | None:
    """Return which clock the kernel reads, or None where it does not say."""
    if not path.exists():
        return None
    name = path.read_text().strip()
    remedy = "boot with clocksource=tsc tsc=reliable, if the processor allows"
    return judged(name in _FAST_CLOCKS, Level.SHOULD, "clock", name, remedy)


def governor(path: Path = _GOVERNOR) -> Finding | None:
    """Return how the kernel chooses the processor's frequency, or None where it does not."""
    if not path.exists():
        return None
    name = path.read_text().strip()
    remedy = "cpupower frequency-set --governor performance"
    return judged(name != "powersave", Level.SHOULD, "frequency governor", name, remedy)
