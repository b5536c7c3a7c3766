"""Joins a run from another shell, in the role that the work needs, under a name of its own."""

import os
from collections.abc import Mapping
from pathlib import Path

from groundstation.bus.roles import Role
from groundstation.bus.zenoh_bus import ALL, ZenohBus, open_bus
from groundstation.supervisor.runtime_file import RuntimeRecord


def settings_folder() -> Path:
    """Return where this user keeps sites and admissions."""
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "skein"


def admissions() -> list[Path]:
    """Return the files of this host's admissions, one for each site that it has joined."""
    return sorted((settings_folder() / "joined").glob("*/admission.json"))


def join(
    record: RuntimeRecord, word: str, role: Role, timeout_s: float = 2.0, at_most_hz: Mapping[str, float] = ALL
) -> ZenohBus:
    """Return a bus on which this process is called WORD_PID; the role's certificate must be good for that word.

    at_most_hz: by key, how many samples a second are let in. Raises GroundStationError when no router answers.
    """
    source = f"{word}_{record.host}_{os.getpid()}" if record.host else f"{word}_{os.getpid()}"
    return open_bus(record.endpoint, record.site, source, timeout_s, record.identity(role), at_most_hz)
