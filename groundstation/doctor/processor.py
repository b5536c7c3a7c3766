"""Checks of cores, clock, frequency and the right to run in real time."""

import os
import threading
from pathlib import Path

from groundstation.doctor.finding import Finding, Level, judged
from groundstation.process.priority import go_first

_CORES_MUST, _CORES_SHOULD = 2, 4
_CLOCK = Path("/sys/devices/system/clocksource/clocksource0/current_clocksource")
_GOVERNOR = Path("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")
# Clocks that are read without a system call; others take microseconds, or jump when a virtual machine is moved.
_FAST_CLOCKS = frozenset({"tsc", "kvm-clock", "hyperv_clocksource_tsc_page", "arch_sys_counter"})


def cores() -> Finding:
    """Return a finding on the cores that this process may use: a team of two and its emulation need two."""
    count = len(os.sched_getaffinity(0))
    remedy = "use a machine with more cores, or give the container more (--cpus)"
    level = Level.MUST if count < _CORES_MUST else Level.SHOULD
    return judged(count >= _CORES_SHOULD, level, "cores", f"{count}", remedy)


def real_time_right() -> Finding:
    """Return a finding on real-time priority for loops with deadlines; tried in a thread that then ends."""
    allowed: list[bool] = []
    thread = threading.Thread(target=lambda: allowed.append(go_first()))
    thread.start()
    thread.join()
    found = "allowed" if allowed == [True] else "not allowed: on a busy machine setpoints come late"
    user = os.environ.get("USER") or "USER"
    remedy = (
        f"add '{user} - rtprio 2' to /etc/security/limits.d/skein.conf and log in again; "
        "in a container: --cap-add SYS_NICE"
    )
    return judged(allowed == [True], Level.SHOULD, "real-time priority", found, remedy)


def clock_source(path: Path = _CLOCK) -> Finding | None:
    """Return a finding on the kernel's clock source, or None if it does not report it."""
    if not path.exists():
        return None
    name = path.read_text().strip()
    remedy = "boot with clocksource=tsc tsc=reliable, if the processor allows"
    return judged(name in _FAST_CLOCKS, Level.SHOULD, "clock", name, remedy)


def governor(path: Path = _GOVERNOR) -> Finding | None:
    """Return a finding on the kernel's frequency governor, or None without one."""
    if not path.exists():
        return None
    name = path.read_text().strip()
    remedy = "cpupower frequency-set --governor performance"
    return judged(name != "powersave", Level.SHOULD, "frequency governor", name, remedy)
