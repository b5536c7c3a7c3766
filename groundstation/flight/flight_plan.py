"""The requests for a flight, and the settings of its field."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from groundstation.doctor.finding import Finding, Level
from groundstation.field.resolved import ResolvedField, field_from_json
from groundstation.geometry.rotations import world_from_downward_optical
from groundstation.runtime.marker_height import FixedCamera
from groundstation.runtime.take_off import TakeOffLimits
from groundstation.settings.cautions import OF_A_FIELD, Caution
from groundstation.settings.schema import Field

# Sensors that give positions in the world.
_IN_WORLD = FixedCamera(0.0, (0.0, 0.0, 1.0))


# Beside the take-offs themselves: the time until all are localised and TRACK is accepted.
_LOCALISING_S = 30.0
_LEAST_TRACKING_LIMIT_S = 90.0


@dataclass(frozen=True, slots=True)
class FlightPlan:
    """The requests for a flight.

    duration_s: tracking time, None = until stopped; asks: take off only when the operator orders it at the prompt or
    from another shell; cameras: those fixed in the world; landing_limit_s: largest duration of a landing before the
    processes are stopped anyway; field: the field for the checks before the take-off (none: no checks); cautions:
    warnings about the field file; anyway: take off whatever the checks find; look_only: only make the checks, without a
    take-off.
    """

    duration_s: float | None
    asks: bool
    cameras: Mapping[str, FixedCamera]
    limits: TakeOffLimits
    start_tracking_limit_s: float = _LEAST_TRACKING_LIMIT_S
    landing_limit_s: float = 15.0
    field: ResolvedField | None = None
    cautions: tuple[Finding, ...] = ()
    anyway: bool = False
    look_only: bool = False


def plan_of(
    field: Field, duration_s: float | None, *, asks: bool, checks: Iterable[Caution] = OF_A_FIELD
) -> FlightPlan:
    """Return the plan of a flight in this field; checks: the sources of warnings about its file."""
    cameras = {}
    for name, camera in field.cameras.items():
        right, down, forward = world_from_downward_optical(camera.rotation_deg)[2].tolist()
        cameras[name] = FixedCamera(camera.position_m[2], (right, down, forward))
    for name in field.motion_capture:
        if name != field.truth.get("from"):
            cameras[name] = _IN_WORLD
    cameras |= dict.fromkeys(field.ranging, _IN_WORLD)
    limits = TakeOffLimits(unseen_s=field.safety.unseen_land_after_s)
    resolved = field_from_json(field.model_dump_json().encode())
    late_s = max(_LEAST_TRACKING_LIMIT_S, _LOCALISING_S + len(field.drones) * limits.longest_s)
    return FlightPlan(duration_s, asks, cameras, limits, late_s, field=resolved, cautions=_cautions(field, checks))


def _cautions(field: Field, checks: Iterable[Caution]) -> tuple[Finding, ...]:
    found = ((".".join(map(str, path)), text) for check in checks for path, text in check(field))
    return tuple(Finding(Level.SHOULD, where, text, "mend it in the field file") for where, text in found)
