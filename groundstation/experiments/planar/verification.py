"""Tests the claim of the certified search: the same answer as brute force, and no bound above a cost."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from groundstation.experiments.planar.parameters import FIGURE_1, PlanarParameters
from groundstation.experiments.planar.planner import Fate, PlanarPlanner, SearchOptions
from groundstation.experiments.planar.scenarios import scattered_belief

PARAMETER_SETS = (
    PlanarParameters(),
    FIGURE_1,
    replace(PlanarParameters(), max_speed_m_s=2.0),
    replace(FIGURE_1, softness_m=0.1, steps=3, target_velocity_m_s=(0.2, -0.1), tail=1e-3),
)


class CertificateCheck(NamedTuple):
    """Beliefs judged, those with another answer than brute force, bounds above the cost they bound, share solved."""

    beliefs: int
    different: int
    violated: int
    solved_share: float


def verify(beliefs: int, seed: int = 0, most_robots: int = 12) -> CertificateCheck:
    """Return the verdict on random beliefs of 1..most_robots robots under all parameter sets."""
    different = violated = solved = candidates = 0
    for k in range(beliefs):
        generator = np.random.default_rng([seed, k])
        parameters = PARAMETER_SETS[k % len(PARAMETER_SETS)]
        robots = int(generator.integers(1, most_robots + 1))
        mean, covariance, level = scattered_belief(robots, generator, parameters)
        options = SearchOptions(wide=bool(k % 2))
        ours = PlanarPlanner(robots, parameters, options).plan(mean, covariance, level)
        brute = PlanarPlanner(robots, parameters, replace(options, prune=False)).plan(mean, covariance, level)
        different += not (ours.cost == brute.cost and ours.complete)
        for a, b in zip(ours.certificate, brute.certificate, strict=True):
            assert b.cost is not None
            violated += a.bound > b.cost * (1.0 + 1e-9)
        solved += ours.certificate.count(Fate.SOLVED)
        candidates += len(ours.certificate)
    return CertificateCheck(beliefs, different, violated, solved / candidates)
