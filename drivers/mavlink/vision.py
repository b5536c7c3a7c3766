"""Poses for an autopilot from the tracker's estimate, and the time without one. Pure.

On the floor the vehicle is sent the pad of the field file, or its last landing place: the tracker has no estimate of a
landed robot. Once the take-off has begun there is one, which is sent if it continues from there; one at the pad shows
that the vehicle was carried back there. A position that observations do not keep accurate is not sent: it would be the
autopilot's own dead reckoning. The covariance decides this, not whether cameras see the vehicle: sightings by its own
camera localise it as well. A vehicle whose telemetry is silent or implausible is sent only the places at which it was
seen. Nothing is sent while sightings far from the estimate are being weighed.
"""

import math
from dataclasses import replace

from drivers.mavlink.convert import VisionPose
from drivers.mavlink.settings import VisionFeedback
from drivers.mavlink.wire.names import Flavour
from drivers.seen_place import last_seen
from groundstation.bus.messages import EntityEstimate, Estimate
from groundstation.geometry.angles import difference
from groundstation.time_units import NS_PER_MS, NS_PER_S

_FRESH_NS = 300 * NS_PER_MS
_JUMP_RAD = math.radians(15.0)
_STANDING_VARIANCES = (0.05**2, 0.05**2, 0.02**2, math.radians(3.0) ** 2)
# Without poses for longer than this an autopilot has drifted by its own velocity, and then refuses poses.
_COASTED_NS = 400 * NS_PER_MS
# After lift-off cameras need a while to find it. ArduPilot coasts for 8 s (docs/reference/mavlink.md 1.1), PX4 lands by
# itself after 1 s (EKF2_NOAID_TOUT, docs/decisions/0296): our landing, 0.7 s after this time, has to come before that.
FIRST_SIGHT_NS = {Flavour.PX4: 200 * NS_PER_MS, Flavour.ARDUPILOT: 4 * NS_PER_S}


class VisionFeed:
    """The poses for one vehicle. resets: counts jumps, and pauses in flight, as autopilots require.

    first_sight_ns: for how long after lift-off no position is missed; sighted: the place where a picture new in the
    last estimate showed it, while nothing better is known.
    """

    def __init__(
        self, name: str, clock: str, vision: VisionFeedback, pad_m: tuple[float, float], pad_yaw_rad: float,
        first_sight_ns: int = FIRST_SIGHT_NS[Flavour.ARDUPILOT],
    ) -> None:  # fmt: skip
        self.resets = 0
        self.sighted: VisionPose | None = None
        self._name, self._clock, self._vision = name, clock, vision
        self._first_sight_ns = first_sight_ns
        self._pad = VisionPose(0, (*pad_m, 0.0), pad_yaw_rad, _STANDING_VARIANCES, (0.0, 0.0, 0.0))
        self._standing = self._pad
        self._last: VisionPose | None = None
        self._newest: VisionPose | None = None
        self._epoch: int | None = None
        self._good_ns: int | None = None
        self._aloft_ns: int | None = None

    def take(self, now_ns: int, estimate: Estimate) -> EntityEstimate | None:
        """Take the tracker's estimate; return that of this vehicle if it is good enough to fly on now."""
        self.sighted = None
        for entity in estimate.entities:
            if entity.name == self._name:
                break
        else:
            return None
        if estimate.epoch != self._epoch:
            self._epoch, self._last = estimate.epoch, None
            self.resets += 1
        if len(entity.mean) < 4 or len(entity.velocity_m_s) < 3 or len(entity.covariance) != 16:
            return None
        if entity.contradicted:  # the belief follows this autopilot's velocity, and would confirm it
            self._newest = None
            return None
        header = estimate.header
        stamp_ns = header.stamp_ns if header.clock == self._clock and header.stamp_ns <= now_ns else now_ns
        if self._is_good(entity):
            self._take(entity, stamp_ns, (entity.covariance[0], entity.covariance[5]))
            return entity
        seen = last_seen(stamp_ns, entity) if entity.converged else None
        if seen is not None and seen[0] > (self._good_ns or 0):
            self._take(entity, seen[0], (seen[1] ** 2,) * 2)
            self.sighted = self._newest
        return None

    def _take(self, entity: EntityEstimate, at_ns: int, level_variances: tuple[float, float]) -> None:
        x, y, z, yaw = entity.mean[:4]
        vx, vy, vz = entity.velocity_m_s[:3]
        variances = (*level_variances, entity.covariance[10], entity.covariance[15])
        self._newest, self._good_ns = VisionPose(at_ns, (x, y, z), yaw, variances, (vx, vy, vz)), at_ns

    def _is_good(self, entity: EntityEstimate) -> bool:
        worst = max(entity.covariance[0], entity.covariance[5], entity.covariance[10])
        return entity.converged and worst <= self._vision.max_std_m**2 and entity.age_s <= self._vision.max_age_s

    def pose(self, now_ns: int, aloft: bool) -> VisionPose | None:
        """Return the pose to send now, or None; aloft: the vehicle has left the floor."""
        pose = self._newest
        if pose is not None and now_ns - pose.stamp_ns > _FRESH_NS:
            pose = self._newest = None
        if not aloft:
            self._aloft_ns = None
            if pose is None or self._last is None or self._jumps(self._last, pose):
                if pose is not None and not self._jumps(replace(self._pad, stamp_ns=pose.stamp_ns), pose):
                    self._standing = self._pad  # it was carried back
                pose = replace(self._standing, stamp_ns=now_ns)
        else:
            if self._aloft_ns is None:
                self._aloft_ns, self._good_ns = now_ns, None if pose is None else self._good_ns
            if pose is None:
                return None
            # The place where it will stand after landing.
            self._standing = replace(pose, position_m=(*pose.position_m[:2], 0.0), variances=_STANDING_VARIANCES)
        if self._last is not None and (self._jumps(self._last, pose) or (aloft and self._coasted(self._last, pose))):
            self.resets += 1
        self._last = pose
        return pose

    def _jumps(self, before: VisionPose, now: VisionPose) -> bool:
        # A pose farther off than the vehicle can have flown since.
        elapsed_s = (now.stamp_ns - before.stamp_ns) / NS_PER_S
        allowed_m = self._vision.jump_m + 2.0 * elapsed_s
        turned = abs(difference(now.yaw_rad, before.yaw_rad))
        return math.dist(before.position_m, now.position_m) > allowed_m or turned > _JUMP_RAD + 2.0 * elapsed_s

    def _coasted(self, before: VisionPose, now: VisionPose) -> bool:
        return now.stamp_ns - before.stamp_ns > _COASTED_NS

    def lost_s(self, now_ns: int) -> float:
        """Return for how long a flying vehicle has been without a position from us."""
        if self._aloft_ns is None:
            return 0.0
        since_ns = self._good_ns if self._good_ns is not None else self._aloft_ns + self._first_sight_ns
        return max(0.0, (now_ns - since_ns) / NS_PER_S)

    @property
    def missed(self) -> str:
        """Return which position a flying vehicle lacks, in words."""
        never = self._aloft_ns is not None and self._good_ns is None
        return "from the cameras since it lifted off" if never else "from the cameras"
