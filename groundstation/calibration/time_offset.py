"""Finds the time offset of two records of one motion, by comparing their changes under many delays."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.arrays import Array
from groundstation.geometry.parabola import least

# Differences over this time are compared: slower drifts do not count.
_WINDOW_S = 1.0
# For velocities: a vehicle's velocity loop answers an error of its velocity within some 0.2 s, after which the true
# motion depends on the error. So short differences are taken, less the part of a lasting error that they share with
# earlier ones.
_BRIEF_S = 0.13
# Of those, this many count as one beyond their overlap, by the scatter over flights: pictures are not all equally late.
_ALIKE = 4.0
_STEP_S = 0.01
NEAR_S, FAR_S = (-0.10, 0.20), (-0.40, 0.40)
"""Ranges in which an offset is searched [s]: of telemetry, and of cameras on a network."""
_REACH = 6
_LEAST = 60
_FREEDOM = 8.0


@dataclass(frozen=True, slots=True)
class Change:
    """Differences of a record: over a window, less `kept` of those over the window before. Indices into its times.

    alike: so many differences count as one, beyond the overlap of their windows.
    """

    window_s: float
    before: NDArray[np.intp]
    first: NDArray[np.intp]
    second: NDArray[np.intp]
    kept: float = 0.0
    alike: float = 1.0

    def __call__(self, values: Array) -> Array:
        """Return the differences (n, k) of a record's values (times, k)."""
        now = values[self.second] - values[self.first]
        return now - self.kept * (values[self.first] - values[self.before]) if self.kept else now


@dataclass(frozen=True, slots=True)
class Part:
    """Two records of one motion: times and values (n, k) of one, the other as a function, and the changes compared."""

    times: Array
    values: Array
    other: Callable[[Array, float], Array]
    change: Change


def _pairs(times: Array, window_s: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return pairs of indices about a window apart."""
    second = np.searchsorted(times, times + window_s)
    first = np.flatnonzero(second < len(times))
    second = second[first]
    near = times[second] - times[first] < 1.3 * window_s + 0.03
    return first[near], second[near]


def across(times: Array) -> Change:
    """Return the differences over a second of a record with these times."""
    first, second = _pairs(times, _WINDOW_S)
    return Change(_WINDOW_S, first, first, second)


def briefly(times: Array, lasting_s: float) -> Change:
    """Return short differences of positions, less the effect of a velocity error that lasts this long [s]."""
    first, second = _pairs(times, _BRIEF_S)
    follows = np.full(len(times), -1)
    follows[first] = second
    kept = follows[second] >= 0
    share = float(np.exp(-_BRIEF_S / lasting_s))
    return Change(_BRIEF_S, first[kept], second[kept], follows[second[kept]], share, _ALIKE)


def interpolated(times: Array, values: Array) -> Callable[[Array, float], Array]:
    """Return (times, delay) -> reported values under this delay."""

    def at(wanted: Array, delay_s: float) -> Array:
        return np.column_stack([np.interp(wanted, times - delay_s, column) for column in values.T])

    return at


def shift_between(
    parts: list[Part], scaled: bool, within_s: tuple[float, float] = NEAR_S
) -> tuple[float, float] | None:
    """Return the delay of the second of two records of the same motion, and one sigma [s].

    scaled: up to a factor; within_s: the range that is searched. None if there are too few data, or no minimum in it.
    """
    parts = [part for part in parts if len(part.change(part.values)) >= _LEAST]
    if not parts:
        return None
    # Each part is weighted by its own noise, and outliers far beyond it do not decide.
    noise = [np.median(_misfits(part, 0.0, scaled)) / part.values.shape[1] for part in parts]
    grid_s = np.arange(within_s[0], within_s[1] + 0.5 * _STEP_S, _STEP_S)
    chi = np.array(
        [sum(_robust(_misfits(p, delay, scaled) / n) for p, n in zip(parts, noise, strict=True)) for delay in grid_s]
    )
    found = least(grid_s, chi, _REACH)
    if found is None or found.curvature <= 0.0:
        return None
    # Differences overlap: this many of them count as one.
    change = parts[0].change
    variance = change.alike * max(1.0, rate_hz(parts[0].times) * change.window_s) / found.curvature
    return found.place, float(np.sqrt(variance))


def rate_hz(times: Array) -> float:
    """Return the rate of a record [Hz]."""
    return len(times) / float(np.ptp(times))


def _robust(squares: Array) -> float:
    return float((_FREEDOM * np.log1p(squares / _FREEDOM)).sum())


def _misfits(part: Part, delay_s: float, scaled: bool) -> Array:
    """Return the squared differences (n) between the two records' values of each change."""
    moved, told = part.change(part.values), part.change(part.other(part.times, delay_s))
    scale = float((moved * told).sum() / max((told * told).sum(), 1e-12)) if scaled else 1.0
    return np.asarray(((moved - scale * told) ** 2).sum(axis=1))
