"""The entry of a run that goes on, its runtime file: written at the start and at each restart, removed at the end."""

import logging
import os
from collections.abc import Iterable
from pathlib import Path

from groundstation.supervisor import runtime_file
from groundstation.supervisor.managed_process import ManagedProcess
from groundstation.supervisor.run import SOURCE, Run

_log = logging.getLogger(__name__)


class RunEntry:
    """By it other commands find the run and its processes."""

    def __init__(self, run: Run, heartbeat: Path, identities: Path | None) -> None:
        self._run, self._heartbeat, self._identities = run, heartbeat, identities
        self._record: runtime_file.RuntimeRecord | None = None

    def write(self, processes: Iterable[ManagedProcess]) -> None:
        """Write the entry with the processes that run."""
        run = self._run
        own = runtime_file.ProcessRecord(SOURCE, SOURCE, os.getpid(), runtime_file.start_time(os.getpid()) or 0)
        self._record = runtime_file.RuntimeRecord(
            site=run.site,
            field=run.field,
            endpoint=run.endpoint,
            run_dir=str(run.run_dir.absolute()),
            heartbeat=str(self._heartbeat),
            drones=run.drones,
            real=run.real,
            supervisor=own,
            processes=tuple(_record(process) for process in processes if process.running),
            identities=str(self._identities or ""),
        )
        try:
            runtime_file.write(self._record)
        except OSError as error:  # the run matters more than this file
            _log.error("cannot write the runtime file: %s", error)

    def update(self, processes: Iterable[ManagedProcess]) -> None:
        """Write the entry again, if it has been written."""
        if self._record is not None:
            self.write(processes)

    def remove(self) -> None:
        """Remove the entry, if it has been written."""
        if self._record is not None:
            runtime_file.remove(self._record)
            self._record = None


def _record(process: ManagedProcess) -> runtime_file.ProcessRecord:
    return runtime_file.ProcessRecord(process.spec.name, process.spec.role, process.pid, process.start_time)
