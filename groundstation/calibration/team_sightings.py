"""Selects the sightings of a recording for the fit of a team."""

from collections.abc import Collection

from groundstation.calibration.team_record import Sightings, TeamRecord
from groundstation.field.resolved import ResolvedField

LEAST_SEEN = 60
"""Least numbers of sightings of a drone by fixed cameras, for its path, and of a target by drones."""


def seen_from_above(sightings: Sightings, field: ResolvedField, name: str) -> bool:
    """Return whether fixed cameras saw a drone often enough for its path."""
    found = sum(s == name and o in field.cameras for o, s in zip(sightings.observers, sightings.subjects, strict=True))
    return found >= LEAST_SEEN


def usable(record: TeamRecord, field: ResolvedField, drones: Collection[str]) -> Sightings:
    """Return the sightings of these drones and the targets by fixed cameras and these drones, where motion is known."""
    known = {*drones, *field.cameras}
    pairs = zip(record.sightings.observers, record.sightings.subjects, strict=True)
    kept = [
        i
        for i, (o, s) in enumerate(pairs)
        if o in known and (s in drones or s in field.tracked) and record.shows((o, s), record.sightings.times[i])
    ]
    return only(record.sightings, kept)


def only(s: Sightings, kept: list[int]) -> Sightings:
    """Return the sightings at some places, in their order."""
    names = tuple(s.observers[i] for i in kept), tuple(s.subjects[i] for i in kept)
    return Sightings(s.times[kept], *names, s.seen[kept], s.covariance[kept], s.other[kept])
