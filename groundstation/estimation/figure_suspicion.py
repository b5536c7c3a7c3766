"""Tests which single wrong figure of the field explains that loops of sightings do not close. Pure.

Normal equations over all figures, fed with one mean a second for each loop, because what disturbs a loop (how a vehicle
leans, by its own account) lasts for seconds. Each suspicion frees the figures of one thing and holds all others at
their surveys; its evidence is that of a linear Gaussian model.
"""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array, Matrix, Vector
from groundstation.errors import EstimatorFault
from groundstation.estimation.linear import cholesky
from groundstation.estimation.sight_loops import Gap, Key
from groundstation.field.room import WorldCamera

TILTED = "tilted"
"""What is wrong with a fixed camera's roll and pitch together."""

# How well each figure is known (one sigma), and how wrong a suspect may be: shares, [rad], [s], [m].
_SURVEYED = {
    "print": 0.003,
    "focal": 0.004,
    "pan": math.radians(0.5),
    "tilt": math.radians(0.8),
    "delay": 0.008,
}
# A tilt of a vehicle that is levelled by its IMU.
_LEVELLED_RAD = math.radians(0.5)
_WRONG = {
    "print": 0.08,
    "focal": 0.08,
    "pan": math.radians(5.0),
    "tilt": math.radians(5.0),
    "delay": 0.08,
    "z": 0.1,
    "roll": math.radians(5.0),
    "pitch": math.radians(5.0),
}
# What is told only from so far on: less does not harm.
_WORTH_TELLING = {
    "print": 0.02,
    "focal": 0.02,
    "pan": math.radians(1.2),
    "tilt": math.radians(1.5),
    "delay": 0.03,
    "z": 0.06,
    TILTED: math.radians(1.2),
}
_BLOCK_S, _FORGETTING_S = 1.0, 40.0
_LEAST_IN_BLOCK, _OUTLYING = 3, 4.0
# What puts a loop wrong lasts for as many blocks.
_LASTS = 2.0
_SURE, _REFUTED, _RULED_OUT = math.log(100.0), math.log(3.0), math.log(20.0)
_PATIENCE = 3


@dataclass(frozen=True, slots=True)
class Suspect:
    """One thing that may be wrong: the figure of one entity, or of all ("")."""

    who: str
    part: str


@dataclass(frozen=True, slots=True)
class Charge:
    """A suspect with the size of its error, one sigma, and by how much (log) it explains more than nothing does."""

    suspect: Suspect
    size: float
    std: float
    lead: float


class FigureSuspicion:
    """Fed with gaps; `judge` once a second."""

    def __init__(self, keys: Sequence[Key], fixed: Mapping[str, WorldCamera]) -> None:
        self._keys, self._fixed = tuple(keys), fixed
        n = len(self._keys)
        self._information, self._pull = np.zeros((n, n)), np.zeros(n)
        self._block: dict[str, list[Gap]] = {}
        self._block_ends_s = -math.inf
        self._held = 0
        self._delays = np.array([part == "delay" for _, part in self._keys], dtype=np.float64)
        self._surveyed = np.array([self._survey(who, part) for who, part in self._keys])
        self.charges: tuple[Charge, ...] = ()

    def _survey(self, who: str, part: str) -> float:
        if part in _SURVEYED:
            return _SURVEYED[part]
        camera = self._fixed[who]
        return max(camera.position_std_m, 2e-3) if part == "z" else max(math.radians(camera.attitude_std_deg), 1e-3)

    def take(self, gap: Gap) -> None:
        """Take a loop that has closed."""
        if gap.at_s >= self._block_ends_s:
            self._end_block()
            self._block_ends_s = gap.at_s + _BLOCK_S
        self._block.setdefault(gap.name, []).append(gap)

    def _end_block(self) -> None:
        keep = 0.5 ** (_BLOCK_S / _FORGETTING_S)
        self._information *= keep
        self._pull *= keep
        for gaps in self._block.values():
            if len(gaps) >= _LEAST_IN_BLOCK:
                self._add(gaps)
        self._block.clear()

    def _add(self, gaps: Sequence[Gap]) -> None:
        """Add a second's median, in which a lean lasts, and how single loops differ from their mean.

        Of the latter only delays count: derivatives by sizes hold the same noise as the loop itself.
        """
        apart, slopes = np.array([one.apart for one in gaps]), np.array([one.by_figure for one in gaps])
        if not (np.isfinite(apart).all() and np.isfinite(slopes).all()):
            return
        steady = _LASTS * float(np.mean([one.std for one in gaps])) ** 2
        self._take_rows(slopes.mean(axis=0), np.median(apart, axis=0), steady)
        differing = np.abs(apart - np.median(apart, axis=0)).max(axis=1) < _OUTLYING * gaps[0].jitter
        if differing.sum() >= _LEAST_IN_BLOCK:
            apart, slopes = apart[differing], slopes[differing]
            rows = self._delays * (slopes - slopes.mean(axis=0)).reshape(-1, len(self._keys))
            self._take_rows(rows, (apart - apart.mean(axis=0)).ravel(), gaps[0].jitter ** 2)

    def _take_rows(self, slopes: Array, apart: Vector, variance: float) -> None:
        self._information += slopes.T @ slopes / variance
        self._pull -= slopes.T @ apart / variance

    def judge(self, levelled: Collection[str] = ()) -> tuple[Charge, ...]:
        """Return who is to be named now: nobody, one, or several that cannot be told apart; likeliest first.

        levelled: drones whose lean is told by an IMU, so that none of it passes for their cameras' tilt.
        """
        for place, (who, part) in enumerate(self._keys):
            if part == "tilt":
                self._surveyed[place] = _LEVELLED_RAD if who in levelled else _SURVEYED[part]
        charges = sorted(self._charges(self._held_to_surveys()), key=lambda charge: -charge.lead)
        best = charges[0]
        wanted = bool(self.charges)
        if best.lead > _SURE and abs(best.size) > _WORTH_TELLING[best.suspect.part]:
            wanted = True
        elif best.lead < _REFUTED:
            wanted = False
        self._held = self._held + 1 if wanted else 0
        named = tuple(one for one in charges if one.lead > best.lead - _RULED_OUT)
        self.charges = named if self._held >= _PATIENCE else ()
        return self.charges

    def _held_to_surveys(self) -> "_Fit":
        posterior, determinant = _covariance(self._information + np.diag(1.0 / self._surveyed**2))
        return _Fit(posterior, determinant - 2.0 * float(np.sum(np.log(self._surveyed))))

    def _charges(self, nothing: "_Fit") -> Iterator[Charge]:
        before = nothing.evidence(self._pull)
        for suspect, places in self._suspects().items():
            fit = nothing
            for place in places:
                fit = fit.freed(place, float(self._surveyed[place]), _WRONG[self._keys[place][1]])
            sizes = fit.posterior @ self._pull
            most = places[int(np.argmax(np.abs(sizes[list(places)])))]
            size = float(np.hypot(*sizes[list(places)])) if suspect.part == TILTED else float(sizes[most])
            std = math.sqrt(fit.posterior[most, most])
            yield Charge(suspect, size, std, fit.evidence(self._pull) - before)

    def _suspects(self) -> Mapping[Suspect, tuple[int, ...]]:
        found: dict[Suspect, tuple[int, ...]] = {
            Suspect(who, part): (place,)
            for place, (who, part) in enumerate(self._keys)
            if part not in ("roll", "pitch")
        }
        for name in self._fixed:
            found[Suspect(name, TILTED)] = tuple(self._keys.index((name, part)) for part in ("roll", "pitch"))
        for part in ("pan", "tilt"):
            places = tuple(place for place, key in enumerate(self._keys) if key[1] == part)
            if len(places) > 1:
                found[Suspect("", part)] = places
        return found


@dataclass(frozen=True, slots=True)
class _Fit:
    """Covariance of all figures, and the logarithm of its determinant less that of what was known before."""

    posterior: Matrix
    spread: float

    def evidence(self, pull: Vector) -> float:
        """Return the logarithm of how well the loops are explained; only differences tell anything."""
        return 0.5 * (float(pull @ self.posterior @ pull) + self.spread)

    def freed(self, place: int, surveyed: float, wrong: float) -> "_Fit":
        """Return the fit in which one figure may be wrong, by the formula of Sherman and Morrison."""
        column = self.posterior[:, place]
        less = 1.0 / wrong**2 - 1.0 / surveyed**2
        scale = 1.0 + less * float(column[place])
        posterior = self.posterior - less / scale * np.outer(column, column)
        return _Fit(posterior, self.spread - math.log(scale) - 2.0 * math.log(wrong / surveyed))


def _covariance(information: Matrix) -> tuple[Matrix, float]:
    """Return the covariance of an information matrix, and the logarithm of its determinant, by Cholesky's factor."""
    factor, size = information.copy(), len(information)
    if not cholesky(factor, size):
        raise EstimatorFault("the information of the figures is not positive definite")
    inverse = np.zeros_like(information)
    for row in range(size):
        inverse[row, row] = 1.0
        inverse[row] = (inverse[row] - factor[row, :row] @ inverse[:row]) / factor[row, row]
    return inverse.T @ inverse, -2.0 * float(np.sum(np.log(np.diag(factor))))
