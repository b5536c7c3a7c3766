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
    followed = {s.drone for s in sightings if s.camera not in field.cameras} & field.drones.keys()
    unseen = [name for name in field.drones if name not in aloft and all(s.drone != name for s in known)]
    in_some_view = set(flew).union(*pads_in_view(field).values())
    missed = [name for name in unseen if name not in followed or name in in_some_view]
    if not known and not aloft:
        if missed:
            level = Level.SHOULD if followed else Level.MUST
            remedy = _remedy_for(field, field.drones, anywhere=set(field.drones) <= set(flew))
            yield Finding(level, SUBJECT, "no fixed camera sees any drone", remedy)
        return
    yield from blind_cameras(field, known, flew)
    for name in missed:
        remedy = _remedy_for(field, [name], anywhere=name in flew)
        yield Finding(Level.SHOULD, name, "no fixed camera sees its marker on the floor", remedy)
    if on_pads := [s for s in known if s.drone not in flew]:
        yield finding(field, opinion(stand_of(field), on_pads))


def _remedy_for(field: ResolvedField, drones: Iterable[str], *, anywhere: bool) -> str:
    """Return the remedy for unseen drones; anywhere: they have flown, and need not stand on their pads any more."""
    where = "anywhere" if anywhere else "on its pad"
    shown = shown_by(field.drones[name].marker for name in drones)
    return f"check light, lens and marker, and that it stands {where} in view; {shown}"


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
