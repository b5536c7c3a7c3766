"""One frame of a motion capture system, as every source hands it over."""

from dataclasses import dataclass

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Pose = tuple[Vector3, Quaternion]


@dataclass(frozen=True, slots=True)
class CapturedFrame:
    """One frame: when it came, how long before its sending it was exposed [ns], and the tracked bodies by name.

    poses: position [m; the system's axes], quaternion (x, y, z, w). untracked: known to the system, not seen.
    """

    arrival_ns: int
    processing_ns: int
    poses: dict[str, Pose]
    untracked: tuple[str, ...] = ()
