"""Fixed cameras that see none of the drones in their view: turned away, knocked, or another one's stream."""

from collections.abc import Collection, Iterator, Sequence

import numpy as np

from groundstation.doctor.finding import Finding, Level
from groundstation.field.resolved import ResolvedField
from groundstation.field.room import WorldCamera
from groundstation.geometry.lens import intrinsics_of
from groundstation.geometry.rotations import world_from_downward_optical
from groundstation.preflight.stand import PadSighting

_STANDING_MARKER_M = 0.14
# A marker nearer to the edge of the picture may be cut off, or the camera hang a little differently [share].
_EDGE = 0.1
_REMEDY = "check that it is this camera's stream, and that nobody has turned it; groundstation camera view shows it"


def blind_cameras(
    field: ResolvedField, sightings: Sequence[PadSighting], flew: Collection[str] = ()
) -> Iterator[Finding]:
    """Yield the cameras that see nobody, while others see drones on pads that lie well within their view."""
    seen = {one.drone for one in sightings if one.camera in field.cameras} - set(flew)
    seeing = {one.camera for one in sightings}
    for name, camera in field.cameras.items():
        missed = sorted(drone for drone in seen if _well_in_view(camera, field.drones[drone].pad_m))
        if missed and name not in seeing:
            found = f"sees none of the drones that stand in its view ({', '.join(missed)})"
            yield Finding(Level.SHOULD, name, found, _REMEDY)


def _well_in_view(camera: WorldCamera, pad_m: tuple[float, float]) -> bool:
    centre = np.array([*pad_m, _STANDING_MARKER_M]) - np.array(camera.position_m)
    lens = intrinsics_of(camera.calibration)
    pixel = lens.pixel(*(world_from_downward_optical(camera.rotation_deg).T @ centre).tolist())
    if pixel is None:
        return False
    shares = pixel[0] / lens.width_px, pixel[1] / lens.height_px
    return all(_EDGE < share < 1.0 - _EDGE for share in shares)
