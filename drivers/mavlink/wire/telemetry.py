"""Telemetry messages, field by field in the order of the dialect; units are MAVLink's, frames NED and FRD."""

from typing import NamedTuple

from drivers.mavlink.wire.names import ACTIVE, GCS_TYPE, NO_AUTOPILOT

Floats = tuple[float, ...]


class Heartbeat(NamedTuple):
    """A vehicle's presence and mode; the meaning of custom_mode depends on the autopilot (names.py)."""

    type: int
    autopilot: int
    base_mode: int
    custom_mode: int
    system_status: int
    mavlink_version: int = 3


OUR_HEARTBEAT = Heartbeat(GCS_TYPE, NO_AUTOPILOT, 0, 0, ACTIVE)


class SysStatus(NamedTuple):
    """Health bits, battery [mV, cA, %]."""

    onboard_control_sensors_present: int
    onboard_control_sensors_enabled: int
    onboard_control_sensors_health: int
    load: int = 0
    voltage_battery: int = 65535
    current_battery: int = -1
    battery_remaining: int = -1
    drop_rate_comm: int = 0
    errors_comm: int = 0
    errors_count1: int = 0
    errors_count2: int = 0
    errors_count3: int = 0
    errors_count4: int = 0
    onboard_control_sensors_present_extended: int = 0
    onboard_control_sensors_enabled_extended: int = 0
    onboard_control_sensors_health_extended: int = 0


class ExtendedSysState(NamedTuple):
    """landed_state: 0 unknown, 1 on ground, 2 in air, 3 take-off, 4 landing."""

    vtol_state: int
    landed_state: int


class LocalPositionNed(NamedTuple):
    """Estimated position [m] and velocity [m/s], NED about the estimator's origin."""

    time_boot_ms: int
    x: float
    y: float
    z: float
    vx: float
    vy: float
    vz: float


class Attitude(NamedTuple):
    """Roll, pitch, yaw [rad; FRD in NED] and body rates [rad/s]."""

    time_boot_ms: int
    roll: float
    pitch: float
    yaw: float
    rollspeed: float
    pitchspeed: float
    yawspeed: float


class AttitudeQuaternion(NamedTuple):
    """Rotation NED from FRD, w x y z, and body rates [rad/s]."""

    time_boot_ms: int
    q1: float
    q2: float
    q3: float
    q4: float
    rollspeed: float
    pitchspeed: float
    yawspeed: float
    repr_offset_q: Floats = (0.0, 0.0, 0.0, 0.0)


class HighresImu(NamedTuple):
    """Accelerometer [m/s^2], gyro [rad/s], magnetometer [gauss]; FRD."""

    time_usec: int
    xacc: float
    yacc: float
    zacc: float
    xgyro: float
    ygyro: float
    zgyro: float
    xmag: float = 0.0
    ymag: float = 0.0
    zmag: float = 0.0
    abs_pressure: float = 0.0
    diff_pressure: float = 0.0
    pressure_alt: float = 0.0
    temperature: float = 0.0
    fields_updated: int = 63
    id: int = 0


class RawImu(NamedTuple):
    """Accelerometer [mG], gyro [mrad/s], magnetometer [mgauss]; FRD. WIRE: units as ArduPilot fills them."""

    time_usec: int
    xacc: int
    yacc: int
    zacc: int
    xgyro: int
    ygyro: int
    zgyro: int
    xmag: int = 0
    ymag: int = 0
    zmag: int = 0
    id: int = 0
    temperature: int = 0


class BatteryStatus(NamedTuple):
    """battery_remaining [%], -1 unknown."""

    id: int
    battery_function: int
    type: int
    temperature: int
    voltages: tuple[int, ...]
    current_battery: int
    current_consumed: int
    energy_consumed: int
    battery_remaining: int
    time_remaining: int = 0
    charge_state: int = 0
    voltages_ext: tuple[int, ...] = (0, 0, 0, 0)
    mode: int = 0
    fault_bitmask: int = 0


class EkfStatusReport(NamedTuple):
    """ArduPilot: flags of the quantities that the estimator delivers."""

    flags: int
    velocity_variance: float
    pos_horiz_variance: float
    pos_vert_variance: float
    compass_variance: float
    terrain_alt_variance: float
    airspeed_variance: float = 0.0


class EstimatorStatus(NamedTuple):
    """PX4: flags, test ratios of innovations (beyond 1 they are refused), accuracies [m]."""

    time_usec: int
    flags: int
    vel_ratio: float
    pos_horiz_ratio: float
    pos_vert_ratio: float
    mag_ratio: float
    hagl_ratio: float
    tas_ratio: float
    pos_horiz_accuracy: float
    pos_vert_accuracy: float


class HomePosition(NamedTuple):
    """Where it took off: degrees x 1e7, mm, and NED [m]."""

    latitude: int
    longitude: int
    altitude: int
    x: float
    y: float
    z: float
    q: Floats
    approach_x: float
    approach_y: float
    approach_z: float
    time_usec: int = 0


class GpsGlobalOrigin(NamedTuple):
    """Place of the estimator's origin: degrees x 1e7, mm."""

    latitude: int
    longitude: int
    altitude: int
    time_usec: int = 0


class Statustext(NamedTuple):
    """A line for the operator; severity 0 emergency .. 7 debug."""

    severity: int
    text: str
    id: int = 0
    chunk_seq: int = 0


class AutopilotVersion(NamedTuple):
    """Firmware and capabilities of an autopilot."""

    capabilities: int
    flight_sw_version: int
    middleware_sw_version: int = 0
    os_sw_version: int = 0
    board_version: int = 0
    flight_custom_version: tuple[int, ...] = (0,) * 8
    middleware_custom_version: tuple[int, ...] = (0,) * 8
    os_custom_version: tuple[int, ...] = (0,) * 8
    vendor_id: int = 0
    product_id: int = 0
    uid: int = 0
    uid2: tuple[int, ...] = (0,) * 18


class VideoStreamInformation(NamedTuple):
    """Where a camera's pictures are served."""

    stream_id: int
    count: int  # type: ignore[assignment]
    type: int
    flags: int
    framerate: float
    resolution_h: int
    resolution_v: int
    bitrate: int
    rotation: int
    hfov: int
    name: str
    uri: str
    encoding: int = 0
    camera_device_id: int = 0
