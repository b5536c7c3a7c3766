"""Poses that ROS 2 nodes publish, by a client of their Zenoh router: it hears, and says nothing."""

import json
import threading
import time
from collections import Counter, deque
from typing import Any

import zenoh

from drivers.motion_capture.captured_frame import CapturedFrame, Pose
from drivers.motion_capture.settings import SystemAddress
from drivers.motion_capture.wire import ros2_pose
from drivers.motion_capture.wire.natnet import WireError
from groundstation.bus import clock

# Bodies of one frame come one after the other; what comes within this time [s] is one frame.
_GATHER_S = 0.003
_WAITING = 256
_AGAIN_S, _PATIENCE_S = 0.5, 3.0


class Ros2Source:
    """The newest pose of each topic `<path>/<body>/pose`: PoseStamped, PoseWithCovarianceStamped or Odometry."""

    def __init__(self, address: SystemAddress) -> None:
        self.rejected: Counter[str] = Counter()
        endpoint = f"tcp/{address.host}:{address.port}"
        self.detail = f"no pose from the ROS 2 router {endpoint}"
        self._waiting: deque[tuple[int, str, Pose]] = deque(maxlen=_WAITING)
        self._came = threading.Event()
        self._session: Any = None
        self._closing = threading.Event()
        expression = ros2_pose.expression(address.domain, address.path)
        self._joining = threading.Thread(target=self._join, args=(endpoint, expression), daemon=True)
        self._joining.start()

    def poll(self, wait_s: float) -> list[CapturedFrame]:
        """Return what came as one frame, or nothing; waits for the first pose at most so long."""
        if not self._came.wait(wait_s):
            return []
        time.sleep(_GATHER_S)
        self._came.clear()
        poses: dict[str, Pose] = {}
        arrival_ns = 0
        while self._waiting:
            arrival_ns, name, pose = self._waiting.popleft()
            poses[name] = pose
        return [CapturedFrame(arrival_ns, 0, poses)] if poses else []

    def close(self) -> None:
        """Leave the router."""
        self._closing.set()
        self._joining.join(_PATIENCE_S)
        if self._session is not None:
            self._session.close()

    def _join(self, endpoint: str, expression: str) -> None:
        """Listen as soon as the router is there."""
        # As the view of a flight for ROS 2: a peer would not be brokered, and scouting would find other people's.
        settings = {
            "mode": "client",
            "connect": {"endpoints": [endpoint], "timeout_ms": 1000, "exit_on_failure": True},
            "scouting": {"multicast": {"enabled": False}},
        }
        while not self._closing.is_set():
            try:
                self._session = zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))
            except zenoh.ZError:
                self._closing.wait(_AGAIN_S)
                continue
            self._session.declare_subscriber(expression, self._hear)
            return

    def _hear(self, sample: Any) -> None:
        try:
            name, dds_type = ros2_pose.body_of(str(sample.key_expr))
            pose = ros2_pose.decode_pose(dds_type, sample.payload.to_bytes())
        except WireError as error:
            self.rejected[error.reason] += 1
            return
        self.detail = ""
        self._waiting.append((clock.now_ns(), name, pose))
        self._came.set()
