"""The pose of a real body as a motion capture system of the field follows it: from its driver, over the bus."""

import math

from groundstation.bus.api import Bus
from groundstation.bus.messages import BodyPose, BodyPoses
from groundstation.bus.topics import BODY_POSES
from groundstation.geometry.angles import euler_from_quaternion
from groundstation.time_units import NS_PER_S
from sim_bridge.world.puppet import OutsidePose

# Longest time between two frames that give a velocity, and longest time for which a frame is extrapolated by it [s].
_APART_S, _CARRIED_S = 0.2, 0.1

_Stamped = tuple[int, BodyPose]


class CaptureFeed:
    """The pose of a body in the newest frame, extrapolated to now; refused frames do not count."""

    caveat = ""

    def __init__(self, name: str, system: str, bus: Bus) -> None:
        self._name, self._system = name, system
        self._inbox = bus.subscribe([BODY_POSES])
        self._last: _Stamped | None = None

    def latest(self, now_ns: int) -> OutsidePose | None:
        """Return the newest pose in the room, None without a new one; now_ns: on the boot clock."""
        pose = None
        for received in self._inbox.drain():
            message = received.message
            if isinstance(message, BodyPoses) and message.header.entity == self._system:
                pose = self._follow(message, now_ns) or pose
        return pose

    def close(self) -> None:
        """Do nothing: the bus ends its subscriptions."""

    def _follow(self, frame: BodyPoses, now_ns: int) -> OutsidePose | None:
        body = next((one for one in frame.bodies if one.name == self._name), None)
        if body is None or self._name in frame.refused:
            return None
        before, self._last = self._last, (frame.header.stamp_ns, body)
        return _pose(before, self._last, now_ns)


def _pose(before: _Stamped | None, newest: _Stamped, now_ns: int) -> OutsidePose:
    stamp_ns, body = newest
    roll, pitch, yaw = euler_from_quaternion(body.attitude)
    velocity, yaw_rate = (0.0, 0.0, 0.0), 0.0
    if before is not None and 0.0 < (apart_s := (stamp_ns - before[0]) / NS_PER_S) <= _APART_S:
        x, y, z = ((b - a) / apart_s for a, b in zip(before[1].position_m, body.position_m, strict=True))
        velocity = (x, y, z)
        yaw_rate = math.remainder(yaw - euler_from_quaternion(before[1].attitude)[2], math.tau) / apart_s
    ahead_s = min(max(0.0, (now_ns - stamp_ns) / NS_PER_S), _CARRIED_S)
    px, py, pz = (p + ahead_s * v for p, v in zip(body.position_m, velocity, strict=True))
    return OutsidePose((px, py, pz), velocity, (roll, pitch, yaw + ahead_s * yaw_rate), (0.0, 0.0, yaw_rate))
