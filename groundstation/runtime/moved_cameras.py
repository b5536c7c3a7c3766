"""Passes the moved cameras on from a tracker to its successor, in flight."""

from typing import Protocol

from groundstation.bus.notice import Notice
from groundstation.estimation.mount_watch import MountWatch

_MOST = 62


class Heir(Protocol):
    """What a child process leaves to its successor: one number."""

    @property
    def left(self) -> int:
        """Return the number that the process before this one recorded, 0 for none."""

    def leave(self, number: int) -> None:
        """Record a number for the process that is started in place of this one."""


class MovedCameras:
    """One bit for each watched camera, by name; call `recall` once, and `note` after each tick."""

    def __init__(self, heir: Heir, mounts: MountWatch) -> None:
        self._heir, self._mounts = heir, mounts
        self._names = sorted(mounts.cameras)[:_MOST]
        self._noted = heir.left

    def recall(self, now_ns: int) -> list[Notice]:
        """Restore the moved cameras known to the tracker before this one; returns the notices for the operator."""
        if not self._noted:
            return []
        return self._mounts.recall([name for bit, name in enumerate(self._names) if self._noted >> bit & 1], now_ns)

    def note(self) -> None:
        """Record the moved cameras that this tracker knows."""
        moved = self._mounts.moved
        known = sum(1 << bit for bit, name in enumerate(self._names) if name in moved)
        if known != self._noted:
            self._noted = known
            self._heir.leave(known)
