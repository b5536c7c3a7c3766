"""How a program of another shell joins a run: as the role that its work needs, under a name of its own."""

import os

from groundstation.bus.roles import Role
from groundstation.bus.zenoh_bus import ZenohBus, open_bus
from groundstation.supervisor.runtime_file import RuntimeRecord


def join(record: RuntimeRecord, word: str, role: Role, timeout_s: float = 2.0) -> ZenohBus:
    """Return a bus on which this process is called WORD_PID; the role's certificate must be good for that word.

    Raises GroundStationError when no router answers.
    """
    source = f"{word}_{record.host}_{os.getpid()}" if record.host else f"{word}_{os.getpid()}"
    return open_bus(record.endpoint, record.site, source, timeout_s, record.identity(role))
