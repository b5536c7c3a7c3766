"""What sensors fixed in the world must show of standing drones before the findings can be judged. Pure."""

from collections.abc import Collection

import numpy as np

from groundstation.field.resolved import ResolvedField
from groundstation.geometry.lens import CameraIntrinsics, intrinsics_of
from groundstation.preflight.stand import Pad, SurveyedCamera, marker_centres, stand_of

# A marker nearer to the edge of the picture may be cut off, or the camera hang a little differently [share].
_EDGE = 0.1


def pads_in_view(field: ResolvedField) -> dict[str, frozenset[str]]:
    """Return for each fixed camera the drones whose pads lie well within its view."""
    stand = stand_of(field)
    return {
        name: frozenset(d for d, pad in stand.pads.items() if _well_in_view(stand.cameras[name], lens, pad))
        for name, lens in ((name, intrinsics_of(camera.calibration)) for name, camera in field.cameras.items())
    }


def all_shown(field: ResolvedField, shown: Collection[tuple[str, str]], flew: Collection[str]) -> bool:
    """Return whether nothing is awaited any more of the drones that have not flown.

    A motion capture sees its bodies at once, long before a camera has pictures enough: each camera must show a drone
    in its view, and each drone be shown by a camera above it and by each capture or ranging system. shown: pairs of
    sensor and drone.
    """
    standing = field.drones.keys() - set(flew)
    in_view = {camera: drones & standing for camera, drones in pads_in_view(field).items()}
    above = frozenset[str]().union(*in_view.values())
    systems = set(field.world_sensors) - in_view.keys()
    return (
        standing <= {drone for _, drone in shown}
        and above <= {drone for sensor, drone in shown if sensor in in_view}
        and {camera for camera, drones in in_view.items() if drones} <= {sensor for sensor, _ in shown}
        and all((system, drone) in shown for system in systems for drone in standing)
    )


def _well_in_view(camera: SurveyedCamera, lens: CameraIntrinsics, pad: Pad) -> bool:
    centre = marker_centres([pad], np.zeros((1, 2)), np.zeros(1), np.zeros(1))[0] - camera.position_m
    pixel = lens.pixel(*(camera.rotation.T @ centre).tolist())
    if pixel is None:
        return False
    shares = pixel[0] / lens.width_px, pixel[1] / lens.height_px
    return all(_EDGE < share < 1.0 - _EDGE for share in shares)
