"""All findings before a take-off, the gravest first. Pure."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

from groundstation.bus.messages import CameraStatus, VehicleStatus
from groundstation.doctor.finding import Finding, Level
from groundstation.field.resolved import ResolvedField
from groundstation.preflight.blind_cameras import blind_cameras
from groundstation.preflight.captured_pads import captured_pad_findings
from groundstation.preflight.expected import pads_in_view
from groundstation.preflight.health import camera_findings, drone_findings
from groundstation.preflight.stand import PadSighting, stand_of
from groundstation.preflight.suspicions import opinion
from groundstation.preflight.wording import SUBJECT, finding, shown_by

_GRAVITY = {Level.MUST: 0, Level.SHOULD: 1, Level.OK: 2}


def judge(
    field: ResolvedField,
    vehicles: Mapping[str, VehicleStatus],
    cameras: Mapping[str, CameraStatus],
    sightings: Sequence[PadSighting],
    flew: Collection[str] = (),
    cautions: Sequence[Finding] = (),
    aloft: Collection[str] = (),
) -> list[Finding]:
    """Return all findings, those that must be mended first.

    flew: drones that have flown and may stand anywhere by now, or be aloft still; cautions: warnings about the field
    file.
    """
    sees = {camera: sorted({s.drone for s in sightings if s.camera == camera}) for camera in field.world_sensors}
    found = [*drone_findings(field, vehicles), *camera_findings(field, cameras, sees)]
    found += [*pad_findings(field, sightings, flew, aloft), *cautions]
    return sorted(found, key=lambda one: _GRAVITY[one.level])


def pad_findings(
    field: ResolvedField,
    sightings: Sequence[PadSighting],
    flew: Collection[str] = (),
    aloft: Collection[str] = (),
) -> Iterator[Finding]:
    """Yield findings of fixed sensors on standing drones: unseen ones, and the errors of those that never flew.

    A drone that a capture or ranging system follows needs no camera, but is missed where its pad lies in a view.
    """
    yield from captured_pad_findings(field, sightings, flew, aloft)
    if not field.cameras:
        return
    known = [s for s in sightings if s.drone in field.drones and s.camera in field.cameras]
    seen, on_pads = {s.drone for s in known}, [s for s in known if s.drone not in flew]
    followed = {s.drone for s in sightings if s.camera not in field.cameras} & field.drones.keys()
    above = set(flew).union(*pads_in_view(field).values())
    missed = [n for n in field.drones if n not in seen and n not in aloft and (n not in followed or n in above)]
    remedy = "check light, lens and marker, and that it stands {} in view"
    if not known and not aloft:
        if not missed:
            return
        shown = shown_by(drone.marker for drone in field.drones.values())
        where = remedy.format("anywhere" if set(field.drones) <= set(flew) else "on its pad")
        level = Level.SHOULD if followed else Level.MUST
        yield Finding(level, SUBJECT, "no fixed camera sees any drone", f"{where}; {shown}")
        return
    yield from blind_cameras(field, known, flew)
    for name in missed:
        shown, where = shown_by([field.drones[name].marker]), "anywhere" if name in flew else "on its pad"
        told = f"{remedy.format(where)}; {shown}"
        yield Finding(Level.SHOULD, name, "no fixed camera sees its marker on the floor", told)
    if on_pads:
        yield finding(field, opinion(stand_of(field), on_pads))


def open_musts(findings: Iterable[Finding], wanted: Collection[str], team: Collection[str]) -> list[Finding]:
    """Return the findings that forbid a take-off of the wanted drones (none: all); musts of others do not."""
    others = set(team) - set(wanted) if wanted else set()
    return [one for one in findings if one.level is Level.MUST and one.subject not in others]


def lines(findings: Iterable[Finding]) -> list[str]:
    """Return the list as text, a remedy below each finding that has one."""
    text = []
    for one in findings:
        text.append(f"{one.level:6}  {one.subject}: {one.found}")
        if one.remedy:
            text.append(f"{'':6}  -> {one.remedy}")
    return text
