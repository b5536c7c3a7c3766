"""True paths of bodies from a motion capture system that judges flights (`truth: {from: ...}` in the field)."""

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from groundstation.arrays import Array
from groundstation.bus.messages import BodyPoses, VehicleStatus
from groundstation.report.aloft import aloft_at
from groundstation.report.tracks import TimedMessage, TruthTrack

# Without a pose for this long, or for this many periods, a body's place is unknown.
_MAX_GAP_S, _PERIODS = 0.5, 4.0


def captured_tracks(
    poses: Iterable[TimedMessage[BodyPoses]],
    vehicles: Mapping[str, Sequence[TimedMessage[VehicleStatus]]],
    rate_hz: float = 30.0,
) -> dict[str, TruthTrack]:
    """Return the track of each body from the system's poses, without those that cannot be true; rate_hz: the system's.

    A drone is on the ground as long as it reports so, and unchanged while it is silent; a body without a driver
    is always on the ground.
    """
    rows: dict[str, list[tuple[float, ...]]] = {}
    for item in poses:
        for body in item.message.bodies:
            if body.name not in item.message.refused:
                rows.setdefault(body.name, []).append((item.time_s, *body.position_m, _yaw(*body.attitude)))
    max_gap_s = max(_MAX_GAP_S, _PERIODS / rate_hz)
    return {name: _track(np.array(sorted(found)), vehicles.get(name, ()), max_gap_s) for name, found in rows.items()}


def _yaw(w: float, x: float, y: float, z: float) -> float:
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def _track(table: Array, statuses: Sequence[TimedMessage[VehicleStatus]], max_gap_s: float) -> TruthTrack:
    return TruthTrack(table[:, 0], table[:, 1:4], table[:, 4], ~aloft_at(statuses, table[:, 0]), max_gap_s)
