"""What each of our messages says to ROS 2 tools."""

import math
from typing import Any

import numpy as np

from groundstation.bus import messages as m
from groundstation.engineering_views.ros2.codec import Ros2Codec, RosMessage
from groundstation.engineering_views.ros2.geometry import Builder, covariance_36
from groundstation.engineering_views.ros2.health import HealthMaker
from groundstation.engineering_views.ros2.markers import MarkerMaker
from groundstation.engineering_views.scene import Body, ViewScene
from groundstation.field.resolved import ResolvedField
from groundstation.field.room import LensCalibration

_TF, _MARKERS = "tf2_msgs/msg/TFMessage", "visualization_msgs/msg/MarkerArray"


class Ros2Scene:
    """Turns messages of a flight into those of ROS 2; stamps are Unix nanoseconds. Frames: world, robots, cameras."""

    def __init__(self, codec: Ros2Codec, field: ResolvedField | None) -> None:
        self._make, self._build = codec.make, Builder(codec)
        self._health, self._markers = HealthMaker(codec), MarkerMaker(codec)
        self._view = ViewScene(field)
        self._lenses = field.calibrations if field is not None else {}

    def static(self, stamp_ns: int) -> RosMessage:
        """Return the frames that do not move; to be said again for those who join later."""
        frames = [
            self._build.transform(
                stamp_ns, (frame.parent, frame.child), frame.position_m, self._build.quaternion(frame.rotation_wxyz)
            )
            for frame in self._view.cameras
        ]
        return RosMessage("/tf_static", _TF, self._make(_TF, transforms=frames))

    def take(self, stamp_ns: int, message: m.Message) -> list[RosMessage]:
        """Return what a message of the bus becomes; nothing for those that no tool asks for."""
        match message:
            case m.Estimate():
                return self._estimate(stamp_ns, message)
            case m.Plan():
                links = [self._markers.link(stamp_ns, link) for link in self._view.links(message)]
                return self._marked(links)
            case m.VelocitySetpoint():
                return self._setpoint(stamp_ns, message)
            case m.TruthState():
                return [self._truth(stamp_ns, message)]
            case m.VehicleStatus():
                return self._health.vehicle(stamp_ns, message)
            case m.CameraStatus():
                return [self._health.camera(stamp_ns, message)]
            case m.ProcessStatus():
                return [self._health.process(stamp_ns, message)]
            case m.Event():
                return [self._health.event(stamp_ns, message)]
            case _:
                return []

    def take_picture(self, stamp_ns: int, camera: str, jpeg: bytes) -> list[RosMessage]:
        """Return a picture, and the lens that took it where the field is known."""
        header = self._build.header(stamp_ns, camera)
        picture = self._make(
            "sensor_msgs/msg/CompressedImage", header=header, format="jpeg", data=np.frombuffer(jpeg, np.uint8)
        )
        found = [RosMessage(f"/{camera}/image/compressed", "sensor_msgs/msg/CompressedImage", picture)]
        lens = self._lenses.get(camera)
        if lens is not None:
            found.append(RosMessage(f"/{camera}/camera_info", "sensor_msgs/msg/CameraInfo", self._info(header, lens)))
        return found

    def _estimate(self, stamp_ns: int, estimate: m.Estimate) -> list[RosMessage]:
        bodies = {body.name: body for body in self._view.take_estimate(estimate)}
        frames = [
            self._build.transform(stamp_ns, ("world", body.name), body.position_m, self._build.heading(body.yaw_rad))
            for body in bodies.values()
        ]
        found = [RosMessage("/tf", _TF, self._make(_TF, transforms=frames))]
        for entity in estimate.entities:
            found += self._entity(stamp_ns, entity, bodies[entity.name])
        rings = [
            ring
            for body in bodies.values()
            for ring in self._markers.body(stamp_ns, body, self._view.colour(body.name))
        ]
        return found + self._marked(rings)

    def _entity(self, stamp_ns: int, entity: m.EntityEstimate, body: Body) -> list[RosMessage]:
        header, unknown = self._build.header(stamp_ns), np.zeros(36)
        pose = self._make(
            "geometry_msgs/msg/PoseWithCovariance",
            pose=self._build.pose(body.position_m, body.yaw_rad),
            covariance=covariance_36(entity),
        )
        (vx, vy), c, sn = entity.velocity_m_s[:2], math.cos(body.yaw_rad), math.sin(body.yaw_rad)
        forward, left = c * vx + sn * vy, c * vy - sn * vx
        up = entity.velocity_m_s[2] if len(entity.velocity_m_s) > 2 else 0.0
        twist = self._make(
            "geometry_msgs/msg/TwistWithCovariance", twist=self._build.twist((forward, left, up)), covariance=unknown
        )
        stamped = self._make("geometry_msgs/msg/PoseWithCovarianceStamped", header=header, pose=pose)
        odometry = self._make(
            "nav_msgs/msg/Odometry", header=header, child_frame_id=entity.name, pose=pose, twist=twist
        )
        return [
            RosMessage(f"/{entity.name}/pose", "geometry_msgs/msg/PoseWithCovarianceStamped", stamped),
            RosMessage(f"/{entity.name}/odom", "nav_msgs/msg/Odometry", odometry),
        ]

    def _setpoint(self, stamp_ns: int, setpoint: m.VelocitySetpoint) -> list[RosMessage]:
        name = setpoint.header.entity
        twist = self._build.twist(setpoint.velocity_m_s, setpoint.yaw_rate_rad_s)
        stamped = self._make("geometry_msgs/msg/TwistStamped", header=self._build.header(stamp_ns, name), twist=twist)
        arrow = self._view.arrow(setpoint)
        marks = [] if arrow is None else [self._markers.arrow(stamp_ns, name, *arrow, self._view.colour(name))]
        return [RosMessage(f"/{name}/setpoint", "geometry_msgs/msg/TwistStamped", stamped), *self._marked(marks)]

    def _truth(self, stamp_ns: int, truth: m.TruthState) -> RosMessage:
        pose = self._make(
            "geometry_msgs/msg/PoseStamped",
            header=self._build.header(stamp_ns),
            pose=self._build.pose(truth.position_m, truth.attitude_rad[2]),
        )
        return RosMessage(f"/{truth.header.entity}/truth", "geometry_msgs/msg/PoseStamped", pose)

    def _marked(self, markers: list[Any]) -> list[RosMessage]:
        return [RosMessage("/skein/markers", _MARKERS, self._make(_MARKERS, markers=markers))] if markers else []

    def _info(self, header: Any, lens: LensCalibration) -> Any:
        fx, fy, cx, cy = lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px
        return self._make(
            "sensor_msgs/msg/CameraInfo",
            header=header,
            height=lens.height_px,
            width=lens.width_px,
            distortion_model="plumb_bob",
            d=np.array(lens.distortion, dtype=np.float64),
            k=np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1], dtype=np.float64),
            r=np.eye(3).reshape(9),
            p=np.array([fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0], dtype=np.float64),
            binning_x=0,
            binning_y=0,
            roi=self._make(
                "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
            ),
        )
