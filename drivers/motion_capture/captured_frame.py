"""One frame of a motion capture system, in the form common to all sources."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from drivers.motion_capture.wire.ros2_pose import Deviations
from groundstation.vectors import Quaternion, Vector3

Pose = tuple[Vector3, Quaternion]


@dataclass(frozen=True, slots=True)
class CapturedFrame:
    """One frame: its arrival, the time from exposure to sending [ns], and the tracked bodies by name.

    processing_ns: or by how much it came later than usual. behind_ns: by how much earlier a body was exposed than that
    says, where bodies differ.
    poses: position [m; the system's axes], quaternion (x, y, z, w). untracked: known to the system, not seen.
    whole: the system tracks no body that it lacks, which shows that the system works; else they may come separately.
    deviations: as the system reports them, of x, y, z [m; likewise] and of the heading [rad], 0 where unknown.
    """

    arrival_ns: int
    processing_ns: int
    poses: dict[str, Pose]
    untracked: tuple[str, ...] = ()
    deviations: Mapping[str, Deviations] = field(default_factory=dict)
    behind_ns: Mapping[str, int] = field(default_factory=dict)
    whole: bool = True
