"""Layouts of the options about vision: flow, trackers, detected tags, video. WIRE: docs/reference/ardrone.md 4.4."""

from typing import Any, NamedTuple

from drivers.ardrone.wire.layout import OptionLayout
from drivers.ardrone.wire.tags import Tag

_Triple = tuple[float, float, float]
_Quad = tuple[int, int, int, int]
_Fives = tuple[float, float, float, float, float]
_NONE: _Quad = (0, 0, 0, 0)
_ZEROS: _Triple = (0.0, 0.0, 0.0)


class VisionRaw(NamedTuple):
    """Displacement between two pictures."""

    translation: _Triple = _ZEROS


class VisionOf(NamedTuple):
    """Optical flow of five levels."""

    dx: _Fives = (0.0,) * 5
    dy: _Fives = (0.0,) * 5


class OpticalFlowSpeed(NamedTuple):
    """Speed estimation by the bottom camera; capture time in the form of TIME, body velocity [mm/s; FRD]."""

    state: int = 0
    misc: int = 0
    phi_trim_rad: float = 0.0
    phi_reference_rad: float = 0.0
    theta_trim_rad: float = 0.0
    theta_reference_rad: float = 0.0
    new_picture: int = 0
    theta_capture: float = 0.0
    phi_capture: float = 0.0
    psi_capture: float = 0.0
    altitude_capture_mm: int = 0
    time_capture: int = 0
    body_velocity_mm_s: _Triple = _ZEROS
    delta_phi: float = 0.0
    delta_theta: float = 0.0
    delta_psi: float = 0.0
    gold_defined: int = 0
    gold_reset: int = 0
    gold_x: float = 0.0
    gold_y: float = 0.0


class VisionPerf(NamedTuple):
    """Times of the vision's stages, and 20 custom values."""

    size_orientation: float = 0.0
    corners: float = 0.0
    compute: float = 0.0
    tracking: float = 0.0
    translation: float = 0.0
    update: float = 0.0
    custom: tuple[float, ...] = (0.0,) * 20


class TrackersSend(NamedTuple):
    """30 trackers: locked or not, and their places x, y, x, y ... in the picture."""

    locked: tuple[int, ...] = (0,) * 30
    points: tuple[int, ...] = (0,) * 60


class VisionDetect(NamedTuple):
    """Up to four tags: picture position and size 0..1000, distance [cm], orientation [deg]."""

    detected: int = 0
    types: _Quad = _NONE
    x: _Quad = _NONE
    y: _Quad = _NONE
    width: _Quad = _NONE
    height: _Quad = _NONE
    distance_cm: _Quad = _NONE
    orientation_deg: tuple[float, float, float, float] = (0.0,) * 4


class VisionDetectPoses(NamedTuple):
    """AR.Drone 2: rotation (four 3 x 3, by rows) and translation of each tag, and the camera that saw it."""

    rotations: tuple[float, ...] = (0.0,) * 36
    translations: tuple[float, ...] = (0.0,) * 12
    sources: _Quad = _NONE


class VideoStream(NamedTuple):
    """Encoder's last frame [bytes], and the arrival of AT commands."""

    quantizer: int = 0
    frame_bytes: int = 0
    frame_number: int = 0
    at_sequence: int = 0
    at_mean_gap_ms: int = 0
    at_gap_variance: float = 0.0
    at_quality: int = 0


class VideoStreamRate(NamedTuple):
    """AR.Drone 2: bit rates, and lengths of the queues."""

    bitrate: int = 0
    wanted_bitrate: int = 0
    data: tuple[int, int, int, int, int] = (0,) * 5
    tcp_queue: int = 0
    fifo_queue: int = 0


class Games(NamedTuple):
    """Counters of taps and finish lines."""

    double_taps: int = 0
    finish_lines: int = 0


class HdVideoStream(NamedTuple):
    """Recording on a USB stick [packets, kB, s]; state bits: 0 queue full, 8 stick present, 9 recording, 10 full."""

    state: int = 0
    queued_packets: int = 0
    queued_bytes: int = 0
    stick_kb: int = 0
    stick_free_kb: int = 0
    frame_number: int = 0
    remaining_s: int = 0


VISION_RAW = OptionLayout(Tag.VISION_RAW, VisionRaw, "3f")
VISION_OF = OptionLayout(Tag.VISION_OF, VisionOf, "5f 5f")
VISION = OptionLayout(Tag.VISION, OpticalFlowSpeed, "I i f f f f i f f f i I 3f f f f I I f f")
VISION_PERF = OptionLayout(Tag.VISION_PERF, VisionPerf, "f f f f f f 20f")
TRACKERS_SEND = OptionLayout(Tag.TRACKERS_SEND, TrackersSend, "30i 60i")
VISION_DETECT = OptionLayout(Tag.VISION_DETECT, VisionDetect, "I 4I 4I 4I 4I 4I 4I 4f")
VISION_DETECT_POSES = OptionLayout(Tag.VISION_DETECT, VisionDetectPoses, "36f 12f 4I", start=120)
VIDEO_STREAM = OptionLayout(Tag.VIDEO_STREAM, VideoStream, "B I I I I f I")
VIDEO_STREAM_RATE = OptionLayout(Tag.VIDEO_STREAM, VideoStreamRate, "I I 5i I I", start=29)
GAMES = OptionLayout(Tag.GAMES, Games, "I I")
HDVIDEO_STREAM = OptionLayout(Tag.HDVIDEO_STREAM, HdVideoStream, "I I I I I I I")

VISION_LAYOUTS: tuple[OptionLayout[Any], ...] = (
    VISION_RAW, VISION_OF, VISION, VISION_PERF, TRACKERS_SEND, VISION_DETECT, VISION_DETECT_POSES, VIDEO_STREAM,
    VIDEO_STREAM_RATE, GAMES, HDVIDEO_STREAM,
)  # fmt: skip
