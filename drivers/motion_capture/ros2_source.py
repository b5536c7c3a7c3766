"""Poses that ROS 2 nodes publish, received by a client of their Zenoh router, which only listens."""

import threading
import time
from collections import Counter, deque

from drivers.motion_capture.captured_frame import CapturedFrame
from drivers.motion_capture.pose_guard import PoseGuard
from drivers.motion_capture.settings import SystemAddress
from drivers.motion_capture.wire import ros2_pose
from drivers.motion_capture.wire.ros2_pose import StampedPose
from drivers.rmw_zenoh.session import RouterSession
from drivers.rmw_zenoh.wire.cdr import WireError
from groundstation.bus import clock

# Bodies of one frame arrive one after the other; those within this time [s] are one frame.
_GATHER_S = 0.003
_WAITING = 256
# A drone whose place is reported to this deviation cannot be flown by it.
_UNCERTAIN_M = 0.5


class Ros2Source:
    """The newest pose of each topic `<path>/<body>/pose`: PoseStamped, PoseWithCovarianceStamped or Odometry."""

    def __init__(self, address: SystemAddress) -> None:
        self.rejected: Counter[str] = Counter()
        endpoint = f"tcp/{address.host}:{address.port}"
        self.detail = f"no pose from the ROS 2 router {endpoint}"
        self._waiting: deque[tuple[int, int, str, StampedPose]] = deque(maxlen=_WAITING)
        self._came, self._guard = threading.Event(), PoseGuard()
        self._session = RouterSession(endpoint, [ros2_pose.expression(address.domain, address.path)], self._hear)

    def poll(self, wait_s: float) -> list[CapturedFrame]:
        """Return the poses that form one frame, or nothing; waits up to wait_s for the first pose."""
        if not self._came.wait(wait_s):
            return []
        time.sleep(_GATHER_S)
        self._came.clear()
        said: dict[str, StampedPose] = {}
        exposed_ns: dict[str, int] = {}
        arrival_ns = 0
        while self._waiting:
            arrival_ns, late_ns, name, pose = self._waiting.popleft()
            said[name], exposed_ns[name] = pose, arrival_ns - late_ns
        if not said:
            return []
        poses = {name: pose.pose for name, pose in said.items()}
        deviations = {name: pose.deviations for name, pose in said.items()}
        behind_ns = {name: arrival_ns - at_ns for name, at_ns in exposed_ns.items()}
        return [CapturedFrame(arrival_ns, 0, poses, (), deviations, behind_ns, whole=False)]

    def close(self) -> None:
        """Leave the router."""
        self._session.close()

    def _hear(self, key: str, payload: bytes, publisher: bytes) -> None:
        now_ns = clock.now_ns()
        try:
            name, dds_type = ros2_pose.body_of(key)
            said = ros2_pose.decode_pose(dds_type, payload)
        except WireError as error:
            self.rejected[error.reason] += 1
            return
        refusal, late_ns = self._guard.judge(name, publisher, said.frame, said.stamp_ns, now_ns)
        if not refusal and max(said.deviations[:2]) > _UNCERTAIN_M:
            refusal = "uncertain pose"
        if refusal:
            self.rejected[refusal] += 1
            self.detail = f"{refusal} of {name}"
            return
        self.detail = ""
        self._waiting.append((now_ns, late_ns, name, said))
        self._came.set()
