"""Layouts of the navdata options, as one table of formats.

A layout covers the part of an option that all known firmwares share; what follows is surplus on decode and zeros on
encode. WIRE: offsets from the Parrot SDK 2.0.1 headers, units from recordings of real drones (AR.Drone sheet 4.4).
"""

from enum import IntEnum
from typing import Any, NamedTuple

from drivers.ardrone.wire.layout import Layout

Triple = tuple[float, float, float]
Quad = tuple[int, int, int, int]
_ZEROS: Triple = (0.0, 0.0, 0.0)


class Tag(IntEnum):
    """Numbers of the options, in their order on the wire."""

    DEMO = 0
    TIME = 1
    RAW_MEASURES = 2
    PHYS_MEASURES = 3
    GYROS_OFFSETS = 4
    EULER_ANGLES = 5
    REFERENCES = 6
    TRIMS = 7
    RC_REFERENCES = 8
    PWM = 9
    ALTITUDE = 10
    VISION_RAW = 11
    VISION_OF = 12
    VISION = 13
    VISION_PERF = 14
    TRACKERS_SEND = 15
    VISION_DETECT = 16
    WATCHDOG = 17
    ADC_DATA_FRAME = 18
    VIDEO_STREAM = 19
    GAMES = 20
    PRESSURE_RAW = 21
    MAGNETO = 22
    WIND = 23
    KALMAN_PRESSURE = 24
    HDVIDEO_STREAM = 25
    WIFI = 26
    GPS = 27
    CHECKSUM = 0xFFFF


class Demo(NamedTuple):
    """Attitude (theta nose up, phi right side down, psi clockwise) [mdeg], altitude, body-yaw velocity (FRD)."""

    control_state: int = 2 << 16
    battery_percent: int = 100
    theta_mdeg: float = 0.0
    phi_mdeg: float = 0.0
    psi_mdeg: float = 0.0
    altitude_mm: int = 0
    vx_mm_s: float = 0.0
    vy_mm_s: float = 0.0
    vz_mm_s: float = 0.0
    num_frames: int = 0


class Time(NamedTuple):
    """Time since power-on: 11 bits of seconds above 21 bits of microseconds; wraps after 2048 s."""

    bits: int = 0

    @property
    def seconds(self) -> float:
        """Return the time in [0, 2048) s."""
        return (self.bits >> 21) + (self.bits & 0x1FFFFF) * 1e-6

    @classmethod
    def from_seconds(cls, seconds: float) -> "Time":
        """Return the wire form of a time, wrapped."""
        whole = int(seconds)
        return cls((whole % 2048) << 21 | int((seconds - whole) * 1e6))


class RawMeasures(NamedTuple):
    """Raw sensor counts, battery voltage and ultrasound echoes."""

    accelerometers: tuple[int, int, int] = (2040, 2040, 2528)
    gyros: tuple[int, int, int] = (0, 0, 0)
    gyros_110: tuple[int, int] = (0, 0)
    battery_mv: int = 11800
    us_start_echo: int = 0
    us_end_echo: int = 0
    us_association_echo: int = 3758
    us_distance_echo: int = 0
    us_curve_time: int = 0
    us_curve_value: int = 0
    us_curve_ref: int = 0
    echo_flag: int = 0


class PhysMeasures(NamedTuple):
    """Calibrated IMU: accelerations [mg], rates [deg/s], axes x forward, y right, z down (rest: z about -1000)."""

    accelerometer_temperature_c: float = 45.0
    gyro_temperature: int = 0
    accelerations_mg: Triple = (0.0, 0.0, -1000.0)
    rates_deg_s: Triple = _ZEROS
    supply_3v3: int = 0
    gyro_reference_epson: int = 0
    gyro_reference_idg: int = 0


class GyrosOffsets(NamedTuple):
    """Gyro offsets [deg/s]."""

    offsets_deg_s: Triple = _ZEROS


class EulerAngles(NamedTuple):
    """Attitude from the accelerometers alone [mdeg]."""

    theta_mdeg: float = 0.0
    phi_mdeg: float = 0.0


class References(NamedTuple):
    """Attitude controller references [mdeg, mdeg/s]."""

    theta_mdeg: int = 0
    phi_mdeg: int = 0
    theta_integral_mdeg: int = 0
    phi_integral_mdeg: int = 0
    pitch_mdeg_s: int = 0
    roll_mdeg_s: int = 0
    yaw_mdeg_s: int = 0
    psi_mdeg: int = 0


class Trims(NamedTuple):
    """Trims [rad/s, rad]."""

    yaw_rate: float = 0.0
    theta: float = 0.0
    phi: float = 0.0


class Pwm(NamedTuple):
    """Motor commands 0..255 (saturation limit 255 at rest) and the controller terms behind them."""

    motors: Quad = (0, 0, 0, 0)
    saturation: Quad = (255, 255, 255, 255)
    climb_feed_forward: float = 0.0
    climb_altitude: float = 0.0
    altitude_integral: float = 0.0
    vz_reference_mm_s: float = 0.0
    pitch: int = 0
    roll: int = 0
    yaw: int = 0
    yaw_integral: float = 0.0
    pitch_planned: int = 0
    roll_planned: int = 0
    yaw_planned: int = 0
    climb_planned: float = 0.0
    currents_ma: Quad = (0, 0, 0, 0)


class Altitude(NamedTuple):
    """Altitude estimator: fused [mm], climb [mm/s], reference and raw ultrasound [mm]."""

    vision_mm: int = 0
    vz_mm_s: float = 0.0
    reference_mm: int = 0
    raw_mm: int = 0
    observed_acceleration_m_s2: float = 0.0
    observed_altitude_m: float = 0.0
    observer_x: Triple = _ZEROS
    observer_state: int = 0
    estimated_vb: tuple[float, float] = (0.0, 0.0)
    estimator_state: int = 0


class VisionDetect(NamedTuple):
    """Up to four tags: picture position 0..1000, distance [cm], orientation [deg]."""

    detected: int = 0
    types: Quad = (0, 0, 0, 0)
    x: Quad = (0, 0, 0, 0)
    y: Quad = (0, 0, 0, 0)
    width: Quad = (0, 0, 0, 0)
    height: Quad = (0, 0, 0, 0)
    distance_cm: Quad = (0, 0, 0, 0)


class PressureRaw(NamedTuple):
    """Barometer: counts, temperature [0.1 degC], pressure [Pa]."""

    pressure_lsb: int = 0
    temperature_lsb: int = 0
    temperature_decidegree: int = 250
    pressure_pa: int = 101325


class Magneto(NamedTuple):
    """Magnetometer counts, fields [mG] and headings [deg, clockwise]; heading_fusion equals DEMO psi / 1000."""

    counts: tuple[int, int, int] = (0, 0, 0)
    raw_mg: Triple = _ZEROS
    rectified_mg: Triple = _ZEROS
    offset_mg: Triple = _ZEROS
    heading_deg: float = 0.0
    heading_gyro_deg: float = 0.0
    heading_fusion_deg: float = 0.0
    calibrated: int = 1
    state: int = 0
    radius_mg: float = 0.0
    error_mean: float = 0.0
    error_variance: float = 0.0


class Wind(NamedTuple):
    """Wind estimate and the compensation angles made of it."""

    speed_m_s: float = 0.0
    angle: float = 0.0
    theta_compensation_rad: float = 0.0
    phi_compensation_rad: float = 0.0


class Wifi(NamedTuple):
    """Link quality as raw bits."""

    link_quality: int = 0


DEMO = Layout(Tag.DEMO, Demo, "I I f f f i f f f I")
TIME = Layout(Tag.TIME, Time, "I")
RAW_MEASURES = Layout(Tag.RAW_MEASURES, RawMeasures, "3H 3h 2h I H H H H H H H H")
PHYS_MEASURES = Layout(Tag.PHYS_MEASURES, PhysMeasures, "f H 3f 3f I I I")
GYROS_OFFSETS = Layout(Tag.GYROS_OFFSETS, GyrosOffsets, "3f")
EULER_ANGLES = Layout(Tag.EULER_ANGLES, EulerAngles, "f f")
REFERENCES = Layout(Tag.REFERENCES, References, "i i i i i i i i")
TRIMS = Layout(Tag.TRIMS, Trims, "f f f")
PWM = Layout(Tag.PWM, Pwm, "4B 4B f f f f i i i f i i i f 4H")
ALTITUDE = Layout(Tag.ALTITUDE, Altitude, "i f i i f f 3f I 2f I")
VISION_DETECT = Layout(Tag.VISION_DETECT, VisionDetect, "I 4I 4I 4I 4I 4I 4I")
PRESSURE_RAW = Layout(Tag.PRESSURE_RAW, PressureRaw, "i h i i")
MAGNETO = Layout(Tag.MAGNETO, Magneto, "3h 3f 3f 3f f f f B I f f f")
WIND = Layout(Tag.WIND, Wind, "f f f f")
WIFI = Layout(Tag.WIFI, Wifi, "I")

LAYOUTS: tuple[Layout[Any], ...] = (
    DEMO, TIME, RAW_MEASURES, PHYS_MEASURES, GYROS_OFFSETS, EULER_ANGLES, REFERENCES, TRIMS,
    PWM, ALTITUDE, VISION_DETECT, PRESSURE_RAW, MAGNETO, WIND, WIFI,
)  # fmt: skip

# Sizes with the 4-byte head (AR.Drone sheet 4.3). Decoders must not rely on them: they differ between firmwares.
_AR2_2_3 = dict(
    zip(
        range(28),
        (
            148,
            8,
            52,
            46,
            16,
            12,
            88,
            16,
            24,
            76,
            56,
            16,
            44,
            92,
            108,
            364,
            328,
            8,
            40,
            65,
            12,
            18,
            75,
            56,
            72,
            32,
            8,
            12,
        ),
        strict=True,
    )
)
_AR1_1_7 = {tag: size for tag, size in _AR2_2_3.items() if tag <= Tag.GAMES} | {2: 40, 6: 36, 9: 68, 16: 120, 19: 29}
OPTION_SIZES: dict[str, dict[int, int]] = {
    "ar1-1.7": _AR1_1_7,
    "ar2-2.3": _AR2_2_3,
    "ar2-2.4.8": _AR2_2_3 | {9: 92, 22: 83, 23: 64, 27: 216},
}
