"""The stand of each drone on its pad, and fixed cameras' sightings of it there. Pure values."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from groundstation.arrays import Array
from groundstation.field.drones import FieldDrone
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.rotations import world_from_downward_optical
from groundstation.sensing.from_field import square_m
from groundstation.vehicles import kind_named

# Precision with which a person sets a drone on a cross and a line on the floor.
PLACED_M, PLACED_RAD = 0.01, math.radians(1.5)
# Relative errors of a lens and of a print that were measured.
LENS_STD, PRINT_STD = 0.004, 0.003


@dataclass(frozen=True, slots=True)
class PadSighting:
    """One camera's median of one standing drone: centre of the marker [m; camera_optical], heading [rad] or NaN.

    covariance: (4, 4) of the median of (centre, heading).
    """

    camera: str
    drone: str
    position_m: Array
    yaw_rad: float
    covariance: Array


@dataclass(frozen=True, slots=True)
class Pad:
    """A place to stand: x, y [m; world], heading [rad]; the drone's standing height and its deviation [m].

    marker_m: centre of the marker [m; base]; square_m: side of its squares, or of those seen as far as a tag.
    """

    place_m: tuple[float, float]
    yaw_rad: float
    height_m: float
    height_std_m: float
    marker_m: tuple[float, float, float]
    square_m: float

    def of(self, other: "Pad") -> "Pad":
        """Return this drone as it would stand on the pad of another one."""
        return replace(self, place_m=other.place_m, yaw_rad=other.yaw_rad)


def marker_centres(pads: Sequence[Pad], aside_m: Array, turned_rad: Array, higher_m: Array) -> Array:
    """Return the centres (..., n, 3) of the markers [m; world] of n drones that stand slightly off their pads.

    aside_m: (..., n, 2); turned_rad, higher_m: (..., n).
    """
    yaw_rad, height_m = np.array([(pad.yaw_rad, pad.height_m) for pad in pads]).T
    east_m, north_m = np.array([pad.place_m for pad in pads]).T
    ahead_m, left_m, above_m = np.array([pad.marker_m for pad in pads]).T
    c, s = np.cos(yaw_rad + turned_rad), np.sin(yaw_rad + turned_rad)
    x = east_m + aside_m[..., 0] + c * ahead_m - s * left_m
    y = north_m + aside_m[..., 1] + s * ahead_m + c * left_m
    return np.stack((x, y, height_m + higher_m + above_m), axis=-1)


@dataclass(frozen=True, slots=True)
class SurveyedCamera:
    """A fixed camera as the field has it: rotation world_from_optical, position [m; world], deviations [rad], [m].

    focal_px: focal length along the picture's x axis.
    """

    rotation: Array
    position_m: Array
    attitude_std_rad: float
    position_std_m: float
    focal_px: float


@dataclass(frozen=True, slots=True)
class Stand:
    """All pads and fixed cameras of a field, by the names of drones and cameras."""

    pads: Mapping[str, Pad]
    cameras: Mapping[str, SurveyedCamera]

    def exchanged(self, pairs: Mapping[str, str]) -> "Stand":
        """Return the stand in which each named drone is on the pad of another one."""
        moved = {name: self.pads[name].of(self.pads[other]) for name, other in pairs.items()}
        return replace(self, pads={**self.pads, **moved})


def stand_of(field: ResolvedField) -> Stand:
    """Return the stand of a resolved field."""
    cameras = {
        name: SurveyedCamera(
            world_from_downward_optical(camera.rotation_deg),
            np.array(camera.position_m),
            max(math.radians(camera.attitude_std_deg), 1e-3),
            max(camera.position_std_m, 2e-3),
            camera.calibration.fx_px,
        )
        for name, camera in field.cameras.items()
    }
    return Stand({name: _pad(drone) for name, drone in field.drones.items()}, cameras)


def _pad(drone: FieldDrone) -> Pad:
    height, std = kind_named(drone.kind).standing_m
    marker = drone.marker
    return Pad(drone.pad_m, math.radians(drone.pad_yaw_deg), height, std, marker.position_m, square_m(marker))
