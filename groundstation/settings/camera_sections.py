"""Makes each camera driver's section from the field."""

from drivers.camera.settings import (
    SEARCH_RATE_HZ,
    CalibrationSettings,
    CameraDriverSettings,
    MarkerKind,
    MarkerSettings,
    MountSettings,
    TagSettings,
)
from groundstation.field.drones import camera_name
from groundstation.geometry.board import Checkerboard
from groundstation.geometry.tag import SquareTag
from groundstation.settings import room
from groundstation.settings.drones import Drone
from groundstation.settings.schema import Field
from groundstation.settings.values import Vector3


def world_camera(field: Field, name: str, camera: room.WorldCameraSettings, phase_s: float) -> CameraDriverSettings:
    """Return the settings of the driver of a camera fixed in the world; phase_s staggers its full searches."""
    robots = tuple(field.drones) if "robots" in camera.observes else ()
    targets = tuple(field.tracked) if "targets" in camera.observes else ()
    return CameraDriverSettings(
        name=name,
        source=camera.source,
        calibration=_lens(camera.calibration),
        mount=MountSettings(
            parent="world",
            position_m=camera.position_m,
            looking=camera.looking,
            rotation_deg=camera.rotation_deg,
        ),
        video_delay_ms=camera.video_delay_ms,
        readout_ms=camera.readout_ms,
        markers=_markers(field),
        observes=robots + targets,
        image_fps=field.recording.image_fps,
        search_rate_hz=SEARCH_RATE_HZ,
        search_phase_s=phase_s,
    )


def onboard_camera(field: Field, name: str, drone: Drone, phase_s: float) -> CameraDriverSettings:
    """Return the settings of the driver of the camera that a drone carries."""
    camera = drone.camera
    return CameraDriverSettings(
        name=camera_name(name),
        source=drone.video_source,
        calibration=_lens(camera.calibration),
        mount=MountSettings(
            parent=name,
            position_m=camera.position_m,
            tilt_down_deg=camera.tilt_down_deg,
            pan_deg=camera.pan_left_deg,
        ),
        video_delay_ms=camera.video_delay_ms,
        readout_ms=camera.readout_ms,
        markers=_markers(field),
        image_fps=field.recording.image_fps,
        search_rate_hz=SEARCH_RATE_HZ,
        search_phase_s=phase_s,
    )


def _lens(lens: room.CalibrationSettings) -> CalibrationSettings:
    return CalibrationSettings(
        model=lens.model,
        width_px=lens.width_px,
        height_px=lens.height_px,
        fx_px=lens.fx_px,
        fy_px=lens.fy_px,
        cx_px=lens.cx_px,
        cy_px=lens.cy_px,
        distortion=lens.distortion,
        residual_px=lens.residual_px,
        date="" if lens.date is None else lens.date.isoformat(),
    )


def _markers(field: Field) -> tuple[MarkerSettings, ...]:
    robots = [
        _marker(name, MarkerKind.ROBOT, drone.marker.position_m, drone.marker.printed)
        for name, drone in field.drones.items()
    ]
    targets = [
        _marker(name, MarkerKind.TARGET, target.marker.position_m, target.marker.printed)
        for name, target in field.tracked.items()
    ]
    return (*robots, *targets)


def _marker(entity: str, kind: MarkerKind, position_m: Vector3, printed: Checkerboard | SquareTag) -> MarkerSettings:
    if isinstance(printed, SquareTag):
        tag = TagSettings(dictionary=printed.dictionary, id=printed.id, size_mm=printed.size_mm)
        return MarkerSettings(entity=entity, kind=kind, position_m=position_m, tag=tag)
    return MarkerSettings(
        entity=entity, kind=kind, position_m=position_m, code=printed.code, square_mm=printed.square_mm
    )
