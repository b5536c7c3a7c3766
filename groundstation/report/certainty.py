"""How well the tracker itself knew targets and drones while it tracked: all there is to judge where nothing is true."""

import numpy as np
from numpy.typing import NDArray

from groundstation.arrays import Array, BoolArray
from groundstation.bus.messages import UP
from groundstation.report.accuracy import RATE_HZ, STALE_S
from groundstation.report.aloft import aloft_at
from groundstation.report.tracks import CertaintyTrack, RunData
from groundstation.report.unreported import unreported


def target_unseen_s(data: RunData, time_s: Array) -> float | None:
    """Return for how long the worst target was absent, searched for, or unseen for `lost_after_s`, at 10 Hz [s]."""
    if not len(time_s):
        return None
    lost_after_s = data.resolved.estimator.lost_after_s
    unseen = (_unseen(data.certainties.get(name), time_s, lost_after_s) for name in data.tracked)
    return max((float(np.count_nonzero(one) / RATE_HZ) for one in unseen), default=None)


def drone_uncertain_s(data: RunData, time_s: Array) -> float | None:
    """Return the longest time for which the place of any flying drone was unknown [s]; None if none flew then.

    None as well if one flew of which no report is recorded.

    Unknown: absent from the estimates, contradicted by sightings, or unlocalised, at 10 Hz. A drone that takes off or
    lands may be out of view.
    """
    if unreported(data):
        return None
    found = [
        longest_s
        for name in data.drones
        if (longest_s := _longest_s(data.certainties.get(name), time_s, _flying(data, name, time_s))) is not None
    ]
    return max(found, default=None)


def _flying(data: RunData, name: str, time_s: Array) -> BoolArray:
    return aloft_at(data.vehicles.get(name, ()), time_s, UP)


def _latest(track: CertaintyTrack, time_s: Array) -> tuple[NDArray[np.intp], BoolArray]:
    """Return the index of the newest estimate at each time (m), and whether it is younger than 0.5 s (m)."""
    index = np.searchsorted(track.time_s, time_s, side="right") - 1
    newest = np.clip(index, 0, None)
    fresh: BoolArray = (index >= 0) & (time_s - track.time_s[newest] <= STALE_S)
    return newest, fresh


def _unseen(track: CertaintyTrack | None, time_s: Array, lost_after_s: float) -> BoolArray:
    if track is None:
        return np.ones(len(time_s), dtype=bool)
    newest, fresh = _latest(track, time_s)
    unseen: BoolArray = ~fresh | track.doubted[newest] | (track.age_s[newest] > lost_after_s)
    return unseen


def _longest_s(track: CertaintyTrack | None, time_s: Array, flying: BoolArray) -> float | None:
    """Return the longest uncertain time of one drone [s]; None if it never flew."""
    if not flying.any():
        return None
    if track is None:
        return longest_s(flying)
    newest, fresh = _latest(track, time_s)
    unlocalised_s = track.unlocalised_s[newest][fresh & flying]
    doubted_s = longest_s(flying & (~fresh | track.doubted[newest]))
    # Since its last sighting, which may be before the time that counts.
    return max(doubted_s, min(float(unlocalised_s.max(initial=0.0)), float(np.count_nonzero(flying) / RATE_HZ)))


def longest_s(held: BoolArray) -> float:
    """Return the longest time for which something held without a break [s]."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], held, [False]))))
    return float((edges[1::2] - edges[::2]).max(initial=0) / RATE_HZ)
