"""Layouts of the navdata options of flight, and the table of all layouts.

A layout covers the part of an option common to all firmwares that send it; a part that only newer ones append has a
layout of its own, which reads as None if missing. Surplus is ignored on decode and zero on encode.

WIRE: offsets from the Parrot SDK 2.0.1 headers, units from recordings of real drones (docs/reference/ardrone.md 4.4).
"""

from typing import Any, NamedTuple

from drivers.ardrone.wire.ambient import AMBIENT_LAYOUTS
from drivers.ardrone.wire.layout import OptionLayout
from drivers.ardrone.wire.tags import Tag
from drivers.ardrone.wire.vision import VISION_LAYOUTS

Triple = tuple[float, float, float]
Quad = tuple[int, int, int, int]
_ZEROS: Triple = (0.0, 0.0, 0.0)


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


class DemoDetection(NamedTuple):
    """The end of DEMO: pose of a tag seen by the bottom camera (deprecated), camera type 3 when there is none."""

    camera_rotation: tuple[float, ...] = (0.0,) * 9
    camera_translation: Triple = _ZEROS
    tag_index: int = 0
    camera_type: int = 3
    drone_camera_rotation: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    drone_camera_translation: Triple = _ZEROS


class RawEchoes(NamedTuple):
    """AR.Drone 2: the end of RAW_MEASURES; altitude by ultrasound [mm]."""

    echoes: int = 0
    echo_sum: int = 0
    altitude_mm: int = 0
    gradient: int = 0


class SpeedReferences(NamedTuple):
    """AR.Drone 2: velocity references [mm/s], and the last PCMD as it was understood with its sequence number."""

    vx_mm_s: float = 0.0
    vy_mm_s: float = 0.0
    theta_model_rad: float = 0.0
    phi_model_rad: float = 0.0
    gain_x: float = 0.0
    gain_y: float = 0.0
    mode: int = 0
    time: float = 0.0
    theta: float = 0.0
    phi: float = 0.0
    psi: float = 0.0
    psi_accuracy: float = 0.0
    sequence: int = 0


class RcReferences(NamedTuple):
    """References of a radio control."""

    pitch: int = 0
    roll: int = 0
    yaw: int = 0
    climb: int = 0
    agility: int = 0


class PwmAltitude(NamedTuple):
    """AR.Drone 2: terms of the altitude controller."""

    proportional: float = 0.0
    derivative: float = 0.0


DEMO = OptionLayout(Tag.DEMO, Demo, "I I f f f i f f f I")
DEMO_DETECTION = OptionLayout(Tag.DEMO, DemoDetection, "9f 3f I I 9f 3f", start=44)
TIME = OptionLayout(Tag.TIME, Time, "I")
RAW_MEASURES = OptionLayout(Tag.RAW_MEASURES, RawMeasures, "3H 3h 2h I H H H H H H H H")
RAW_ECHOES = OptionLayout(Tag.RAW_MEASURES, RawEchoes, "H I i h", start=40)
PHYS_MEASURES = OptionLayout(Tag.PHYS_MEASURES, PhysMeasures, "f H 3f 3f I I I")
GYROS_OFFSETS = OptionLayout(Tag.GYROS_OFFSETS, GyrosOffsets, "3f")
EULER_ANGLES = OptionLayout(Tag.EULER_ANGLES, EulerAngles, "f f")
REFERENCES = OptionLayout(Tag.REFERENCES, References, "i i i i i i i i")
SPEED_REFERENCES = OptionLayout(Tag.REFERENCES, SpeedReferences, "f f f f f f I f f f f f i", start=36)
TRIMS = OptionLayout(Tag.TRIMS, Trims, "f f f")
RC_REFERENCES = OptionLayout(Tag.RC_REFERENCES, RcReferences, "i i i i i")
PWM = OptionLayout(Tag.PWM, Pwm, "4B 4B f f f f i i i f i i i f 4H")
PWM_ALTITUDE = OptionLayout(Tag.PWM, PwmAltitude, "f f", start=68)
ALTITUDE = OptionLayout(Tag.ALTITUDE, Altitude, "i f i i f f 3f I 2f I")

LAYOUTS: tuple[OptionLayout[Any], ...] = (
    DEMO, DEMO_DETECTION, TIME, RAW_MEASURES, RAW_ECHOES, PHYS_MEASURES, GYROS_OFFSETS, EULER_ANGLES, REFERENCES,
    SPEED_REFERENCES, TRIMS, RC_REFERENCES, PWM, PWM_ALTITUDE, ALTITUDE, *VISION_LAYOUTS, *AMBIENT_LAYOUTS,
)  # fmt: skip
