"""Layouts of the options about the drone's surroundings and its own condition. WIRE: docs/reference/ardrone.md 4.4."""

from typing import Any, NamedTuple

from drivers.ardrone.wire.layout import OptionLayout
from drivers.ardrone.wire.tags import Tag

_Triple = tuple[float, float, float]
_ZEROS: _Triple = (0.0, 0.0, 0.0)


class ControlLoopCounter(NamedTuple):
    """Counter of the control loop (real drones: 4822, 4999)."""

    value: int = 0


class AdcDataFrame(NamedTuple):
    """Version and raw frame of the converter board."""

    version: int = 0
    frame: bytes = bytes(32)


class PressureRaw(NamedTuple):
    """Barometer: counts, temperature [0.1 degC], pressure [Pa]."""

    pressure_lsb: int = 0
    temperature_lsb: int = 0
    temperature_decidegree: int = 250
    pressure_pa: int = 101325


class Magneto(NamedTuple):
    """Magnetometer counts, fields [mG] and headings [deg, clockwise]; heading_fusion equals DEMO psi / 1000."""

    counts: tuple[int, int, int] = (0, 0, 0)
    raw_mg: _Triple = _ZEROS
    rectified_mg: _Triple = _ZEROS
    offset_mg: _Triple = _ZEROS
    heading_deg: float = 0.0
    heading_gyro_deg: float = 0.0
    heading_fusion_deg: float = 0.0
    calibrated: int = 1
    state: int = 0
    radius_mg: float = 0.0
    error_mean: float = 0.0
    error_variance: float = 0.0


class Wind(NamedTuple):
    """Wind estimate, the compensation angles made of it, and the estimator's state."""

    speed_m_s: float = 0.0
    angle: float = 0.0
    theta_compensation_rad: float = 0.0
    phi_compensation_rad: float = 0.0
    states: tuple[float, float, float, float, float, float] = (0.0,) * 6
    magneto_debug: _Triple = _ZEROS


class KalmanPressure(NamedTuple):
    """Altitude filter of barometer and ultrasound: height [mm], climb [m/s], biases, covariances."""

    offset_pressure_pa: float = 0.0
    height_mm: float = 0.0
    climb_m_s: float = 0.0
    bias_pwm: float = 0.0
    bias_pressure_pa: float = 0.0
    offset_ultrasound_m: float = 0.0
    predicted_ultrasound_mm: float = 0.0
    height_covariance: float = 0.0
    pwm_covariance: float = 0.0
    speed_covariance: float = 0.0
    ground_effect: int = 0
    innovation_sum_mm: float = 0.0
    ultrasound_rejected: int = 0
    multisinus: float = 0.0
    climb_altitude: float = 0.0
    multisinus_flag: int = 0
    multisinus_start_flag: int = 0


class Wifi(NamedTuple):
    """Link quality as raw bits."""

    link_quality: int = 0


class Zimmu3000(NamedTuple):
    """Option 27 as it was before it became GPS."""

    vz_lsb: int = 0
    vz: float = 0.0


class Gps(NamedTuple):
    """Flight recorder's GPS: position [deg, m], dilutions, controller terms, satellites (number, C/N0 in turn)."""

    latitude_deg: float = 0.0
    longitude_deg: float = 0.0
    elevation_m: float = 0.0
    hdop: float = 0.0
    available: int = 0
    zero_validated: int = 0
    waypoint_validated: int = 0
    latitude_0_deg: float = 0.0
    longitude_0_deg: float = 0.0
    latitude_fused_deg: float = 0.0
    longitude_fused_deg: float = 0.0
    state: int = 0
    controller: tuple[float, ...] = (0.0,) * 10
    vdop: float = 0.0
    pdop: float = 0.0
    speed: float = 0.0
    last_frame_timestamp: int = 0
    degree: float = 0.0
    degree_magnetic: float = 0.0
    ehpe: float = 0.0
    ehve: float = 0.0
    c_n0: float = 0.0
    satellites: int = 0
    channels: tuple[int, ...] = (0,) * 24
    plugged: int = 0
    ephemeris_status: int = 0
    vx: float = 0.0
    vy: float = 0.0
    firmware_status: int = 0


WATCHDOG = OptionLayout(Tag.WATCHDOG, ControlLoopCounter, "i")
ADC_DATA_FRAME = OptionLayout(Tag.ADC_DATA_FRAME, AdcDataFrame, "I 32s")
PRESSURE_RAW = OptionLayout(Tag.PRESSURE_RAW, PressureRaw, "i h i i")
MAGNETO = OptionLayout(Tag.MAGNETO, Magneto, "3h 3f 3f 3f f f f B I f f f")
WIND = OptionLayout(Tag.WIND, Wind, "f f f f 6f 3f")
KALMAN_PRESSURE = OptionLayout(Tag.KALMAN_PRESSURE, KalmanPressure, "f f f f f f f f f f I f I f f I I")
WIFI = OptionLayout(Tag.WIFI, Wifi, "I")
# WIRE: one number, two meanings: 12 bytes before firmware 2.4, GPS from then on.
ZIMMU_3000 = OptionLayout(Tag.GPS, Zimmu3000, "i f", exact=True)
GPS = OptionLayout(Tag.GPS, Gps, "d d d d i i i d d d d I 10f d d f I f f f f f I 24B i I f f I", newer=True)

AMBIENT_LAYOUTS: tuple[OptionLayout[Any], ...] = (
    WATCHDOG, ADC_DATA_FRAME, PRESSURE_RAW, MAGNETO, WIND, KALMAN_PRESSURE, WIFI, ZIMMU_3000, GPS,
)  # fmt: skip
