"""How a drone stopped after a fault that must stop it, and whether it stayed so; by truth alone."""

import math
from dataclasses import dataclass, field

from groundstation.arrays import Array

HOVER_S, REST_S = 1.0, 3.5
REST_M_S = 0.1
# What a gust or a correction may add to a speed: a stopped drone that lands drifts at up to 0.15 m/s.
MOVES_M_S = 0.3
_MEAN_S = 0.5
# Distinguishes a stopped drone from one that pauses, and motion from a sway.
_STAYS_S = 1.0
_BOBS_M = 0.1  # how far a hover may rise again
WATCHED_S = REST_S + _STAYS_S


@dataclass(slots=True)
class Flown:
    """One drone's history: times [s], places [m; world], whether it stands, whether it gets a velocity."""

    times: list[float] = field(default_factory=list)
    places: list[tuple[float, float, float]] = field(default_factory=list)
    grounded: list[bool] = field(default_factory=list)
    told: list[bool] = field(default_factory=list)

    def see(self, now_s: float, row: Array, told: bool) -> None:
        """Record one moment. row: of the truth board."""
        self.times.append(now_s)
        self.places.append((float(row[0]), float(row[1]), float(row[2])))
        self.grounded.append(bool(row[12]))
        self.told.append(told)


@dataclass(frozen=True, slots=True)
class Stop:
    """One stop: times until the drone no longer got a velocity, and until it rested, or stood [s].

    resumed_s: when it got a velocity again, or moved at 0.3 m/s for a second, though it still had to
    stand; None: never.
    """

    hover_s: float
    rest_s: float
    resumed_s: float | None


def stop_of(flown: Flown, since_s: float, until_s: float) -> Stop:
    """Return how a drone stopped that had to from since_s on, and to stay so until until_s [s]."""
    times, grounded, speeds = flown.times, flown.grounded, _speeds_m_s(flown, until_s)
    still = [speed < REST_M_S for speed in speeds]
    stays = max(1, round(_STAYS_S / (times[1] - times[0])))
    due = range(next(i for i, time_s in enumerate(times) if time_s >= since_s), len(times))
    hover_s = next((times[i] for i in due if grounded[i] or not flown.told[i]), times[-1]) - since_s
    rest_s = next((times[i] for i in due if grounded[i] or all(still[i : i + stays])), times[-1]) - since_s
    lasting = [i for i in due if times[i] < until_s]
    told = [i for i in lasting if times[i] > since_s + max(HOVER_S, hover_s) and flown.told[i] and not grounded[i]]
    moved = [
        first
        for first, last in zip(lasting, lasting[stays - 1 :], strict=False)
        if times[first] > since_s + max(REST_S, rest_s) and min(speeds[first : last + 1]) >= MOVES_M_S
    ]
    return Stop(hover_s, rest_s, min((times[i] for i in (*told, *moved)), default=None))


def _speeds_m_s(flown: Flown, until_s: float) -> list[float]:
    """Return the mean speed before each moment [m/s]; 0 for one that stands; the descent of a landing is free.

    A descent is one of a landing if no rise follows it until until_s [s].
    """
    step = max(1, round(_MEAN_S / (flown.times[1] - flown.times[0])))
    speeds: list[float] = []
    later_m = -math.inf
    for i in reversed(range(len(flown.times))):
        (x, y, z), (was_x, was_y, was_z) = flown.places[i], flown.places[max(0, i - step)]
        later_m = max(later_m, z) if flown.times[i] < until_s else z
        lands = z < was_z and later_m - z < _BOBS_M
        speed_m_s = math.hypot(x - was_x, y - was_y, 0.0 if lands else z - was_z) / _MEAN_S
        speeds.append(0.0 if flown.grounded[i] else speed_m_s)
    return speeds[::-1]
