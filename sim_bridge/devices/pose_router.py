"""An emulated node that publishes a motion capture system's poses as PoseStamped, and its Zenoh router."""

import time

from drivers.motion_capture.wire import ros2_pose
from drivers.rmw_zenoh.wire import graph
from sim_bridge.devices.captured_bodies import FRAME_TICKS, TICK_S, CapturedBodies
from sim_bridge.devices.ros2_router import ANY_HASH, PublishingRouter, topic_of


class PoseRouter(PublishingRouter):
    """Router and publishers of one system; `sim_bridge.world.emulation.Emulator`.

    Topics and domain stand in the system's source. A body that is not tracked is not published.
    """

    def __init__(self, name: str, place: tuple[str, int], seen: CapturedBodies) -> None:
        super().__init__(name, place)
        self._seen, self._ticks = seen, 0
        domain, path = topic_of(seen.system.source)
        topics = {body: f"{path}/{body}/pose" for body in seen.names}
        keys = {b: graph.topic_key(domain, topic, ros2_pose.POSE_STAMPED, ANY_HASH) for b, topic in topics.items()}
        self._publishers = {body: self.publisher(key) for body, key in keys.items()}
        self._late_ticks = round(seen.system.delay_ms / 1000 / TICK_S)
        self._waiting: list[tuple[int, str, bytes]] = []

    def send(self) -> None:
        """End a tick: take a frame when one is due, and publish the poses whose delay is over."""
        self._ticks += 1
        now_s = self._ticks * TICK_S
        if self._ticks % FRAME_TICKS == 0:
            due, stamp_ns = self._ticks + self._late_ticks, time.time_ns()
            tracked = [body for body in self._seen.frame(now_s) if body.inside]
            self._waiting += [
                (due, body.name, ros2_pose.encode_pose(stamp_ns, body.place, body.quaternion)) for body in tracked
            ]
        while self._waiting and self._waiting[0][0] <= self._ticks:
            _, body, payload = self._waiting.pop(0)
            if not self.silent and not self._seen.is_silent(now_s):
                self.publish(self._publishers[body], payload)
