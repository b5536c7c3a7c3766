"""Feeds one scenario to the joint filter in order of time, and compares the belief with the truth."""

import math
from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from groundstation.arrays import Array
from groundstation.bus.messages import Verdict
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.measurement import Measurement, OdometrySample, SensorReading
from groundstation.estimation.models import CommandedRobot, FixedMount, Landmark, MountedCamera, RangeBearingSensor
from groundstation.estimation.parameters import WORLD_FROM_DOWN, EstimatorParameters
from groundstation.experiments.mrclam.dataset import Dataset, DatasetError
from groundstation.experiments.mrclam.scenarios import CAMERA_STD_M, CAMERA_STD_RAD, SensingScenario, camera_sightings
from groundstation.time_units import NS_PER_S

LOST_M = 1.5
_CAMERA_HEIGHT_M = 3.0
_JUDGED_S = 0.2
_START_STD_M, _START_STD_RAD = 0.01, 0.02
_ORIGIN_S = 1000.0  # of the filter's clock: not zero, because a lag is subtracted from it


@dataclass(frozen=True, slots=True)
class ModelFigures:
    """Deviations of readings and of the robots' motion, the same for all scenarios and all sets.

    A range by the size of a barcode's picture has an error proportional to itself; both errors repeat for about
    repeats_s at the same place.
    """

    range_std_m: float = 0.02
    range_share: float = 0.01
    bearing_std_rad: float = 0.015
    repeats_s: float = 1.0
    robot: CommandedRobot = field(default_factory=CommandedRobot)

    def covariance(self, range_m: float) -> tuple[float, ...]:
        """Return the covariance of (range, bearing), row-major."""
        return (self.range_std_m**2 + (self.range_share * range_m) ** 2, 0.0, 0.0, self.bearing_std_rad**2)


@dataclass(frozen=True, slots=True)
class ScenarioErrors:
    """Errors over all robots: RMSE [m, deg], the largest [m], ANEES per degree of freedom of (x, y, yaw)."""

    scenario: str
    robot_readings: bool
    rmse_m: float
    rmse_deg: float
    largest_m: float
    anees: float
    robots_rmse_m: tuple[float, ...]
    not_as_expected: float

    @property
    def lost(self) -> bool:
        """Return whether any robot's error ever exceeded LOST_M."""
        return self.largest_m > LOST_M


def filter_for(dataset: Dataset, figures: ModelFigures) -> FixedLagFilter:
    """Return a filter over five robots, the landmarks, and a camera on the ceiling."""
    robots = {_name(number): figures.robot for number in dataset.robots}
    landmarks = {_name(number): Landmark((*place, 0.0)) for number, place in dataset.landmarks.items()}
    ceiling = FixedMount((0.0, 0.0, _CAMERA_HEIGHT_M), 1e-4, 1e-3)
    eyes = {name: RangeBearingSensor(name, is_depth=True, repeats_s=figures.repeats_s) for name in robots}
    parameters = EstimatorParameters(
        {**robots, **landmarks, "ceiling": ceiling},
        {**eyes, "ceiling": MountedCamera("ceiling", WORLD_FROM_DOWN)},
        step_s=0.02,
        max_lateness_s=0.1,
    )
    return FixedLagFilter(parameters)


class DatasetFeed:
    """Brings one set's data to a filter; times are those of the set [s]."""

    def __init__(self, dataset: Dataset, figures: ModelFigures) -> None:
        self.joint = filter_for(dataset, figures)
        self._figures = figures
        self._start_s = dataset.start_s

    def ns(self, t: float) -> int:
        """Return a time on the filter's clock."""
        return round((t - self._start_s + _ORIGIN_S) * NS_PER_S)

    def place(self, number: int, pose: Array, t: float) -> None:
        """Place a robot at its start."""
        x, y, yaw = pose.tolist()
        variances = (_START_STD_M**2, _START_STD_M**2, 1e-6, _START_STD_RAD**2)
        self.joint.place(_name(number), (x, y, 0.0, math.remainder(yaw, math.tau)), variances, self.ns(t), self.ns(t))

    def command(self, number: int, t: float, values: tuple[float, ...]) -> None:
        """Pass on a robot's commands: forward speed, turn rate."""
        forward, rate = values
        motion = OdometrySample(self.ns(t), (forward, 0.0, 0.0), yaw_rate_rad_s=rate)
        self.joint.add_motion(_name(number), motion, self.ns(t))

    def reading(self, number: int, t: float, values: tuple[float, ...]) -> None:
        """Pass on a robot's reading: subject, range, bearing."""
        subject, distance, bearing = values
        covariance = self._figures.covariance(distance)
        reading = SensorReading(self.ns(t), _name(number), _name(int(subject)), (distance, bearing), covariance)
        self.joint.add_observation(reading, f"{number}/{subject:.0f}", self.ns(t))

    def sighting(self, number: int, t: float, values: tuple[float, ...]) -> None:
        """Pass on the ceiling camera's sighting of a robot: x, y, yaw."""
        x, y, yaw = values
        optical = WORLD_FROM_DOWN.T @ np.array([x, y, -_CAMERA_HEIGHT_M])
        covariance = np.diag([CAMERA_STD_M**2, CAMERA_STD_M**2, 0.01**2, CAMERA_STD_RAD**2]).ravel().tolist()
        place = (float(optical[0]), float(optical[1]), float(optical[2]))
        turned = math.remainder(yaw, math.tau)
        sight = Measurement(self.ns(t), "ceiling", _name(number), place, turned, tuple(covariance))
        self.joint.add_observation(sight, f"ceiling/{number}", self.ns(t))


def _name(number: int) -> str:
    return f"subject_{number}"


Item = tuple[float, str, int, tuple[float, ...]]


def stream(dataset: Dataset, scenario: SensingScenario, robot_readings: bool, seed: int) -> list[Item]:
    """Return all inputs as (t, method of Feed, robot, values), by time."""
    items: list[Item] = []
    for number, robot in dataset.robots.items():
        items += [(t, "command", number, (v, w)) for t, v, w in robot.odometry.tolist()]
        for t, subject, distance, bearing in robot.readings.tolist():
            wanted = robot_readings if subject in dataset.robots else number in scenario.landmark_robots
            if wanted and subject != number and (subject in dataset.robots or subject in dataset.landmarks):
                items.append((t, "reading", number, (subject, distance, bearing)))
    if scenario.camera:
        for number, sightings in camera_sightings(dataset, scenario, seed).items():
            items += [(t, "sighting", number, (x, y, yaw)) for t, x, y, yaw in sightings.tolist()]
    return sorted(items)


def run_scenario(
    dataset: Dataset,
    scenario: SensingScenario,
    robot_readings: bool,
    seed: int = 1,
    span: tuple[float, float] = (0.0, 1.0),
) -> ScenarioErrors:
    """Return the filter's errors over a share of the set's time; seed: of the emulated camera's noise.

    Causal: no belief uses later data. It starts at the true poses; no other truth is
    given to it.
    """
    feed, score = DatasetFeed(dataset, ModelFigures()), ScenarioScore(dataset)
    length = dataset.end_s - dataset.start_s
    begin, end = dataset.start_s + span[0] * length, dataset.start_s + span[1] * length
    feed.joint.advance(feed.ns(begin))
    for number, robot in dataset.robots.items():
        feed.place(number, robot.truth_at(np.array([begin]))[0], begin)
    due = begin + _JUDGED_S
    for t, kind, number, values in stream(dataset, scenario, robot_readings, seed):
        if not begin <= t < end:
            continue
        while due <= t:
            feed.joint.advance(feed.ns(due))
            score.take(feed.joint.belief(), due)
            score.verdicts.update(correction.verdict for correction in feed.joint.take_corrections())
            due += _JUDGED_S
        getattr(feed, kind)(number, t, values)
    return score.result(scenario.name, robot_readings)


class ScenarioScore:
    """Collects errors of all robots at equal intervals."""

    def __init__(self, dataset: Dataset) -> None:
        self.verdicts: Counter[Verdict] = Counter()
        self._dataset = dataset
        self._errors: list[list[Array]] = []
        self._nees: list[float] = []

    def take(self, belief: JointBelief, t: float) -> None:
        """Compare a belief with the truth at its time."""
        errors = []
        for number, robot in self._dataset.robots.items():
            error = robot.truth_at(np.array([t]))[0] - belief.mean_of(_name(number))[[0, 1, 3]]
            error[2] = math.remainder(error[2], math.tau)
            P = belief.covariance_of(_name(number))[np.ix_([0, 1, 3], [0, 1, 3])]
            errors.append(error)
            self._nees.append(float(error @ np.linalg.solve(P, error)) / 3.0)
        self._errors.append(errors)

    def result(self, scenario: str, robot_readings: bool) -> ScenarioErrors:
        """Return the figures; raises DatasetError if nothing was compared."""
        if not self._errors:
            raise DatasetError(f"nothing can be judged in less than {_JUDGED_S:g} s of the set: take a longer --span")
        errors = np.array(self._errors)
        squares = np.sum(errors[:, :, :2] ** 2, axis=2)
        total = max(self.verdicts.total(), 1)
        return ScenarioErrors(
            scenario,
            robot_readings,
            math.sqrt(squares.mean()),
            math.degrees(math.sqrt((errors[:, :, 2] ** 2).mean())),
            math.sqrt(squares.max()),
            float(np.mean(self._nees)),
            tuple(np.sqrt(squares.mean(axis=0)).round(4).tolist()),
            1.0 - self.verdicts[Verdict.ACCEPTED] / total,
        )
