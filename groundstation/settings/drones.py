"""Settings of one drone: address, limits, marker, camera, errors of its own sensors."""

import math
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AfterValidator, Field, create_model
from pydantic_core import PydanticCustomError, PydanticKnownError

from drivers.camera.source_address import behind_adapter, parse_source
from drivers.vehicle_settings import Shape
from groundstation import plug_ins
from groundstation.settings.marker import MarkerSettings
from groundstation.settings.room import CalibrationSettings
from groundstation.settings.values import (
    Address,
    HostName,
    OnVehicle,
    Readout,
    SettingsSection,
    Source,
    Vector2,
    VideoDelay,
)
from groundstation.vehicles import KindSection, all_kinds, kind_named, refused_kinds

StdDeviation = Annotated[float, Field(gt=0, le=10)]
Delay = Annotated[float, Field(ge=0, le=1000)]
_ADAPTER = Shape(
    r"^[A-Za-z0-9_.-]{0,15}$", "must be a network adapter such as wlan1 (letters, digits, _.-; 15 at most)"
)
_SERIAL_NUMBER = Shape(r"^[A-Za-z0-9-]{0,40}$", "must be a serial number (letters, digits and -; 40 at most)")


class LimitSettings(SettingsSection):
    """Limits that no command to a drone exceeds, and the charge at which it lands."""

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
    """Where the pictures come from: http://, rtsp://, ros2://, ardrone:// or tello:// address, /dev/videoN, video file
    or folder of pictures."""
    calibration: CalibrationSettings
    """Lens calibration: the name of a file beside the field file, or its content."""
    position_m: OnVehicle = (0.0, 0.0, 0.0)
    """Optical centre of the camera [m; base]."""
    tilt_down_deg: Annotated[float, Field(ge=-90, le=90)] = 45.0
    """Angle [deg] of the optical axis below the horizon."""
    pan_left_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0
    """Angle [deg] of the optical axis to the left of straight ahead."""
    attitude_std_deg: Annotated[float, Field(ge=0, le=10)] = 0.0
    """Standard deviation [deg] of the camera's attitude on the drone; 0: it is exactly as said. Simulated cameras are
    off by it; for the filter it is part of the odometry's attitude_std_deg."""
    position_std_m: Annotated[float, Field(ge=0, le=0.2)] = 0.0
    """Standard deviation [m] of the camera's position on the drone; 0: it is exactly as said. Simulated cameras are off
    by it."""
    video_delay_ms: VideoDelay = 120.0
    """Median time [ms] from the exposure of a picture to its arrival. Measure it: groundstation calibrate delay."""
    readout_ms: Readout = 0.0
    """Time [ms] from the exposure of a picture's first row to that of its last (rolling shutter), as its data sheet has
    it: a marker's time is that of its row; 0: all at once. A picture's own time is that of its middle row."""

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
    lasts longer than the interval between pictures."""
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


def _is_kind(name: str) -> str:
    known = [f"'{one}'" for one in all_kinds()]
    if name in refused_kinds() and name not in all_kinds():
        raise PydanticCustomError("kind", "cannot be used: {why}", {"why": refused_kinds()[name]})
    if f"'{name}'" not in known:
        if why := plug_ins.damage():
            raise PydanticCustomError("kind", "is not known (got {name}){why}", {"name": name, "why": why})
        raise PydanticKnownError("literal_error", {"expected": " or ".join((", ".join(known[:-1]), known[-1]))})
    return name


class DroneOfAnyKind(SettingsSection):
    """One drone with all three levels merged."""

    kind: Annotated[
        str, AfterValidator(_is_kind), Field(json_schema_extra=lambda schema: schema.update(enum=[*all_kinds()]))
    ]
    """Which driver flies it."""
    enabled: bool = True
    """false: the drone stays out of the run but keeps its entry in the file."""
    address: Address
    """IPv4 address of the vehicle; each its own, or behind an `interface` of its own."""
    interface: Annotated[str, _ADAPTER] = ""
    """Network adapter of this computer that leads to the vehicle, such as wlan1; its video at the same address is
    taken from there too. For vehicles that all have the same address, each behind an adapter of its own. Empty: as this
    computer's routes say."""
    host: HostName = ""
    """Name of the host that the vehicle's driver and its camera's run on, as the site admitted it (`groundstation site
    admit`); there: `groundstation host`. Empty: the host of the run."""
    serial_number: Annotated[str, _SERIAL_NUMBER] = ""
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

    @property
    def video_source(self) -> str:
        """Return the source of its camera, through the vehicle's adapter if it has the vehicle's own address."""
        source = parse_source(self.camera.source)
        same = source.host == self.address and not source.interface
        return behind_adapter(self.camera.source, self.interface) if self.interface and same else self.camera.source

    @property
    def sections(self) -> dict[str, KindSection]:
        """Return the given sections that only its kind has, by their keys."""
        keys = kind_named(self.kind).sections
        return {key: section for key in keys if isinstance(section := getattr(self, key, None), KindSection)}


def _with_sections_of_kinds() -> type[DroneOfAnyKind]:
    sections: dict[str, Any] = {
        key: (model | None, Field(default=None, description=f"Only for kind: {kind.name}. {model.__doc__}"))
        for kind in all_kinds().values()
        for key, model in kind.sections.items()
    }
    return create_model(
        "Drone", __base__=DroneOfAnyKind, __module__=__name__, __doc__=DroneOfAnyKind.__doc__, **sections
    )


if TYPE_CHECKING:
    Drone = DroneOfAnyKind
else:
    # Kinds are known only at run time: each brings its own sections.
    Drone = _with_sections_of_kinds()
