"""Calibrates all figures of a team from one recorded flight: finds the wrong ones, and the settings that mend them."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from groundstation.arrays import Array
from groundstation.calibration.flown import Flown
from groundstation.calibration.team_batch import TeamBatch
from groundstation.calibration.team_causes import Cause, causes, freed, posterior
from groundstation.calibration.team_figures import Key, Suspicion
from groundstation.calibration.team_gain import Gain, gain
from groundstation.calibration.team_record import team_record
from groundstation.calibration.team_settings import Path, changes, unit_of, with_changes
from groundstation.field.resolved import ResolvedField

# A recording does not determine a figure whose deviation, with all others in doubt as well, is larger than this.
_NEEDED = {
    "print": 0.015,
    "focal": 0.015,
    "pan": math.radians(1.0),
    "tilt": math.radians(1.0),
    "ahead": 0.02,
    "left": 0.02,
    "up": 0.02,
    "delay": 0.01,
    "scale": 0.08,
    "velocity_delay": 0.015,
    "height_delay": 0.02,
    "own_delay": 0.01,
    "x": 0.04,
    "y": 0.04,
    "z": 0.05,
    "roll": math.radians(0.5),
    "pitch": math.radians(0.5),
    "yaw": math.radians(1.5),
}
# Smaller errors do no harm, and no change is proposed.
_WORTH = {
    "print": 0.01,
    "focal": 0.012,
    "pan": math.radians(0.8),
    "tilt": math.radians(0.8),
    "delay": 0.015,
    "scale": 0.08,
    "velocity_delay": 0.03,
    "height_delay": 0.05,
    "own_delay": 0.02,
    "roll": math.radians(0.8),
    "pitch": math.radians(0.8),
    "yaw": math.radians(1.5),
}
_WORTH_M, _SIGMAS = 0.02, 3.0
# Disturbances last: this many sightings count as one.
_ALIKE = 4.0
_HALF = 0.5


@dataclass(frozen=True, slots=True)
class Measured:
    """One figure: its error against the field and one sigma [unit], and the same with all figures in doubt.

    shown: whether the recording alone determines it well enough for use; beside: the figure (who, part) from which it
    is hardest to separate, None if there is no single one; corrected: whether a found cause moves it.
    """

    who: str
    part: str
    unit: str
    error: float
    std: float
    doubtful_std: float
    shown: bool
    beside: Key | None
    corrected: bool


@dataclass(frozen=True, slots=True)
class Found:
    """A proposed cause: owner ("": all), part, its largest error and one sigma [unit], and its rivals."""

    who: str
    what: str
    error: float
    std: float
    unit: str
    rivals: tuple[Suspicion, ...]


@dataclass(frozen=True, slots=True)
class TeamCalibration:
    """The result of a calibration.

    figures: all, in the field's order; found: proposed causes, gravest first; settings: changes that mend them; gain:
    of those changes.

    sightings: number used; misfit: their mean squared deviation (1: as expected or, with all that is allowed for,
    less).
    """

    figures: tuple[Measured, ...]
    found: tuple[Found, ...]
    settings: dict[Path, Any]
    gain: Gain | None
    sightings: int
    misfit: float


def calibrate_team(flown: Flown, field: ResolvedField) -> TeamCalibration:
    """Return the calibration from a recording; raises OperatorMistake if it has too little."""
    batch = TeamBatch(team_record(flown, field), field)
    figures = batch.figures
    explain = partial(batch.fit, alike=_ALIKE)
    free = explain(np.diag(figures.wide**2))
    told, sigma = causes(explain, free, figures.surveyed, figures.suspicions())
    final = explain(sigma)
    error, covariance = posterior(final.information, final.pull, sigma)
    _, doubtful = posterior(free.information, free.pull, np.diag(figures.wide**2))
    std = np.sqrt(np.diag(covariance))
    kept = [one for one in told if _worth(one, figures.keys, error, std)]
    moved = freed(kept) if kept else np.zeros(len(figures.keys), bool)
    settings = changes(figures, error, moved) if kept else {}
    better = gain(flown, field, with_changes(field, settings), batch.targets) if settings else None
    found = tuple(_found(one, figures.keys, error, std) for one in kept)
    measured = tuple(_measured(figures.keys, error, std, doubtful, moved))
    return TeamCalibration(measured, found, settings, better, final.used, final.misfit)


def _measured(keys: tuple[Key, ...], error: Array, std: Array, doubtful: Array, moved: Array) -> Iterator[Measured]:
    """Yield all figures; doubtful (n, n): their covariance if each of them may be quite wrong."""
    doubtful_std = np.sqrt(np.diag(doubtful))
    for index, (who, part) in enumerate(keys):
        factor, unit = unit_of(part)
        shown = bool(doubtful_std[index] <= _NEEDED[part])
        off, one, doubt = (float(factor * value[index]) for value in (error, std, doubtful_std))
        yield Measured(who, part, unit, off, one, doubt, shown, _beside(index, doubtful, keys), bool(moved[index]))


def _beside(index: int, covariance: Array, keys: tuple[Key, ...]) -> Key | None:
    """Return the figure that, if it were known, would reduce the variance of this one most, and at least by half."""
    std = np.sqrt(np.diag(covariance))
    alike = np.abs(covariance[index] / (std * std[index]))
    alike[index] = 0.0
    nearest = int(np.argmax(alike))
    return keys[nearest] if alike[nearest] ** 2 >= _HALF else None


def _largest(cause: Cause, error: Any) -> int:
    moved = freed([cause])
    return int(np.argmax(np.where(moved, np.abs(error), -1.0)))


def _worth(cause: Cause, keys: tuple[Key, ...], error: Any, std: Any) -> bool:
    most = _largest(cause, error)
    return bool(abs(error[most]) > max(_WORTH.get(keys[most][1], _WORTH_M), _SIGMAS * std[most]))


def _found(cause: Cause, keys: tuple[Key, ...], error: Any, std: Any) -> Found:
    most = _largest(cause, error)
    factor, unit = unit_of(keys[most][1])
    return Found(
        cause.suspicion.who,
        cause.suspicion.what,
        float(factor * error[most]),
        float(factor * std[most]),
        unit,
        cause.rivals,
    )
