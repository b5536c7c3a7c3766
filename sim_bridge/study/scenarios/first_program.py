"""The method as in its authors' first program: discs with a hard edge, neighbours from rest, edges only."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from groundstation.bus.messages import Message, RelativeObservation
from groundstation.planning.parameters import PlannerParameters
from groundstation.planning.planner import Planner
from groundstation.planning.problem import PlanningScene, ProblemBuilder
from groundstation.sensing.models import Frustum, OnboardCameraModel, SensorSuite, Softness
from groundstation.sensing.topology import LEAF, ROOT, Topology

_HARD = Softness(width_m=0.01, tail_share=0.0, caution=0.0)
_WIDE = 50.0  # tangent of half the view: only the range limits it
_RADIUS_M = 0.75  # of the disc where a drone 1.2 m above its subject, tilted by 45 deg, sees it


class DiscProblems(ProblemBuilder):
    """Only the topology's edges count, judged at the mean.

    PAPER (docs/explanation/method.md 3): a sighting exists if the subject lies in a disc ahead of the robot.
    """

    def __init__(self, parameters: PlannerParameters, sensors: SensorSuite) -> None:
        discs = {name: _disc(camera) for name, camera in sensors.onboard.items()}
        super().__init__(parameters, replace(sensors, onboard=discs, softness=_HARD, obstacles=()))

    def _edges(self, scene: PlanningScene, topology: Topology) -> tuple[Any, int]:
        every, wanted = super()._edges(scene, topology)
        edges: Any = np.array(every)[:wanted]
        edges["blur_m2"] = edges["turn_rad2"] = 0.0
        return edges, wanted


def _disc(camera: OnboardCameraModel) -> OnboardCameraModel:
    """Return a camera that looks straight down at the middle of a tilted one's view, and sees a disc about it."""
    tilt, above = camera.tilt_down_rad, 1.2
    ahead = min(above / max(math.tan(tilt), 0.3), camera.view.range_m)
    x, y, z = camera.position_m
    view = Frustum(_WIDE, _WIDE, math.hypot(above, _RADIUS_M), 0.0)
    return replace(camera, position_m=(x + ahead, y, z), view=view, tilt_down_rad=math.pi / 2)


class FirstProgram(Planner):
    """Every neighbour is solved from rest, the cheapest wins, and only the targets' uncertainty costs."""

    def __init__(self, planner: Planner) -> None:
        own = planner.parameters
        super().__init__(
            replace(own, mode="paper", weights=replace(own.weights, robots=0.0)), planner.sensors, DiscProblems
        )


def along_an_edge(message: Message, topology: Topology, targets: Mapping[str, object]) -> bool:
    """Return whether the first program fuses a message: of sightings only those along the topology's edges."""
    if not isinstance(message, RelativeObservation):
        return True
    observer = message.observer if message.observer in topology.robots else ROOT
    subject = LEAF if message.subject in targets else message.subject
    stranger = subject != LEAF and subject not in topology.robots
    return stranger or (observer, subject) in topology.edges()
