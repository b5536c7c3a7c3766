"""Sensing scenarios, and sightings of an emulated ceiling camera."""

from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array
from groundstation.experiments.mrclam.dataset import ROBOTS, Dataset

CAMERA_STD_M, CAMERA_STD_RAD, CAMERA_HZ = 0.03, float(np.radians(1.5)), 5.0
DARK_S = 120.0


@dataclass(frozen=True, slots=True)
class SensingScenario:
    """landmark_robots: robots that read landmarks; camera: its share of the room; dark: with two spells of DARK_S."""

    name: str
    landmark_robots: tuple[int, ...] = ()
    camera: float = 0.0
    dark: bool = False


SCENARIOS = (
    SensingScenario("all landmarks", tuple(ROBOTS)),
    SensingScenario("robot 1 only", (1,)),
    SensingScenario("half-room camera", camera=0.5),
    SensingScenario("camera with dark spells", camera=1.0, dark=True),
    SensingScenario("half-room camera with dark spells", camera=0.5, dark=True),
)


def camera_sightings(dataset: Dataset, scenario: SensingScenario, seed: int) -> dict[int, Array]:
    """Return each robot's sightings (n, 4) t, x, y, yaw by a camera over a share of the room, from its largest y on.

    Truth with noise: the sets hold no ceiling camera. Dark: nothing during two spells, a third and two thirds on.
    """
    rng = np.random.default_rng(seed)
    places = np.array(list(dataset.landmarks.values()))
    low, high = places[:, 1].min(), places[:, 1].max()
    border = high - scenario.camera * (high - low) if scenario.camera < 1.0 else -np.inf
    t = np.arange(dataset.start_s, dataset.end_s, 1.0 / CAMERA_HZ)
    span = dataset.end_s - dataset.start_s
    lit = np.ones(len(t), dtype=bool)
    if scenario.dark:
        for share in (1 / 3, 2 / 3):
            begin = dataset.start_s + share * span - DARK_S / 2
            lit &= (t < begin) | (t > begin + DARK_S)
    sightings = {}
    for number, robot in dataset.robots.items():
        truth = robot.truth_at(t)
        seen = lit & (truth[:, 1] > border)
        noise = rng.standard_normal(truth.shape) * (CAMERA_STD_M, CAMERA_STD_M, CAMERA_STD_RAD)
        sightings[number] = np.column_stack((t, truth + noise))[seen]
    return sightings
