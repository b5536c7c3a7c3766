"""Motion and observation models, one file each; `protocol.py` is their interface."""

from groundstation.estimation.models.camera import MountedCamera
from groundstation.estimation.models.commanded_robot import CommandedRobot
from groundstation.estimation.models.constant_velocity import ConstantVelocityTarget
from groundstation.estimation.models.coordinated_turn import CoordinatedTurnTarget
from groundstation.estimation.models.fixed_mount import FixedMount
from groundstation.estimation.models.heading import HeadingSensor
from groundstation.estimation.models.landmark import Landmark
from groundstation.estimation.models.manoeuvring import ManoeuvringTarget
from groundstation.estimation.models.odometry_robot import OdometryRobot
from groundstation.estimation.models.protocol import DrivenModel, MotionModel, ObservationModel, SwitchingModel
from groundstation.estimation.models.range_bearing import RangeBearingSensor
from groundstation.estimation.models.ranging import Anchor, RangeSensor
from groundstation.estimation.models.reported_velocity import ReportedVelocity

__all__ = [
    "Anchor",
    "CommandedRobot",
    "ConstantVelocityTarget",
    "CoordinatedTurnTarget",
    "DrivenModel",
    "FixedMount",
    "HeadingSensor",
    "Landmark",
    "ManoeuvringTarget",
    "MotionModel",
    "MountedCamera",
    "ObservationModel",
    "OdometryRobot",
    "RangeBearingSensor",
    "RangeSensor",
    "ReportedVelocity",
    "SwitchingModel",
]
