"""Figures of the drones' safety: fence, separation, landing, time to get airborne; from the truth, if there is one."""

from itertools import combinations

import numpy as np

from groundstation.bus.messages import STANDING, UNHEARD
from groundstation.field.room import Fence
from groundstation.report.accuracy import time_grid
from groundstation.report.aloft import aloft_at
from groundstation.report.tracks import RunData, TruthTrack
from groundstation.report.unreported import unreported
from groundstation.sensing.from_field import boxes_from_field

# Contact with the floor lets a body sink by fractions of this; it is no breach of a fence.
_TOUCH_M = 1e-3


def fence_violation_m(track: TruthTrack, fence: Fence) -> float:
    """Return the largest distance outside the fence of a flying body [m]; 0 if below 1 mm."""
    position = track.position_m[~track.on_ground]
    if len(position) == 0:
        return 0.0
    low = np.array([fence.x_m[0], fence.y_m[0], fence.z_m[0]])
    high = np.array([fence.x_m[1], fence.y_m[1], fence.z_m[1]])
    outside = np.maximum(np.maximum(low - position, position - high), 0.0)
    worst = float(np.linalg.norm(outside, axis=1).max())
    return worst if worst > _TOUCH_M else 0.0


def max_fence_violation_m(data: RunData) -> float | None:
    """Return the worst of all drones, or None without truth."""
    tracks = [data.truth[name] for name in data.drones if name in data.truth]
    return max((fence_violation_m(track, data.resolved.room.fence) for track in tracks), default=None)


def min_obstacle_m(data: RunData) -> float | None:
    """Return the smallest distance of a flying drone's centre from an obstacle; None without either, or truth."""
    tracks = [data.truth[name] for name in data.drones if name in data.truth]
    flown = np.concatenate([np.empty((0, 3)), *(track.position_m[~track.on_ground] for track in tracks)])
    boxes = boxes_from_field(data.resolved)
    return min((float(box.distances_m(flown).min()) for box in boxes), default=None) if len(flown) else None


def min_separation_m(data: RunData) -> float | None:
    """Return the smallest distance between the centres of two flying drones; None if two never flew together."""
    tracks = [data.truth[name] for name in data.drones if name in data.truth]
    distances = [_closest(first, second) for first, second in combinations(tracks, 2)]
    return min((distance for distance in distances if distance is not None), default=None)


def _closest(first: TruthTrack, second: TruthTrack) -> float | None:
    together = ~first.on_ground & second.airborne_at(first.time_s)
    if not together.any():
        return None
    between = first.position_m[together] - second.position_at(first.time_s[together])
    return float(np.linalg.norm(between, axis=1).min())


def judged_shares(data: RunData) -> dict[str, float]:
    """Return the share of its flights for which the truth of each drone is known; of those that reported a flight.

    Only if motion capture shows any drone: without, none is judged against a truth, and a simulator knows all.
    """
    tracks = {name: data.truth[name] for name in data.drones if name in data.truth}
    if all(track.is_simulated for track in tracks.values()):
        return {}
    grid, found = time_grid(0.0, data.end_s), dict[str, float]()
    for name in data.drones:
        aloft = grid[aloft_at(data.vehicles.get(name, ()), grid)]
        if len(aloft):
            found[name] = float(np.mean(tracks[name].known_at(aloft))) if name in tracks else 0.0
    return found


def landed(data: RunData) -> bool | None:
    """Return whether every drone stood on the ground at the end.

    Without a simulator: by the last reports of those that flew, since motion capture may have lost one long before;
    None if none flew, if one flew without a report, or if the recording breaks off while one flies.
    """
    down = _down_at_last(data)
    return None if down is False and data.breaks_off else down


def _down_at_last(data: RunData) -> bool | None:
    tracks = [data.truth[name] for name in data.drones if name in data.truth]
    if any(track.is_simulated for track in tracks):
        return all(bool(track.on_ground[-1]) for track in tracks) and len(tracks) == len(data.drones)
    said = [_said_down(data, name) for name in data.vehicles]
    flew = [down for down in said if down is not None]
    if not all(flew):
        return False
    return None if unreported(data) or not flew else True


def _said_down(data: RunData, name: str) -> bool | None:
    """Return whether a drone's last report was that it stands; None if it never flew."""
    reported = sorted(data.vehicles[name], key=lambda item: item.time_s)
    states = [item.message.flight_state for item in reported if item.message.flight_state not in UNHEARD]
    return None if STANDING.issuperset(states) else states[-1] in STANDING


def all_airborne_s(data: RunData) -> float | None:
    """Return the first time at which all drones flew at once [s]; None if never."""
    tracks = [data.truth[name] for name in data.drones if name in data.truth]
    if not tracks or len(tracks) < len(data.drones):
        return None
    times = tracks[0].time_s
    together = np.logical_and.reduce([track.airborne_at(times) for track in tracks])
    return float(times[int(np.argmax(together))]) if together.any() else None
