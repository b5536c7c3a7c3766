"""One frame of a motion capture system, in the form common to all sources."""

from dataclasses import dataclass

from groundstation.vectors import Quaternion, Vector3

Pose = tuple[Vector3, Quaternion]


@dataclass(frozen=True, slots=True)
class CapturedFrame:
    """One frame: its arrival, the time from exposure to sending [ns], and the tracked bodies by name.

    processing_ns: or by how much it came later than usual.
    poses: position [m; the system's axes], quaternion (x, y, z, w). untracked: known to the system, not seen.
    """

    arrival_ns: int
    processing_ns: int
    poses: dict[str, Pose]
    untracked: tuple[str, ...] = ()
