"""Selects the sightings of a recording that a team is fitted to."""

from collections.abc import Collection

import numpy as np

from groundstation.calibration.team_record import Sightings, TeamRecord
from groundstation.field.resolved import ResolvedField

LEAST_SEEN = 60
"""Least numbers of sightings of a drone by fixed cameras, for its path, and of a target by drones."""
# Sightings this near to a jump of the drone's own heading are left out [s].
_JUMP_S = 0.4


def seen_from_above(sightings: Sightings, field: ResolvedField, name: str) -> bool:
    """Return whether fixed cameras saw a drone often enough for its path."""
    found = sum(s == name and o in field.cameras for o, s in zip(sightings.observers, sightings.subjects, strict=True))
    return found >= LEAST_SEEN


def usable(record: TeamRecord, field: ResolvedField, drones: Collection[str]) -> Sightings:
    """Return the sightings of these drones and the targets by fixed cameras and these drones.

    Those about a jump of a heading are left out.
    """
    known = {*drones, *field.cameras}
    pairs = zip(record.sightings.observers, record.sightings.subjects, strict=True)
    kept = [
        i
        for i, (o, s) in enumerate(pairs)
        if o in known and (s in drones or s in field.tracked) and _calm(record, (o, s), record.sightings.times[i])
    ]
    return only(record.sightings, kept)


def only(s: Sightings, kept: list[int]) -> Sightings:
    """Return the sightings at some places, in their order."""
    names = tuple(s.observers[i] for i in kept), tuple(s.subjects[i] for i in kept)
    return Sightings(s.times[kept], *names, s.seen[kept], s.covariance[kept], s.other[kept])


def _calm(record: TeamRecord, names: tuple[str, str], at_s: float) -> bool:
    """Return whether no heading of the two entities jumps about that time."""
    for name in names:
        if name in record.own:
            own = record.own[name]
            first, last = np.searchsorted(own.times, (at_s - _JUMP_S, at_s + _JUMP_S))
            if first < last and own.resets[first] != own.resets[min(last, len(own.times) - 1)]:
                return False
    return True
