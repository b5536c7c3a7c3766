"""The truth board: true states of all bodies in memory shared between the bridge and its render processes.

A plain file in /dev/shm mapped by path: multiprocessing.shared_memory of Python 3.11 unlinks a segment as soon as
any attaching process ends (its resource tracker believes that it owns the segment).
"""

import mmap
import os
import struct
import tempfile
import time
from collections.abc import Iterable
from itertools import chain
from pathlib import Path

import numpy as np

from groundstation.arrays import Array

FIELDS = ("x", "y", "z", "vx", "vy", "vz", "roll", "pitch", "yaw", "wx", "wy", "wz", "on_ground")
WIDTH = len(FIELDS)
_HEADER = struct.Struct("<Qq")  # seqlock counter (odd while written), stamp [ns]
_COUNTER = struct.Struct("<Q")
_PREFIX = "skein-truth-"


def _path(name: str) -> Path:
    shared = Path("/dev/shm")  # a name, not data: lives in memory where the system offers that
    folder = shared if shared.is_dir() else Path(tempfile.gettempdir())
    return folder / f"{_PREFIX}{name}"


class TruthBoard:
    """One row per body: x y z [m; world] | vx vy vz [m/s; world] | roll pitch yaw [rad; FLU] | wx wy wz | on_ground.

    One writer, any number of readers. `stamp_ns`: boot-clock time of the states.
    """

    def __init__(self, path: Path, bodies: tuple[str, ...], owner: bool) -> None:
        self.bodies = bodies
        self._path = path
        self._owner = owner
        self._rows = struct.Struct(f"<{WIDTH * len(bodies)}d")
        size = _HEADER.size + self._rows.size
        flags = os.O_RDWR | ((os.O_CREAT | os.O_EXCL) if owner else 0)
        descriptor = os.open(path, flags, 0o600)
        try:
            if owner:
                os.ftruncate(descriptor, size)
            elif os.fstat(descriptor).st_size != size:
                raise ValueError(f"truth board {path.name} does not hold {len(bodies)} bodies")
            self._memory = mmap.mmap(descriptor, size)
        finally:
            os.close(descriptor)

    @classmethod
    def create(cls, name: str, bodies: tuple[str, ...]) -> "TruthBoard":
        """Create the board; its file vanishes with `close`. Raises FileExistsError when the name is taken."""
        return cls(_path(name), bodies, owner=True)

    @classmethod
    def attach(cls, name: str, bodies: tuple[str, ...]) -> "TruthBoard":
        """Open an existing board; raises FileNotFoundError, or ValueError when it holds other bodies."""
        return cls(_path(name), bodies, owner=False)

    def write(self, stamp_ns: int, states: Iterable[Iterable[float]]) -> None:
        """Publish the states (n rows of 13) of the time `stamp_ns`."""
        memory = self._memory
        counter = _COUNTER.unpack_from(memory, 0)[0]
        _HEADER.pack_into(memory, 0, counter + 1, stamp_ns)
        self._rows.pack_into(memory, _HEADER.size, *chain.from_iterable(states))
        _COUNTER.pack_into(memory, 0, counter + 2)

    def read(self) -> tuple[int, Array]:
        """Return (stamp_ns, states (n, 13)); the stamp is 0 before the first write. Waits < 1 ms for a writer."""
        for attempt in range(1000):
            before, stamp_ns = _HEADER.unpack_from(self._memory, 0)
            payload = self._memory[_HEADER.size :]
            if before % 2 == 0 and _COUNTER.unpack_from(self._memory, 0)[0] == before:
                break
            time.sleep(0.0 if attempt < 10 else 1e-5)
        # A writer that died half-way leaves the counter odd for good: the last bytes are better than none.
        return stamp_ns, np.frombuffer(payload, dtype=np.float64).reshape(len(self.bodies), WIDTH)

    def close(self) -> None:
        """Unmap, and remove the file if this side created it; idempotent."""
        self._memory.close()
        if self._owner:
            self._path.unlink(missing_ok=True)


def remove_stale_boards() -> None:
    """Delete boards named `<pid>...` whose process no longer exists (left by a kill -9)."""
    for path in _path("").parent.glob(f"{_PREFIX}*"):
        pid = path.name.removeprefix(_PREFIX).split("-")[0]
        if pid.isdigit() and not Path(f"/proc/{pid}").exists():
            path.unlink(missing_ok=True)
