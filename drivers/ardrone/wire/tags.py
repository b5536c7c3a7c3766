"""Numbers of the navdata options, and the size that each firmware gives them."""

from enum import IntEnum


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


# WIRE: sizes with the 4-byte head (docs/reference/ardrone.md 4.3). They differ between firmwares: no decoder
# may rely on them.
_AR2_2_3: dict[int, int] = {
    Tag.DEMO: 148, Tag.TIME: 8, Tag.RAW_MEASURES: 52, Tag.PHYS_MEASURES: 46, Tag.GYROS_OFFSETS: 16,
    Tag.EULER_ANGLES: 12, Tag.REFERENCES: 88, Tag.TRIMS: 16, Tag.RC_REFERENCES: 24, Tag.PWM: 76, Tag.ALTITUDE: 56,
    Tag.VISION_RAW: 16, Tag.VISION_OF: 44, Tag.VISION: 92, Tag.VISION_PERF: 108, Tag.TRACKERS_SEND: 364,
    Tag.VISION_DETECT: 328, Tag.WATCHDOG: 8, Tag.ADC_DATA_FRAME: 40, Tag.VIDEO_STREAM: 65, Tag.GAMES: 12,
    Tag.PRESSURE_RAW: 18, Tag.MAGNETO: 75, Tag.WIND: 56, Tag.KALMAN_PRESSURE: 72, Tag.HDVIDEO_STREAM: 32,
    Tag.WIFI: 8, Tag.GPS: 12,
}  # fmt: skip
_AR1_1_7 = {tag: size for tag, size in _AR2_2_3.items() if tag <= Tag.GAMES} | {
    Tag.RAW_MEASURES: 40, Tag.REFERENCES: 36, Tag.PWM: 68, Tag.VISION_DETECT: 120, Tag.VIDEO_STREAM: 29,
}  # fmt: skip
OPTION_SIZES: dict[str, dict[int, int]] = {
    "ar1-1.5": dict(_AR1_1_7),
    "ar1-1.7": dict(_AR1_1_7),
    "ar2-2.2": dict(_AR2_2_3),
    "ar2-2.3": dict(_AR2_2_3),
    "ar2-2.3.3": _AR2_2_3 | {Tag.MAGNETO: 83},
    "ar2-2.4-beta": _AR2_2_3 | {Tag.GPS: 480},
    "ar2-2.4.8": _AR2_2_3 | {Tag.PWM: 92, Tag.MAGNETO: 83, Tag.WIND: 64, Tag.GPS: 216},
}
