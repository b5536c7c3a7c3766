"""Fixed cameras that see none of the drones in their view: turned away, knocked, or another one's stream."""

from collections.abc import Collection, Iterator, Sequence

import numpy as np

from groundstation.doctor.finding import Finding, Level
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.lens import CameraIntrinsics, intrinsics_of
from groundstation.preflight.stand import Pad, PadSighting, SurveyedCamera, marker_centres, stand_of
from groundstation.preflight.wording import shown_by

# A marker nearer to the edge of the picture may be cut off, or the camera hang a little differently [share].
_EDGE = 0.1
_REMEDY = "check that it is this camera's stream, and that nobody has turned it"


def blind_cameras(
    field: ResolvedField, sightings: Sequence[PadSighting], flew: Collection[str] = ()
) -> Iterator[Finding]:
    """Yield the cameras that see nobody, while others see drones on pads that lie well within their view."""
    seen = {one.drone for one in sightings if one.camera in field.cameras} - set(flew)
    blind, stand = field.cameras.keys() - {one.camera for one in sightings}, stand_of(field)
    for name in sorted(blind):
        lens, camera = intrinsics_of(field.cameras[name].calibration), stand.cameras[name]
        missed = sorted(drone for drone in seen if _well_in_view(camera, lens, stand.pads[drone]))
        if missed:
            found = f"sees none of the drones that stand in its view ({', '.join(missed)})"
            shown = shown_by(field.drones[drone].marker for drone in missed)
            yield Finding(Level.SHOULD, name, found, f"{_REMEDY}; {shown}")


def _well_in_view(camera: SurveyedCamera, lens: CameraIntrinsics, pad: Pad) -> bool:
    centre = marker_centres([pad], np.zeros((1, 2)), np.zeros(1), np.zeros(1))[0] - camera.position_m
    pixel = lens.pixel(*(camera.rotation.T @ centre).tolist())
    if pixel is None:
        return False
    shares = pixel[0] / lens.width_px, pixel[1] / lens.height_px
    return all(_EDGE < share < 1.0 - _EDGE for share in shares)
