"""Liveness on one host: a memory-mapped file with one slot per process that costs a microsecond to beat.

Slot 0 is the supervisor's. A plain file is mapped instead of `multiprocessing.shared_memory`, whose resource
tracker removes the block as soon as any attached process ends (Python before 3.13).
"""

import mmap
import os
import socket
import tempfile
import time
from collections.abc import Sequence
from enum import IntEnum
from pathlib import Path

from groundstation.errors import GroundStationError
from groundstation.time_units import NS_PER_S

SUPERVISOR_SLOT = 0
_WORDS_PER_SLOT = 64  # whole cache lines, so that two beating processes never share one
_STAMP, _STATE, _PID, _WORKED, _ENDED, _SILENT_SINCE, _CLOCK_OFFSET, _LEFT = 0, 1, 2, 3, 4, 5, 6, 7
_ADDRESSES, MOST_ADDRESSES = 8, 56  # more than a team has
_LEFT_BEHIND_NS = 10 * NS_PER_S


class SlotState(IntEnum):
    """Lifecycle as a number; EMPTY until the process has attached."""

    EMPTY = 0
    STARTING = 1
    READY = 2
    DEGRADED = 3
    STOPPING = 4


class HeartbeatBlock:
    """All slots of one run. Writes are aligned 8-byte stores, so a reader never sees half a stamp.

    descriptor: the file, for the creator's children; -1 where it was attached. Its name may vanish in a run: systemd
    removes a user's files in /dev/shm at the last logout.
    """

    def __init__(self, path: Path, slots: int, *, create: bool) -> None:
        self.path = Path(os.path.realpath(path))  # of an inherited descriptor its name, for the last who leaves
        flags = os.O_RDWR | os.O_CLOEXEC | (os.O_CREAT | os.O_EXCL if create else 0)
        self.descriptor = os.open(path, flags, 0o600)
        try:
            if create:
                # Not ftruncate, which reserves nothing: where storage is full, the first beat would end by SIGBUS.
                os.posix_fallocate(self.descriptor, 0, slots * _WORDS_PER_SLOT * 8)
            self._map = mmap.mmap(self.descriptor, 0)
        except BaseException:
            self._close_descriptor()
            if create:
                path.unlink(missing_ok=True)
            raise
        if not create:
            self._close_descriptor()
        self._words = memoryview(self._map).cast("q")

    @classmethod
    def create(cls, name: str, slots: int) -> "HeartbeatBlock":
        """Return a new zeroed block, in memory-backed storage if the host has it.

        An abandoned block of that name is replaced; raises GroundStationError for one in use.
        """
        folder = Path("/dev/shm") if Path("/dev/shm").is_dir() else Path(tempfile.gettempdir())
        path = folder / name
        try:
            if path.exists() and not _is_live(path):
                path.unlink()
            return cls(path, slots, create=True)
        except FileExistsError:
            raise GroundStationError(f"another run beats in {path}: end it") from None
        except OSError as error:
            text = f"cannot make the heartbeat block {path}: {error.strerror}; make room there, or remove it"
            raise GroundStationError(text) from error

    @classmethod
    def attach(cls, path: str) -> "HeartbeatBlock":
        """Return the block that the supervisor made; raises OSError if it is gone."""
        return cls(Path(path), 0, create=False)

    def beat(self, slot: int) -> None:
        """Stamp a slot with the time now."""
        self._words[slot * _WORDS_PER_SLOT + _STAMP] = time.monotonic_ns()

    def set_state(self, slot: int, state: SlotState, works: bool = True) -> None:
        """Record the lifecycle state of this process, with a beat; works: READY or DEGRADED, it has begun its work."""
        base = slot * _WORDS_PER_SLOT
        self._words[base + _PID] = os.getpid()
        self._words[base + _STAMP] = time.monotonic_ns()
        self._words[base + _STATE] = state
        if works and state in (SlotState.READY, SlotState.DEGRADED):
            self._words[base + _WORKED] = 1

    def end(self, slot: int) -> None:
        """Record that the work of this driver is done: its vehicles stand, or have been silent for too long."""
        self._words[slot * _WORDS_PER_SLOT + _ENDED] = 1

    def set_silent_since(self, slot: int, since_ns: int) -> None:
        """Record since when others have sent for the holder of a slot [ns]; 0: nobody does."""
        self._words[slot * _WORDS_PER_SLOT + _SILENT_SINCE] = since_ns

    def set_addresses(self, slot: int, addresses: Sequence[tuple[str, int]]) -> None:
        """Record the last addresses (IPv4, port) of a slot holder's vehicles: the first MOST_ADDRESSES of them."""
        base = slot * _WORDS_PER_SLOT + _ADDRESSES
        for index in range(MOST_ADDRESSES):
            address = addresses[index] if index < len(addresses) else ("0.0.0.0", 0)
            # One word each: a reader never sees one vehicle's address with another one's port.
            self._words[base + index] = int.from_bytes(socket.inet_aton(address[0]), "big") << 16 | address[1]

    def addresses(self, slot: int) -> tuple[tuple[str, int], ...]:
        """Return the recorded addresses; a restart of the holder does not erase them."""
        base = slot * _WORDS_PER_SLOT + _ADDRESSES
        words = [self._words[base + index] for index in range(MOST_ADDRESSES)]
        return tuple((socket.inet_ntoa((word >> 16).to_bytes(4, "big")), word & 0xFFFF) for word in words if word)

    def leave(self, slot: int, number: int) -> None:
        """Record a number (0 to 2^62) that the holder of a slot leaves to its successor."""
        self._words[slot * _WORDS_PER_SLOT + _LEFT] = number

    def left(self, slot: int) -> int:
        """Return the number that the former holder of a slot left to this one, 0 for none."""
        return self._words[slot * _WORDS_PER_SLOT + _LEFT]

    def clear(self, slot: int) -> None:
        """Forget the former holder of a slot, before its successor starts.

        Kept: since when others send for it, its vehicles' addresses, and its number for the successor.
        """
        base = slot * _WORDS_PER_SLOT
        self._words[base : base + _SILENT_SINCE] = memoryview(bytes(_SILENT_SINCE * 8)).cast("q")

    def state(self, slot: int) -> SlotState:
        """Return the lifecycle state last recorded."""
        return SlotState(self._words[slot * _WORDS_PER_SLOT + _STATE])

    def pid(self, slot: int) -> int:
        """Return the process that holds a slot, 0 before it has attached."""
        return self._words[slot * _WORDS_PER_SLOT + _PID]

    def has_worked(self, slot: int) -> bool:
        """Return whether the holder of a slot ever finished its start."""
        return self._words[slot * _WORDS_PER_SLOT + _WORKED] != 0

    def has_ended(self, slot: int) -> bool:
        """Return whether the holder of a slot reported that its work is done."""
        return self._words[slot * _WORDS_PER_SLOT + _ENDED] != 0

    def silent_since_ns(self, slot: int) -> int:
        """Return since when others have sent for the holder of a slot [ns]; 0: nobody does."""
        return self._words[slot * _WORDS_PER_SLOT + _SILENT_SINCE]

    def set_clock_offset(self, offset_ns: int) -> None:
        """Record the offset of the run's boot clock from this host's [ns], to be added to this host's."""
        self._words[SUPERVISOR_SLOT * _WORDS_PER_SLOT + _CLOCK_OFFSET] = offset_ns

    def clock_offset_ns(self) -> int:
        """Return the offset of the run's boot clock from this host's [ns]; 0 on the run's own host."""
        return self._words[SUPERVISOR_SLOT * _WORDS_PER_SLOT + _CLOCK_OFFSET]

    def beat_ns(self, slot: int) -> int:
        """Return the time of the last beat [ns], 0 for a slot that never beat."""
        return self._words[slot * _WORDS_PER_SLOT + _STAMP]

    def age_ns(self, slot: int, now_ns: int) -> int:
        """Return the time since the last beat [ns]; since boot for a slot that never beat."""
        return max(0, now_ns - self._words[slot * _WORDS_PER_SLOT + _STAMP])

    def close(self, *, remove: bool = False) -> None:
        """Unmap, and remove the file if nobody needs it any more; idempotent."""
        self._words.release()
        self._map.close()
        self._close_descriptor()
        if remove:
            self.path.unlink(missing_ok=True)

    def remove(self) -> None:
        """Remove the file, which no further child gets; it stays mapped; idempotent."""
        self._close_descriptor()
        self.path.unlink(missing_ok=True)

    def _close_descriptor(self) -> None:
        if self.descriptor >= 0:
            os.close(self.descriptor)
            self.descriptor = -1


def _is_live(path: Path) -> bool:
    """Return whether somebody has beaten in a block of late; raises OSError when it cannot be read."""
    try:
        block = HeartbeatBlock.attach(str(path))
    except ValueError:  # empty: its creator died in between
        return False
    now_ns = time.monotonic_ns()
    slots = range(len(block._words) // _WORDS_PER_SLOT)
    live = any(block.beat_ns(slot) and block.age_ns(slot, now_ns) < _LEFT_BEHIND_NS for slot in slots)
    block.close()
    return live
