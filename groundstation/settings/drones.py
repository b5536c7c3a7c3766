"""Settings of one drone: address, limits, marker, camera, errors of its own sensors."""

import math
from typing import Annotated, Literal, Never, get_args

from pydantic import Field

from groundstation.errors import SettingsError
from groundstation.settings.marker import MarkerSettings
from groundstation.settings.room import CalibrationSettings
from groundstation.settings.values import Address, OnVehicle, SettingsSection, Source, Vector2, VideoDelay

VehicleKind = Literal["ardrone", "mavlink"]
StdDeviation = Annotated[float, Field(gt=0, le=10)]
Delay = Annotated[float, Field(ge=0, le=1000)]


class LimitSettings(SettingsSection):
    """What a drone is never commanded to exceed, and when its battery makes it land."""

    max_speed_m_s: Annotated[float, Field(gt=0, le=3)] = 0.6
    """Largest horizontal speed [m/s] that is commanded."""
    max_climb_m_s: Annotated[float, Field(gt=0, le=1.5)] = 0.4
    """Largest vertical speed [m/s] that is commanded, up or down."""
    max_yaw_rate_deg_s: Annotated[float, Field(gt=0, le=180)] = 60.0
    """Largest yaw rate [deg/s] that is commanded."""
    max_tilt_deg: Annotated[float, Field(ge=3, le=25)] = 12.0
    """Largest tilt [deg] that the drone may use."""
    battery_min: Annotated[float, Field(ge=0.05, le=0.9)] = 0.15
    """Share of the full charge below which the drone lands."""
    battery_hold_s: Annotated[float, Field(ge=0, le=30)] = 3.0
    """Time [s] for which the charge must stay below battery_min before the drone lands, so that a short dip does not
    end the flight."""

    @property
    def max_yaw_rate_rad_s(self) -> float:
        """Return the largest turn rate [rad/s]."""
        return math.radians(self.max_yaw_rate_deg_s)

    @property
    def max_tilt_rad(self) -> float:
        """Return the largest tilt [rad]."""
        return math.radians(self.max_tilt_deg)


class RobotMarker(MarkerSettings):
    """The marker flat on top of a drone, its bar towards the nose."""

    position_m: OnVehicle = (0.0, 0.0, 0.08)
    """Centre of the marker [m; base: x forward, y left, z up]."""


class OnboardCameraSettings(SettingsSection):
    """The camera that a drone carries: source, lens, mounting."""

    source: Source
    """Where the images come from: http://, rtsp:// or ardrone:// address, /dev/videoN, video file or folder of images.
    """
    calibration: CalibrationSettings
    """Lens calibration: the name of a file beside the field file, or its content."""
    position_m: OnVehicle = (0.0, 0.0, 0.0)
    """Optical centre of the camera [m; base]."""
    tilt_down_deg: Annotated[float, Field(ge=-90, le=90)] = 45.0
    """Angle [deg] of the optical axis below the horizon."""
    pan_left_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0
    """Angle [deg] of the optical axis to the left of straight ahead."""
    video_delay_ms: VideoDelay = 120.0
    """Median time [ms] from the exposure of an image to its arrival. Measure it: groundstation calibrate delay."""

    @property
    def tilt_down_rad(self) -> float:
        """Return the tilt below the horizon [rad]."""
        return math.radians(self.tilt_down_deg)

    @property
    def pan_left_rad(self) -> float:
        """Return the pan to the left [rad]."""
        return math.radians(self.pan_left_deg)


class OdometryCalibration(SettingsSection):
    """Errors and delays of the vehicle's own sensors, measured on this kind of vehicle; deviations are one sigma."""

    velocity_scale: Annotated[float, Field(ge=0.2, le=5)] = 1.0
    """True velocity divided by reported velocity."""
    velocity_std_m_s: StdDeviation = 0.05
    """Standard deviation [m/s] of the velocity after scaling, per axis. The filter takes 60 % of it for an error that
    lasts longer than the interval between images."""
    velocity_delay_ms: Delay = 30.0
    """Age [ms] of a velocity when it arrives."""
    height_std_m: StdDeviation = 0.04
    """Standard deviation [m] of the reported height."""
    height_delay_ms: Delay = 85.0
    """Age [ms] of a height when it arrives."""
    attitude_std_deg: StdDeviation = 1.0
    """Standard deviation [deg] of roll and of pitch as the vehicle reports them. An AR.Drone's are found by its IMU,
    with an error of their own, as long as it publishes one."""
    yaw_rate_std_deg_s: StdDeviation = 1.0
    """Standard deviation [deg/s] of the yaw rate as the vehicle reports it; of an AR.Drone's IMU as above."""

    @property
    def attitude_std_rad(self) -> float:
        """Return the error of roll and pitch [rad]."""
        return math.radians(self.attitude_std_deg)


class ArDroneVideo(SettingsSection):
    """Video settings that are written to an AR.Drone."""

    codec: Literal["h264_360p", "h264_720p"] = "h264_360p"
    """Video that the drone sends over TCP 5555: 640x360 or 1280x720 pixels. The calibration must have the same size."""
    channel: Literal["front", "bottom"] = "front"
    """Which of the drone's cameras sends."""
    bitrate: Annotated[int, Field(ge=250, le=4000)] | None = None
    """Constant bit rate [kbit/s]; none: the drone chooses."""


class Mavlink(SettingsSection):
    """A MAVLink vehicle and the link to it.

    By default the driver opens the link to address:port over UDP; `listen` and `serial` replace that.
    """

    flavour: Literal["px4", "ardupilot"]
    """The autopilot's firmware; the driver refuses a vehicle that reports another one."""
    system_id: Annotated[int, Field(ge=1, le=250)]
    """MAVLink system id of the vehicle; each its own."""
    link: Literal["pymavlink", "mavsdk"] = "pymavlink"
    """Library on our side of the link. Signed links need pymavlink."""
    port: Annotated[int, Field(ge=1024, le=65535)] = 14550
    """UDP port: the vehicle's, or ours with listen."""
    listen: bool = False
    """true: the vehicle opens the connection to local_address:port. Vehicles that share a port share one driver
    process. When the driver is dead, others speak to the vehicle from another port than the one it called."""
    local_address: Address = "0.0.0.0"
    """IPv4 address that the driver listens on, with listen."""
    serial: Annotated[str, Field(pattern=r"^(/dev/[^:]+:\d+)?$")] = ""
    """Serial radio DEVICE:BAUD instead of UDP, such as /dev/ttyUSB0:57600; empty: UDP."""
    key_file: str = ""
    """File with the signing key (32 bytes, or 64 hex digits), kept outside the field file; empty: frames are not
    signed."""
    take_off_m: Annotated[float, Field(ge=0.4, le=3)] = 0.8
    """Height [m] that a take-off climbs to."""
    vision_hz: Annotated[float, Field(ge=5, le=50)] = 30.0
    """Rate [Hz] at which the vehicle's position estimate is sent to its autopilot."""
    parameters: dict[Annotated[str, Field(pattern=r"^[A-Z][A-Z0-9_]{0,15}$")], float] = Field(default={})
    """Parameters of the autopilot that this drone needs otherwise than `groundstation mavlink setup` proposes, or
    besides, by name; the driver warns of the former."""
    forward: Annotated[str, Field(pattern=r"^(udp:\d{1,3}(\.\d{1,3}){3}:\d{1,5})?$")] = ""
    """A second ground station that sees the vehicle, such as udp:127.0.0.1:14550 for QGroundControl. It may stop the
    vehicle and ask it questions, never fly it. Empty: none."""
    forward_allows: tuple[Literal["parameters", "missions"], ...] = ()
    """What that ground station may read and write besides."""


class Drone(SettingsSection):
    """One drone with all three levels merged."""

    kind: VehicleKind
    """Which driver flies it."""
    mavlink: Mavlink | None = None
    """How a MAVLink vehicle is reached; required for kind: mavlink, refused for others."""
    video: ArDroneVideo | None = None
    """Video settings written to an AR.Drone at start; without this section the drone keeps its own."""
    enabled: bool = True
    """false: the drone stays out of the run but keeps its entry in the file."""
    address: Address
    """IPv4 address of the vehicle; each its own."""
    serial_number: Annotated[str, Field(pattern=r"^[A-Za-z0-9-]{0,40}$")] = ""
    """Serial number of the vehicle (of a MAVLink one: its uid2, else uid): another one at its address does not take
    off. groundstation ardrone probe and mavlink probe show it."""
    limits: LimitSettings = LimitSettings()
    """What the drone is never commanded to exceed, and when its battery makes it land."""
    marker: RobotMarker
    """The marker on top of the drone, by which cameras recognise it."""
    camera: OnboardCameraSettings
    """The camera that the drone carries."""
    odometry: OdometryCalibration = OdometryCalibration()
    """Measured errors and delays of the vehicle's own sensors."""
    pad_m: Vector2
    """Where the drone takes off [x, y in m; world], inside the fence; at least safety.min_separation_m from the other
    pads."""
    pad_yaw_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0
    """Heading [deg, counter-clockwise; world] of the drone on its pad."""

    @property
    def pad_yaw_rad(self) -> float:
        """Return the heading on the pad [rad; world]."""
        return math.radians(self.pad_yaw_deg)

    def require_mavlink(self) -> Mavlink:
        """Return how the vehicle is met; raises SettingsError where nothing says so."""
        if self.mavlink is None:
            raise SettingsError([f"kind: {self.kind} has no mavlink section"])
        return self.mavlink


def unknown_kind(kind: Never) -> SettingsError:
    """Return the refusal of a kind of vehicle that a choice between kinds left out.

    A kind that exists is no `Never`: mypy shows each choice that a new kind must be added to.
    """
    return SettingsError([f"kind: {kind} is not known; known: {', '.join(get_args(VehicleKind))}"])
