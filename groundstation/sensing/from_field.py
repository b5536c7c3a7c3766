"""Builds the sensor suite of a resolved field."""

import math
from collections.abc import Sequence

from groundstation.field.drones import FieldDrone
from groundstation.field.resolved import ResolvedField
from groundstation.field.room import LensCalibration, MotionCapture, Ranging, Volume, WorldCamera
from groundstation.field.targets import Marker
from groundstation.geometry.multilateration import horizontal_std_m
from groundstation.geometry.rotations import world_from_downward_optical
from groundstation.sensing.models import (
    SIGHTINGS_PER_S,
    Box,
    Frustum,
    Noise,
    OnboardCameraModel,
    SensorSuite,
    WorldCameraModel,
)

BORDER_SQUARES = 3.5
"""Half the diagonal of a board, in squares of it: the whole board must be in the picture."""

FAR_M = 200.0
"""Height of the assumed eye of a motion capture system above its box."""

CAPTURE_BORDER_M = 0.1
"""Least distance of a body from the border of a motion capture system's box, for use."""

HEIGHT_KNOWN = 0.5
"""Deviation of a vehicle's own height relative to that of one range."""

_WORST_DILUTION = 10.0  # for anchors in a line: such a system determines next to nothing

DETECTION_PX = 10.0
"""Least size of a square that is found with certainty; bounds the range of world-fixed cameras."""

TAG_SQUARES = 3.8
"""A tag is found as far as a checkerboard whose squares are its side divided by this (measured: 168 mm like 44 mm)."""

ATTITUDE_REPEATS = 2.0
"""Attitude errors last for seconds: they are counted with this factor, as if they were white."""


def sensors_from_field(field: ResolvedField) -> SensorSuite:
    """Return the suite for a resolved field."""
    drones, targets = field.drones, field.tracked
    heights = {name: drone.marker.position_m[2] for name, drone in drones.items()}
    carried = [square_m(drone.marker) for drone in drones.values()] or [0.044]
    tracked = [square_m(target.marker) for target in targets.values()]
    reach = field.planner.planned_range_m
    return SensorSuite(
        world={name: _world(camera, carried, tracked) for name, camera in field.cameras.items()}
        | {name: _captured(system) for name, system in field.sensing_capture.items()}
        | {name: _ranged(system) for name, system in field.ranging.items()},
        onboard={name: _onboard(drone, max(*carried, *tracked), reach) for name, drone in drones.items()},
        marker_height_m=heights | {name: target.marker.height_m for name, target in targets.items()},
        obstacles=boxes_from_field(field),
    )


def boxes_from_field(field: ResolvedField) -> tuple[Box, ...]:
    """Return the obstacles of a resolved field."""
    return tuple(Box(one.centre_m, one.size_m) for one in field.room.obstacles.values())


def square_m(marker: Marker) -> float:
    """Return the square of a checkerboard that is seen as far as the marker."""
    return (marker.square_mm if marker.size_mm is None else marker.size_mm / TAG_SQUARES) / 1000


def _frustum(lens: LensCalibration, range_m: float, square_m: float) -> Frustum:
    return Frustum.of_picture(lens.width_px, lens.height_px, lens.fx_px, lens.fy_px, range_m, BORDER_SQUARES * square_m)


def _world(camera: WorldCamera, carried: Sequence[float], tracked: Sequence[float]) -> WorldCameraModel:
    """Return the view of a camera; carried, tracked: squares of the markers on drones and targets [m].

    Its range is that at which the smallest drone marker can be read; a place counts if the largest is wholly in view.
    """
    noise = Noise(math.hypot(0.015, camera.position_std_m), math.radians(camera.attitude_std_deg), 0.0, 0.035)
    reach = camera.calibration.fx_px * min(carried) / DETECTION_PX
    observes_targets = "targets" in camera.observes
    largest = max(*carried, *(tracked if observes_targets else ()), 0.0)
    rotation = world_from_downward_optical(camera.rotation_deg)
    view = _frustum(camera.calibration, reach, largest)
    return WorldCameraModel(camera.position_m, view, noise, rotation.T, observes_targets)


def _captured(system: MotionCapture) -> WorldCameraModel:
    """Return the view of a motion capture system's box."""
    std_m = math.hypot(system.pose_std_m, system.position_std_m)
    noise = Noise(std_m, 0.0, 0.0, math.radians(math.hypot(system.heading_std_deg, system.attitude_std_deg)))
    return _view_of(system.volume_m, noise, "targets" in system.observes)


def _ranged(system: Ranging) -> WorldCameraModel:
    """Return the view of a ranging system's box, with the worst precision of a place in the plane by its ranges.

    White noise is scaled by their rate relative to sightings; errors that last for seconds count once, in full.
    """
    box = system.volume_m
    middle = [sum(span) / 2 for span in (box.x_m, box.y_m, box.z_m)]
    corners = [(x, y, middle[2]) for x in (*box.x_m, middle[0]) for y in (*box.y_m, middle[1])]
    reached = [[at for at in system.anchors.values() if math.dist(at, one) <= system.reach_m] for one in corners]
    each = [horizontal_std_m(near, one, 1.0, HEIGHT_KNOWN) for near, one in zip(reached, corners, strict=True)]
    dilution = min(max(each), _WORST_DILUTION)
    rounds = system.rate_hz * (1.0 - system.outlier_share)
    white_m = system.range_std_m * math.sqrt(SIGHTINGS_PER_S / rounds)
    std_m = dilution * math.hypot(white_m, system.bias_std_m)
    return _view_of(box, Noise(std_m, 0.0, 0.0, math.pi), targets=False)


def _view_of(box: Volume, noise: Noise, targets: bool) -> WorldCameraModel:
    """Return a box as the view of an eye so high above it that its sides are nearly upright."""
    middle = ((box.x_m[0] + box.x_m[1]) / 2, (box.y_m[0] + box.y_m[1]) / 2)
    half = ((box.x_m[1] - box.x_m[0]) / 2, (box.y_m[1] - box.y_m[0]) / 2)
    position = (*middle, box.z_m[1] + FAR_M)
    # The pyramid is cut to the top of the box; at its foot it is wider by the box's height over FAR_M.
    view = Frustum(
        half[0] / FAR_M, half[1] / FAR_M, math.hypot(FAR_M + box.z_m[1] - box.z_m[0], *half), CAPTURE_BORDER_M
    )
    return WorldCameraModel(position, view, noise, observes_targets=targets)


def _onboard(drone: FieldDrone, square_m: float, range_m: float) -> OnboardCameraModel:
    camera = drone.camera
    return OnboardCameraModel(
        position_m=camera.position_m,
        view=_frustum(camera.calibration, range_m, square_m),
        tilt_down_rad=math.radians(camera.tilt_down_deg),
        pan_left_rad=math.radians(camera.pan_left_deg),
        noise=Noise(0.02, ATTITUDE_REPEATS * math.radians(drone.odometry.attitude_std_deg), 0.004, 0.05),
    )
