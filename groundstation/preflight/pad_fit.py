"""Fits figures of cameras, prints and pads to sightings of standing drones: one least-squares fit per suspicion. Pure.

All figures have priors as tight as their surveys; a suspicion loosens the priors of one part. The evidence of a
suspicion is Laplace's approximation: how well it explains the sightings, less a penalty for its freedom.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from groundstation.arrays import Array, Vector
from groundstation.geometry.rotations import rotations_from_euler
from groundstation.preflight.stand import (
    LENS_STD,
    PLACED_M,
    PLACED_RAD,
    PRINT_STD,
    PadSighting,
    Stand,
    marker_centres,
)

PER_CAMERA = ("x", "y", "z", "roll", "pitch", "yaw", "focal")
PER_DRONE = ("aside_x", "aside_y", "turned", "higher", "print")
TEAM_PRINT = ("", "print")
_SCATTER_M, _SCATTER_SHARE, _SCATTER_RAD = 0.003, 0.002, math.radians(0.5)
# Few pixels a square (docs/reference/vision.md 8): the board's place in their grid shifts its distance, by this share
# at 4 px, and does not average out. The share was measured at 4 px; that boards are read from 4 px on
# (settings/marker_sizes.py) is another figure.
_COARSE_SHARE, _COARSE_PX, _COARSE_POWER = 0.0035, 4.0, 10
_STEPS, _DIFFERENCE = 8, 1e-6

Key = tuple[str, str]
"""A figure: the name of its camera or drone ("": all), and which of its figures."""


@dataclass(frozen=True, slots=True)
class Fit:
    """The result of a fit.

    value, std: of each figure, as an error of the field; evidence: log; misfit: chi-square of `rows` rows.
    """

    value: Mapping[Key, float]
    std: Mapping[Key, float]
    evidence: float
    misfit: float
    rows: int


class PadFit:
    """Sightings of standing drones, ready to be fitted."""

    def __init__(self, stand: Stand, sightings: Sequence[PadSighting]) -> None:
        self.stand, self.sightings = stand, tuple(sightings)
        cameras, drones = [s.camera for s in self.sightings], [s.drone for s in self.sightings]
        self.keys: tuple[Key, ...] = (
            TEAM_PRINT,
            *product(dict.fromkeys(cameras), PER_CAMERA),
            *product(dict.fromkeys(drones), PER_DRONE),
        )
        self._place = {key: index for index, key in enumerate(self.keys)}
        self._columns = {part: [self._place[name, part] for name in cameras] for part in PER_CAMERA}
        self._columns |= {part: [self._place[name, part] for name in drones] for part in PER_DRONE}
        seen_by = [stand.cameras[name] for name in cameras]
        self._rotations = np.array([camera.rotation for camera in seen_by])
        self._positions = np.array([camera.position_m for camera in seen_by])
        self._tight = np.array([self._prior(key) for key in self.keys])
        self._at_rest: tuple[Vector, Array] | None = None
        self._seen = np.concatenate([[*s.position_m, s.yaw_rad] for s in self.sightings])
        self._used = np.isfinite(self._seen)
        self._weights = np.concatenate([self._deviations(s) for s in self.sightings])[self._used]

    def _deviations(self, s: PadSighting) -> Vector:
        """Return the standard deviations of one sighting: its own, and those of errors that do not average out."""
        far = float(np.linalg.norm(s.position_m))
        pixels = self.stand.cameras[s.camera].focal_px * self.stand.pads[s.drone].square_m / far
        share = math.hypot(_SCATTER_SHARE, _COARSE_SHARE * (_COARSE_PX / pixels) ** _COARSE_POWER)
        floor = np.array([_SCATTER_M, _SCATTER_M, math.hypot(_SCATTER_M, share * far), _SCATTER_RAD])
        return np.asarray(np.hypot(np.sqrt(np.maximum(np.diag(s.covariance), 0.0)), floor))

    def _prior(self, key: Key) -> float:
        name, part = key
        match part:
            case "print":
                return PRINT_STD
            case "focal":
                return LENS_STD
            case "x" | "y" | "z":
                return self.stand.cameras[name].position_std_m
            case "roll" | "pitch" | "yaw":
                return self.stand.cameras[name].attitude_std_rad
            case "higher":
                return self.stand.pads[name].height_std_m
            case "turned":
                return PLACED_RAD
            case _:
                return PLACED_M

    def promise(self, loose: Mapping[Key, float]) -> float:
        """Return the approximate evidence that `explain` would find, by derivatives at zero error."""
        sigma = self._sigma(loose)
        if self._at_rest is None:
            self._at_rest = self._linearised(np.zeros(len(self.keys)))
        r, J = self._at_rest
        scaled = J * sigma
        spread = np.eye(len(r)) + scaled @ scaled.T
        return -0.5 * float(r @ np.linalg.solve(spread, r) + np.linalg.slogdet(spread)[1])

    def _sigma(self, loose: Mapping[Key, float]) -> Vector:
        sigma = self._tight.copy()
        for key, std in loose.items():
            sigma[self._place[key]] = std
        return sigma

    def explain(self, loose: Mapping[Key, float], start: Mapping[Key, float] | None = None) -> Fit:
        """Return the best fit if the given figures may err by the given sigmas, from a start."""
        sigma, theta = self._sigma(loose), np.zeros(len(self.keys))
        for key, value in (start or {}).items():
            theta[self._place[key]] = value
        prior = np.diag(1.0 / sigma**2)
        for _ in range(_STEPS):
            r, J = self._linearised(theta)
            information = J.T @ J + prior
            step = np.linalg.solve(information, J.T @ r - prior @ theta)
            theta = theta + step
            if float(np.max(np.abs(step) / sigma)) < 1e-4:
                break
        r, J = self._linearised(theta)
        information = J.T @ J + prior
        misfit = float(r @ r + theta @ prior @ theta)
        spread = float(np.linalg.slogdet(information)[1]) + 2.0 * float(np.sum(np.log(sigma)))
        std = np.sqrt(np.diag(np.linalg.inv(information)))
        return Fit(
            dict(zip(self.keys, theta.tolist(), strict=True)),
            dict(zip(self.keys, std.tolist(), strict=True)),
            -0.5 * (misfit + spread),
            misfit,
            len(r),
        )

    def _linearised(self, theta: Vector) -> tuple[Vector, Array]:
        """Return residuals (n) and derivatives of the prediction (n, figures), both in standard deviations."""
        moved = theta + np.vstack((np.zeros(len(theta)), _DIFFERENCE * np.eye(len(theta))))
        predicted, *others = self._predicted(moved)
        J = _wrapped(np.array(others) - predicted).T / _DIFFERENCE
        r = _wrapped(np.where(self._used, self._seen, 0.0) - predicted)
        return r[self._used] / self._weights, J[self._used] / self._weights[:, None]

    def _predicted(self, thetas: Array) -> Array:
        """Return (x, y, z [camera_optical], heading) of all sightings under sets of errors of the field.

        thetas: (n, figures), the result (n, 4 sightings). All sets are computed at once: the supervisor waits for the
        answer.
        """
        of = {part: thetas[:, columns] for part, columns in self._columns.items()}
        aside = np.stack((of["aside_x"], of["aside_y"]), axis=-1)
        pads = [self.stand.pads[s.drone] for s in self.sightings]
        centres = marker_centres(pads, aside, of["turned"], of["higher"])
        moved = np.stack((of["x"], of["y"], of["z"]), axis=-1)
        error = rotations_from_euler(of["roll"], of["pitch"], of["yaw"])
        away = (centres - self._positions - moved)[..., None, :]
        optical = (away @ error @ self._rotations)[..., 0, :]
        # A larger print looks nearer in all directions, a longer lens along the axis only.
        optical /= ((1.0 + thetas[:, [self._place[TEAM_PRINT]]]) * (1.0 + of["print"]))[..., None]
        optical[..., 2] /= 1.0 + of["focal"]
        yaw = np.array([pad.yaw_rad for pad in pads]) + of["turned"]
        ahead = np.stack((np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)), axis=-1)[..., None, :]
        facing = (ahead @ error)[..., 0, :]
        heading = np.arctan2(facing[..., 1], facing[..., 0])
        return np.concatenate((optical, heading[..., None]), axis=-1).reshape(len(thetas), -1)


def _wrapped(rows: Array) -> Array:
    """Return rows (..., 4 sightings) of x, y, z, heading, ... with headings in [-pi, pi]."""
    rows = rows.copy()
    rows[..., 3::4] = np.remainder(rows[..., 3::4] + math.pi, math.tau) - math.pi
    return rows
