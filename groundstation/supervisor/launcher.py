"""Starts one process of the table by exec of a fresh interpreter, in a session of its own."""

import json
import os
import subprocess
import sys
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import BinaryIO

from groundstation.bus.roles import Identity
from groundstation.errors import GroundStationError
from groundstation.process.child import ENDS_BY, ChildSpec
from groundstation.process.one_thread import one_thread
from groundstation.supervisor.interrupts import put_aside_by_nobody
from groundstation.supervisor.process_spec import ProcessSpec
from groundstation.supervisor.run import Run

_TAIL_LINES, _TAIL_BYTES = 8, 65536


class Launcher:
    """Holds the run folder and the environment of children; for restarts log files and heartbeat block stay open."""

    def __init__(self, run: Run, heartbeat: int, identities: Path | None = None) -> None:
        self._run = run
        self._run_dir = run.run_dir
        self._heartbeat = heartbeat
        self._identities = identities
        self._logs: dict[str, BinaryIO] = {}
        self._begins: dict[str, int] = {}

    def log_path(self, name: str) -> Path:
        """Return where a process's standard error goes."""
        return self._run_dir / "log" / f"{name}.log"

    def prepare(self, specs: tuple[ProcessSpec, ...]) -> None:
        """Open all log files; raises GroundStationError when the run folder cannot be written."""
        try:
            (self._run_dir / "log").mkdir(parents=True, exist_ok=True)
            for spec in specs:
                # Unbuffered, and open from now on: a restart in flight must not need free disk space.
                self._logs[spec.name] = self.log_path(spec.name).open("ab", buffering=0)
        except OSError as error:
            raise GroundStationError(f"cannot write to the run folder {self._run_dir}: {error.strerror}") from error

    def launch(self, spec: ProcessSpec, slot: int, life: int, spoken_since_ns: int = 0) -> subprocess.Popen[bytes]:
        """Start a process; `life` counts its starts and raises the epoch of a numbered one.

        spoken_since_ns: since when others have commanded its drone to hover; 0: nobody does.
        """
        section = json.loads(spec.section)
        if spec.numbered:
            section["epoch"] = section.get("epoch", 0) + life
        child = asdict(
            ChildSpec(
                name=spec.name,
                role=spec.role,
                endpoint=self._run.endpoint if spec.on_bus else "",
                site=self._run.site,
                heartbeat=f"/proc/self/fd/{self._heartbeat}",
                heartbeat_index=slot,
                section=json.dumps(section),
                parent_pid=os.getpid(),
                identity=self._identity(spec),
                clock=self._run.clock if spec.on_bus else "",
                nice=spec.nice,
                spoken_since_ns=spoken_since_ns,
                at_most_hz=dict(spec.at_most_hz),
            )
        )
        if spec.command:
            command = self._command(spec, section | {"child": child})
            return self._popen(spec, command, subprocess.DEVNULL)
        with _memory_file(json.dumps(child).encode()) as specification:
            command = [sys.executable, "-m", "groundstation.process.entry", spec.name, spec.entry]
            return self._popen(spec, command, specification.fileno())

    def _identity(self, spec: ProcessSpec) -> Identity | None:
        if not (spec.on_bus or spec.is_router):
            return None
        own = Identity(str(self._identities), spec.name, self._run.name) if self._identities else None
        return own or self._run.identity

    def _command(self, spec: ProcessSpec, document: dict[str, object]) -> list[str]:
        path = self._run_dir / f"{spec.name}.json"
        path.write_text(json.dumps(document))
        return [part.replace("{spec}", str(path)) for part in spec.command]

    def _popen(self, spec: ProcessSpec, command: list[str], stdin: int) -> subprocess.Popen[bytes]:
        log = self._logs[spec.name]
        self._begins[spec.name] = os.fstat(log.fileno()).st_size
        with put_aside_by_nobody():
            return subprocess.Popen(
                command,
                stdin=stdin,
                stdout=None if spec.on_terminal else log,
                stderr=log,
                start_new_session=True,
                pass_fds=(*spec.keep_open, self._heartbeat),
                env=one_thread(),
            )

    def log_tail(self, name: str) -> str:
        """Return the last lines of a process's log, for an error message."""
        with suppress(OSError):
            return "\n".join(self.log_path(name).read_text(errors="replace").splitlines()[-_TAIL_LINES:])
        return ""

    def last_words(self, name: str) -> str:
        """Return the reason of a process's end by the log of its last life, "" for none."""
        with suppress(OSError), self.log_path(name).open("rb") as log:
            log.seek(max(self._begins.get(name, 0), log.seek(0, os.SEEK_END) - _TAIL_BYTES))
            lines = log.read().decode(errors="replace").splitlines()
            return next((line.partition(ENDS_BY)[2] for line in reversed(lines) if ENDS_BY in line), "")
        return ""

    def close(self) -> None:
        """Close the log files; idempotent."""
        while self._logs:
            self._logs.popitem()[1].close()


def _memory_file(content: bytes) -> BinaryIO:
    """Return a file with this content, positioned at its start, that needs no disk."""
    file = os.fdopen(os.memfd_create("child"), "r+b")
    file.write(content)
    file.flush()
    file.seek(0)
    return file
