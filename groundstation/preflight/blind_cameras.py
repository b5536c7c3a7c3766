"""Fixed cameras that see none of the drones in their view: turned away, knocked, or another one's stream."""

from collections.abc import Collection, Iterator, Sequence

from groundstation.doctor.finding import Finding, Level
from groundstation.field.resolved import ResolvedField
from groundstation.preflight.expected import pads_in_view
from groundstation.preflight.stand import PadSighting
from groundstation.preflight.wording import shown_by

_REMEDY = "check that it is this camera's stream, and that nobody has turned it"


def blind_cameras(
    field: ResolvedField, sightings: Sequence[PadSighting], flew: Collection[str] = ()
) -> Iterator[Finding]:
    """Yield the cameras that see nobody, while others see drones on pads that lie well within their view."""
    seen = {one.drone for one in sightings if one.camera in field.cameras} - set(flew)
    in_view = pads_in_view(field)
    for name in sorted(field.cameras.keys() - {one.camera for one in sightings}):
        if missed := sorted(seen & in_view[name]):
            found = f"sees none of the drones that stand in its view ({', '.join(missed)})"
            shown = shown_by(field.drones[drone].marker for drone in missed)
            yield Finding(Level.SHOULD, name, found, f"{_REMEDY}; {shown}")
