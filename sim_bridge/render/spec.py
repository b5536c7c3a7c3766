"""Settings of a render process: one camera, the bodies before it, picture quality, address of its stream."""

from dataclasses import dataclass
from enum import StrEnum

from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.tag import SquareTag
from sim_bridge.fault_kinds import Fault
from sim_bridge.own_video import OwnVideo


class BodyShape(StrEnum):
    """The shape of a body under its board."""

    DRONE = "drone"
    TURTLEBOT = "turtlebot"


@dataclass(frozen=True, slots=True)
class Mount:
    """Mounting of a camera; `body` "" means the world.

    parent_from_optical: base_from_camera_optical on a body, world_from_camera_optical for a world-fixed camera.
    """

    parent_from_optical: Pose
    body: str = ""


@dataclass(frozen=True, slots=True)
class BoardSpec:
    """A marker lying flat on a body: its code, square size, and its place on the body [m; base].

    tag: the marker is this tag instead of a checkerboard; code and square size then mean nothing.
    """

    body: str
    code: int
    square_mm: float
    position_m: tuple[float, float, float]
    shape: BodyShape = BodyShape.DRONE
    tag: SquareTag | None = None


@dataclass(frozen=True, slots=True)
class BoxSpec:
    """An upright box that hides what is behind it: its row among the bodies, and its size along x, y, z [m]."""

    body: str
    size_m: tuple[float, float, float]


class FloorKind(StrEnum):
    """Kind of floor; `TILES` is itself a checkerboard and hard for detectors."""

    CARPET = "carpet"
    WOOD = "wood"
    CONCRETE = "concrete"
    TILES = "tiles"


class OutageKind(StrEnum):
    """How a stream fails: `STALL` keeps the connection but sends nothing, `HELD_BACK` sends it all at the end, `CUT`
    closes the connection and refuses new ones."""

    STALL = "stall"
    HELD_BACK = "held_back"
    CUT = "cut"


@dataclass(frozen=True, slots=True)
class Outage:
    """A planned failure of the stream, in seconds since the first true state was written (end_s None: for good)."""

    kind: OutageKind
    start_s: float
    end_s: float | None = None


@dataclass(frozen=True, slots=True)
class PictureQuality:
    """How good the camera and its link are.

    video_delay_ms +- video_jitter_ms (uniform) from exposure to arrival; frame_loss: share of frames never sent, or,
    where TCP repeats what is lost and nothing may be missing (OwnVideo.repeats), sent late;
    corner_noise_px: rms error of each board corner (print, lens model), pixel_noise: grey levels rms; blur_px: sigma
    of the defocus; exposure_ms: motion blur; rolling_shutter_ms: time from the first row to the last (the stamp is the
    middle); light: share of a full exposure, shot_noise: rms of photon noise at white [grey levels]; faults: of this
    camera's pictures and of boards.
    """

    fps: float = 15.0
    video_delay_ms: float = 120.0
    video_jitter_ms: float = 20.0
    frame_loss: float = 0.05
    corner_noise_px: float = 0.2
    pixel_noise: float = 2.0
    blur_px: float = 0.7
    exposure_ms: float = 4.0
    jpeg_quality: int = 85
    rolling_shutter_ms: float = 0.0
    light: float = 1.0
    shot_noise: float = 0.0
    floor: FloorKind = FloorKind.CARPET
    outages: tuple[Outage, ...] = ()
    faults: tuple[Fault, ...] = ()


@dataclass(frozen=True, slots=True)
class RenderSpec:
    """All that `sim_bridge.render.process.run` needs; picklable.

    truth_name: shared memory of the TruthBoard; bodies: its bodies in order; room_size_m: (x, y, z), the floor is
    centred at the origin; address, port: where the stream is served, as MJPEG unless the vehicle sends its own;
    parent_pid: exit when it is gone (0: never).
    """

    camera: str
    mount: Mount
    intrinsics: CameraIntrinsics
    boards: tuple[BoardSpec, ...]
    truth_name: str
    bodies: tuple[str, ...]
    address: str
    port: int
    scenario: PictureQuality = PictureQuality()
    seed: int = 1
    room_size_m: tuple[float, float, float] = (8.0, 6.0, 4.5)
    parent_pid: int = 0
    own: OwnVideo | None = None
    boxes: tuple[BoxSpec, ...] = ()
