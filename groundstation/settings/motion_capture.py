"""Settings of motion capture systems."""

from typing import Annotated, Literal

from pydantic import Field

from drivers.motion_capture.settings import parse_source
from groundstation.settings.values import HostName, Interval, Name, OnVehicle, SettingsSection, Vector3, read_by

Heading = Annotated[float, Field(ge=-180, le=180)]


class RigidBodySettings(SettingsSection):
    """A motion capture system's body on a drone or target: its name in the system, and where it sits."""

    name: Annotated[str, Field(max_length=100)] = ""
    """The body's name in the system; empty: that of the drone or target."""
    position_m: OnVehicle = (0.0, 0.0, 0.0)
    """The body's origin [m; base]; on a target from the floor below its centre."""
    yaw_deg: Heading = 0.0
    """Heading [deg] of the body's x axis on the drone or target, counter-clockwise."""


class VolumeSettings(SettingsSection):
    """The box in which a system sees bodies [m; world]."""

    x_m: Interval
    """Lower and upper limit along x [m; world]."""
    y_m: Interval
    """Lower and upper limit along y [m; world]."""
    z_m: Interval
    """Lower and upper limit of the height [m; world]."""


class MotionCaptureSettings(SettingsSection):
    """A motion capture system: a sensor that is fixed in the world, as cameras are."""

    source: Annotated[str, read_by(parse_source)]
    """Where it listens: natnet:// (OptiTrack's Motive), vicon://, qualisys:// or vrpn:// with its host; or ros2:// with
    the host of a ROS 2 Zenoh router and a path, for topics /PATH/BODY/pose; or the scheme of an installed plug-in
    (entry point `skein.world_sensors`)."""
    host: HostName = ""
    """Name of the host that listens to it, as the site admitted it. Empty: the host of the run."""
    volume_m: VolumeSettings
    """The box in which it sees bodies [m; world]. The planner counts on it; poses outside of it are not used."""
    bodies: dict[Name, RigidBodySettings] = Field(default_factory=dict)
    """Its bodies by drone or target, where their names or places are not those of the drone or target itself."""
    observes: Annotated[tuple[Literal["robots", "targets"], ...], Field(min_length=1)] = ("robots",)
    """What it may report to the tracker; as truth (see truth) it reports all to the recording and none to the
    tracker."""
    up: Literal["y", "z"] = "z"
    """Its vertical axis. Motive sends y unless its streaming settings say z."""
    position_m: Vector3 = (0.0, 0.0, 0.0)
    """Its origin [m; world]."""
    yaw_deg: Heading = 0.0
    """Heading [deg; world] of its x axis, counter-clockwise."""
    delay_ms: Annotated[float, Field(ge=0, le=500)] = 5.0
    """Time [ms] from exposure to arrival; with NatNet only that of the network, since it reports its own processing
    time."""
    rate_hz: Annotated[float, Field(ge=1, le=200)] = 30.0
    """Poses per second that are used."""
    pose_std_m: Annotated[float, Field(gt=0, le=0.5)] = 0.003
    """Standard deviation [m] of a position, per axis."""
    heading_std_deg: Annotated[float, Field(gt=0, le=30)] = 1.0
    """Standard deviation [deg] of a heading."""
    attitude_std_deg: Annotated[float, Field(gt=0, le=10)] = 0.1
    """Standard deviation [deg] of its axes in the world: its ground plane and heading."""
    position_std_m: Annotated[float, Field(gt=0, le=0.5)] = 0.005
    """Standard deviation [m] of its origin in the world."""
