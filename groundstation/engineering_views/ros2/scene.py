"""Turns our messages into those of ROS 2 tools."""

from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.topics import Topic
from groundstation.engineering_views.ros2.codec import Ros2Codec, RosMessage
from groundstation.engineering_views.ros2.geometry import (
    Builder,
    attitude_xyzw,
    covariance_36,
    heading_xyzw,
    velocity_ahead,
    velocity_covariance_36,
)
from groundstation.engineering_views.ros2.health import HealthMaker
from groundstation.engineering_views.ros2.markers import MarkerScene
from groundstation.engineering_views.ros2.names import own
from groundstation.engineering_views.ros2.pictures import PictureMaker
from groundstation.engineering_views.ros2.stencils import FRAMES, ODOMETRY, POSE, SURE_POSE, TWIST, Stencils
from groundstation.engineering_views.scene import ViewScene
from groundstation.field.resolved import ResolvedField

# Each of these has the whole state of its entity, so the newest is enough. Of events all are needed.
STATES: tuple[Topic, ...] = (
    t.ESTIMATE, t.PLAN, t.SETPOINT, t.TRUTH, t.VEHICLE_STATUS, t.CAMERA_STATUS, t.PROCESS_STATUS
)  # fmt: skip
SHOWN = frozenset((*STATES, t.EVENT, t.IMAGE))
_NO_TURN = (0.0,) * 3


class Ros2Scene:
    """Turns messages of a flight into those of ROS 2; stamps are Unix nanoseconds. Frames: world, robots, cameras."""

    def __init__(self, codec: Ros2Codec, field: ResolvedField | None) -> None:
        self._codec, self._build, self._stencils = codec, Builder(codec), Stencils(codec)
        self._health, self._view = HealthMaker(codec), ViewScene(field)
        self._markers = MarkerScene(codec, self._view)
        self._pictures = PictureMaker(codec, field.calibrations if field is not None else {})

    def static(self, stamp_ns: int) -> RosMessage:
        """Return the frames that do not move; to be repeated for later subscribers."""
        frames = [
            self._build.transform(
                stamp_ns, (frame.parent, frame.child), frame.position_m, self._build.quaternion(frame.rotation_wxyz)
            )
            for frame in self._view.cameras
        ]
        return self._codec.message("/tf_static", FRAMES.type, transforms=frames)

    def take(self, stamp_ns: int, message: m.Message) -> list[RosMessage]:
        """Return the ROS 2 messages for a message of SHOWN; a plan is drawn with the next estimate."""
        match message:
            case m.Estimate():
                return self._estimate(stamp_ns, message)
            case m.Plan():
                self._markers.take(message)
                return []
            case m.VelocitySetpoint():
                return [self._setpoint(stamp_ns, message)]
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
        """Return a picture, and its lens if the field is known."""
        return self._pictures.picture(stamp_ns, camera, jpeg)

    def _estimate(self, stamp_ns: int, estimate: m.Estimate) -> list[RosMessage]:
        bodies = self._view.take_estimate(estimate)
        if not bodies:
            return []
        places = {body.name: (*body.position_m, *heading_xyzw(body.yaw_rad)) for body in bodies}
        found = [self._stencils.filled("/tf", FRAMES, stamp_ns, places)]
        for entity in estimate.entities:
            found += self._entity(stamp_ns, entity, places[entity.name])
        return found + self._markers.drawn(stamp_ns, bodies)

    def _entity(self, stamp_ns: int, entity: m.EntityEstimate, place: tuple[float, ...]) -> list[RosMessage]:
        name, filled = entity.name, self._stencils.filled
        sure = (*place, *covariance_36(entity))
        moving = (*velocity_ahead(entity), *_NO_TURN, *velocity_covariance_36(entity))
        return [
            filled(own(f"{name}/pose"), SURE_POSE, stamp_ns, {name: sure}),
            filled(own(f"{name}/odom"), ODOMETRY, stamp_ns, {name: sure + moving}),
        ]

    def _setpoint(self, stamp_ns: int, setpoint: m.VelocitySetpoint) -> RosMessage:
        self._markers.take(setpoint)
        name = setpoint.header.entity
        velocity = (*setpoint.velocity_m_s, 0.0, 0.0, setpoint.yaw_rate_rad_s)
        return self._stencils.filled(own(f"{name}/setpoint"), TWIST, stamp_ns, {name: velocity})

    def _truth(self, stamp_ns: int, truth: m.TruthState) -> RosMessage:
        name = truth.header.entity
        place = (*truth.position_m, *attitude_xyzw(truth.attitude_rad))
        return self._stencils.filled(own(f"{name}/truth"), POSE, stamp_ns, {name: place})
