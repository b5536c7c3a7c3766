"""Finds robots that a world-fixed camera should see and does not: their estimate is doubted."""

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from groundstation.arrays import Array
from groundstation.bus.messages import SearchedPicture
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.belief_history import BeliefHistory
from groundstation.sensing.detection import detection
from groundstation.sensing.models import SensorSuite
from groundstation.sensing.occlusion import SOFT_M, box_rows, sight
from groundstation.sensing.visibility import camera_rows
from groundstation.time_units import NS_PER_S

_SEEN_S = 0.6  # a robot seen this recently is not missing
_DOUBT = math.log(0.02)  # log of the probability that a robot is at its estimated place and yet in none of the pictures
_BODY_M = 0.5  # a robot this near to the line of sight hides what is behind it
_FIXED = np.zeros(4)


class MissingRobots:
    """Accumulates pictures that should show robots. Use: `take` them, `advance` with each belief, read `missed_s`."""

    def __init__(self, sensors: SensorSuite, robots: Sequence[str]) -> None:
        self._sensors, self._robots = sensors, tuple(robots)
        self._cameras = {name: camera_rows([camera], sensors.softness) for name, camera in sensors.world.items()}
        self._boxes = box_rows(sensors.obstacles)
        self._pictures: list[SearchedPicture] = []
        self._history = BeliefHistory()
        self._evidence: dict[str, float] = {}
        self._since_ns: dict[str, int] = {}
        self.missed_s: dict[str, float] = {}

    def take(self, picture: SearchedPicture) -> None:
        """Take a picture that was searched; it counts with the next `advance`."""
        if picture.observer in self._cameras:
            self._pictures.append(picture)

    def advance(self, belief: JointBelief, ages_s: Mapping[str, float]) -> tuple[str, ...]:
        """Count the pictures; returns the robots that are missing from now on.

        ages_s: time since a fixed camera last saw each airborne robot, directly or through others: two robots that see
        only each other are both missing where the camera should see them.
        """
        self._history.append(belief)
        for name in self._robots:
            if not _SEEN_S < ages_s.get(name, math.inf) < math.inf:
                self._evidence.pop(name, None)
                self._since_ns.pop(name, None)
        pictures, self._pictures = self._pictures, []
        for picture in pictures:
            self._look(picture, [name for name in ages_s if _SEEN_S < ages_s[name] < math.inf])
        missing = [name for name, evidence in self._evidence.items() if evidence < _DOUBT]
        fresh = tuple(name for name in missing if name not in self._since_ns)
        self._since_ns |= dict.fromkeys(fresh, belief.stamp_ns)
        self.missed_s = {name: (belief.stamp_ns - since) / NS_PER_S for name, since in self._since_ns.items()}
        return fresh

    def _look(self, picture: SearchedPicture, unseen: Collection[str]) -> None:
        belief = self._history.at(picture.header.stamp_ns)
        if belief is None:
            return
        for name in unseen:
            if picture.may_show(name) or name not in belief.layout:
                continue
            marker = self._sensors.marker(name, belief.mean_of(name), is_robot=True)
            if self._is_hidden(name, marker, picture.observer, belief):
                continue
            slack_m = 2.0 * float(np.diag(belief.covariance_of(name))[:2].max()) ** 0.5
            chance = detection(self._cameras[picture.observer][0], _FIXED, slack_m, *marker.tolist())
            eye = self._sensors.world[picture.observer].position_m
            chance *= sight(self._boxes, SOFT_M, *eye, *marker.tolist()).a
            self._evidence[name] = self._evidence.get(name, 0.0) + math.log(1.0 - chance)

    def _is_hidden(self, name: str, marker: Array, camera: str, belief: JointBelief) -> bool:
        """Return whether another robot may stand in the line of sight."""
        eye = np.array(self._sensors.world[camera].position_m)
        line = marker - eye
        for other in belief.layout.robots:
            at = belief.mean_of(other)[:3] - eye
            share = float(at @ line) / float(line @ line)
            if other != name and 0.0 < share < 1.0 and float(np.linalg.norm(at - share * line)) < _BODY_M:
                return True
        return False
