"""The figures of a field that a recording may prove wrong: names, precision, and place in the field."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array, IntArray, Vector
from groundstation.field.resolved import ResolvedField

Key = tuple[str, str]
"""A figure: its owner, and which figure."""

# One sigma of a figure that was surveyed with care (more where the field says so), and of one that may be quite wrong:
# [m], [rad], [s], shares.
_SURVEYED = {
    "print": 0.003,
    "focal": 0.004,
    "pan": math.radians(0.4),
    "tilt": math.radians(0.4),
    "ahead": 0.005,
    "left": 0.005,
    "up": 0.005,
    "delay": 0.006,
    "scale": 0.04,
    "velocity_delay": 0.02,  # over healthy flights (docs/explanation/estimation.md 10)
    "height_delay": 0.02,
    "own_delay": 0.006,
}
_WRONG = {
    "print": 0.08,
    "focal": 0.03,
    "pan": 0.09,
    "tilt": 0.09,
    "ahead": 0.05,
    "left": 0.05,
    "up": 0.05,
    "delay": 0.08,
    "scale": 0.15,
    "velocity_delay": 0.06,
    "height_delay": 0.08,
    "own_delay": 0.08,
    "x": 0.4,
    "y": 0.4,
    "z": 0.4,
    "roll": 0.1,
    "pitch": 0.1,
    "yaw": 0.4,
}
ONBOARD = ("pan", "tilt", "ahead", "left", "up", "focal", "delay")
FIXED = ("x", "y", "z", "roll", "pitch", "yaw", "focal", "delay")
OWN = ("scale", "velocity_delay", "height_delay", "own_delay")  # own_delay: of all that a drone reports of itself
_PLACES, _ANGLES = ("x", "y", "z"), ("roll", "pitch", "yaw")
_PLACED = ("ahead", "left", "up")
_OF_DRONES_CAMERAS = ("pan", "tilt", "focal", *_PLACED)


@dataclass(frozen=True, slots=True)
class Suspicion:
    """Figures that may be wrong together: directions (n, k) of their errors by a common cause, one sigma each (k).

    what: the part's name, or the common name of its parts; who: "" for all.
    """

    who: str
    what: str
    directions: Array
    sigma: Vector


class Figures:
    """The figures of cameras, markers and drones that a recording can determine, in a fixed order."""

    def __init__(self, field: ResolvedField, drones: Sequence[str]) -> None:
        self.field, self.drones = field, tuple(drones)
        self.prints = (*self.drones, *field.tracked)
        self.keys: tuple[Key, ...] = (
            *((name, "print") for name in self.prints),
            *((name, part) for name in field.cameras for part in FIXED),
            *((name, part) for name in self.drones for part in (*ONBOARD, *OWN)),
        )
        self.place = {key: i for i, key in enumerate(self.keys)}
        self.surveyed = np.array([self._surveyed(key) for key in self.keys])
        self.wide = np.array(
            [max(_WRONG[part], survey) for (_, part), survey in zip(self.keys, self.surveyed, strict=True)]
        )

    def _surveyed(self, key: Key) -> float:
        who, part = key
        if part in _PLACES:
            return max(self.field.cameras[who].position_std_m, 2e-3)
        if part in _ANGLES:
            return max(math.radians(self.field.cameras[who].attitude_std_deg), 1e-3)
        return max(_SURVEYED[part], self._told(who, part))

    def _told(self, who: str, part: str) -> float:
        """Return the field's sigma for a lens or the mounting of a drone's camera; 0 if it gives none."""
        if part == "focal" and who in self.field.cameras:
            return self.field.cameras[who].calibration.focal_std
        if part not in _OF_DRONES_CAMERAS:
            return 0.0
        camera = self.field.drones[who].camera
        if part == "focal":
            return camera.calibration.focal_std
        return camera.position_std_m if part in _PLACED else math.radians(camera.attitude_std_deg)

    def of(self, theta: Vector, names: Sequence[str], part: str) -> Vector:
        """Return one figure for each of many names, 0 if a name has none."""
        lookup = {name: float(theta[self.place[name, part]]) for name in set(names) if (name, part) in self.place}
        return np.array([lookup.get(name, 0.0) for name in names])

    def columns(self, names: Sequence[str], part: str) -> IntArray:
        """Return the index of one figure for each of many names, -1 if a name has none."""
        return np.array([self.place.get((name, part), -1) for name in names], dtype=np.int64)

    def suspicions(self) -> Iterator[Suspicion]:
        """Yield all suspicions: groups of figures that one cause makes wrong."""
        n = len(self.keys)
        for place, (who, part) in enumerate(self.keys):
            if part not in ("x", "y", "roll", "pitch"):
                yield Suspicion(who, part, np.eye(n)[:, [place]], self.wide[[place]])
        for name in self.field.cameras:
            for what, parts in (("aside", ("x", "y")), ("tilted", ("roll", "pitch"))):
                places = [self.place[name, part] for part in parts]
                yield Suspicion(name, what, np.eye(n)[:, places], self.wide[places])
        for part in ("print", "pan", "tilt", "focal", "delay"):
            places = [i for i, (who, other) in enumerate(self.keys) if other == part and who not in self.field.cameras]
            if len(places) > 1:
                direction = np.zeros((n, 1))
                direction[places] = 1.0
                yield Suspicion("", part, direction, self.wide[places[:1]])
