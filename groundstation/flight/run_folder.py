"""The folder of a run: created and tested before anything starts.

The command's facts about the run are written to it.
"""

import logging
import os
import shlex
import sys
import time
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

import msgspec

from groundstation.bus import clock
from groundstation.errors import GroundStationError, OperatorMistake, is_wrong_place, without_passwords
from groundstation.process.log import DiscreetFormatter
from groundstation.recording.disk_space import free_bytes
from groundstation.recording.part_names import shown
from groundstation.report import run_facts
from groundstation.supervisor import kernels
from groundstation.supervisor.runtime_file import start_time
from groundstation.time_units import NS_PER_S

_MIN_FREE_BYTES = 50_000_000


def make_run_dir(parent: Path, field_name: str) -> Path:
    """Return a new run folder that can be written; raises GroundStationError before anything has started."""
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
    path = parent / f"{stamp}-{field_name}"
    if (named := shown(path.absolute())) != str(path.absolute()):
        raise OperatorMistake(f"{named}: is no UTF-8 text: rename that folder, or fly from another one")
    try:
        parent.mkdir(parents=True, exist_ok=True)
        path = _made(parent, path.name)
        probe = path / ".probe"
        probe.write_bytes(b"x" * 4096)
        probe.unlink()
        free = free_bytes(path)
    except OSError as error:
        kind = OperatorMistake if is_wrong_place(error) else GroundStationError
        raise kind(f"cannot write to {path}: {error.strerror} (--set recording.directory=...)") from error
    if free < _MIN_FREE_BYTES:
        path.rmdir()
        raise GroundStationError(f"only {free / 1e6:.0f} MB are free for {parent}: make room before take-off")
    return path


def _made(parent: Path, name: str) -> Path:
    """Return a new folder of a name, or of that name with a number: other runs may begin in the same second."""
    path, number = parent / name, 1
    while True:
        with suppress(FileExistsError):
            path.mkdir(mode=0o700)  # it holds pictures of people
            return path
        number += 1
        path = parent / f"{name}-{number}"


def write_facts(run_dir: Path, facts: run_facts.RunFacts, *, asks: bool) -> None:
    """Write the request for the run, and the start time of this process, from which on the operator waits.

    asks: whether the run waits for the operator before the take-off; then that time means nothing.
    """
    age_ns, lacked = _age_ns(), not kernels.are_compiled()
    typed = without_passwords(shlex.join(["groundstation", *sys.argv[1:]]))
    known = msgspec.structs.replace(facts, kernels_lacked=lacked, command=typed)
    if not asks:
        times = {"command_unix_ns": time.time_ns() - age_ns, "command_ns": clock.now_ns() - age_ns}
        known = msgspec.structs.replace(known, **times, clock=clock.clock_id())
    run_facts.write(run_dir, known)


def _age_ns() -> int:
    started_s = (start_time(os.getpid()) or 0) / os.sysconf("SC_CLK_TCK")
    return max(0, time.clock_gettime_ns(time.CLOCK_BOOTTIME) - int(started_s * NS_PER_S))


def log_to(run_dir: Path) -> None:
    """Send the log of this process to the run folder."""
    (run_dir / "log").mkdir(exist_ok=True)
    handler = logging.FileHandler(run_dir / "log" / "supervisor.log")
    handler.setFormatter(DiscreetFormatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    logging.getLogger().addHandler(handler)
    logging.getLogger().setLevel(logging.INFO)
    logging.raiseExceptions = False  # a full disk must not fill the terminal with tracebacks
