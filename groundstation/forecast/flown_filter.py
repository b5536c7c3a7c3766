"""The flight filter, fed with error-free sightings of a team at its stand: its covariance is the forecast."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from groundstation.arrays import Array
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.filter_state import Belief
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.measurement import OdometrySample, SensorReading
from groundstation.estimation.parameters import EstimatorParameters, parameters_from_field
from groundstation.estimation.records import EntityMemory, EventRow, Prediction
from groundstation.estimation.tables import tables_from_parameters
from groundstation.field.resolved import ResolvedField
from groundstation.field.room import ranging_link
from groundstation.forecast.team import Team
from groundstation.forecast.views import Views
from groundstation.time_units import NS_PER_MS, NS_PER_S

_ODOMETRY_NS, _BEGIN_NS = 40 * NS_PER_MS, 10 * NS_PER_S
_CIRCLE_M, _ROUND_S = 0.25, 8.0  # circle of all bodies, for the states observable only in motion


@dataclass(frozen=True, slots=True)
class _Range:
    """A pair of an anchor and a robot: its system, and the deviation of one range [m]."""

    system: str
    robot: str
    std_m: float


class FlownFilter:
    """The estimator of a field for one team, with its sightings of a target that the whole team tracks."""

    def __init__(self, field: ResolvedField, team: Team) -> None:
        self.team, self._views = team, Views(team)
        self._ranges = {
            ranging_link(name, anchor, robot): _Range(name, robot, system.range_std_m)
            for name, system in field.ranging.items()
            if name in team.sensors.world
            for anchor in system.anchors
            for robot in team.robots
        }
        self.parameters = _of_team(parameters_from_field(field), team, self._ranges)
        self._tables = tables_from_parameters(self.parameters)
        self._index = {name: i for i, name in enumerate(self.parameters.entities)}
        self._sensor = {name: i for i, name in enumerate(self.parameters.sensors)}
        self._joint = FixedLagFilter(self.parameters)
        self._joint.advance(_BEGIN_NS)
        for name in team.robots:
            self._joint.set_airborne(name, True, _BEGIN_NS, _BEGIN_NS)
        self._joint.advance(_BEGIN_NS + NS_PER_S)

    def belief(
        self, poses: Mapping[str, Array], place: Sequence[float], seconds: float, variances: Sequence[float],
        circling: bool = False,
    ) -> JointBelief:  # fmt: skip
        """Return the belief after some time at a stand; variances: of x, y, z, yaw of each robot before.

        circling: all move along equal circles, the target too, so that the stand moves as a whole. A body that no
        known observer sees is missing in the belief, as in flight.
        """
        joint, begin = self._joint, self._joint.stamp_ns
        joint.restart()
        for name, pose in poses.items():
            joint.place(name, pose.tolist(), variances, begin, begin)
        period_ns = round(NS_PER_S / self.team.sensors.sightings_per_s)
        sight, now, end = begin + period_ns, begin, begin + round(seconds * NS_PER_S)
        seen = None if circling else self._seen(poses, place, 0.0, circling)
        while now < end:
            now += _ODOMETRY_NS
            self._drive(poses, now, (now - begin) / NS_PER_S, circling)
            while sight <= now:
                for reading in seen or self._seen(poses, place, (sight - begin) / NS_PER_S, circling):
                    tie = f"{reading.sensor}/{reading.subject}"
                    joint.add_observation(msgspec.structs.replace(reading, stamp_ns=sight), tie, now)
                sight += period_ns
            joint.advance(now)
        return joint.belief()

    def _moved(
        self, poses: Mapping[str, Array], place: Sequence[float], at_s: float, circling: bool
    ) -> tuple[dict[str, Array], Array]:
        """Return all states at a time: robots (x, y, z, yaw), target (x, y, vx, vy)."""
        turn = math.tau / _ROUND_S
        x, y = (
            (_CIRCLE_M * math.sin(turn * at_s), _CIRCLE_M * (1.0 - math.cos(turn * at_s))) if circling else (0.0, 0.0)
        )
        vx, vy = self._velocity(at_s, circling)
        shift = np.array([x, y, 0.0, 0.0])
        return {name: pose + shift for name, pose in poses.items()}, np.array([place[0] + x, place[1] + y, vx, vy])

    def _velocity(self, at_s: float, circling: bool) -> tuple[float, float]:
        turn, speed = math.tau / _ROUND_S, math.tau / _ROUND_S * _CIRCLE_M * circling
        return speed * math.cos(turn * at_s), speed * math.sin(turn * at_s)

    def _drive(self, poses: Mapping[str, Array], now: int, at_s: float, circling: bool) -> None:
        for name, pose in poses.items():
            model = self.parameters.entities[name]
            late_s = float(getattr(model, "velocity_delay_s", 0.0))
            vx, vy = self._velocity(at_s - late_s, circling)
            c, s, gain = math.cos(pose[3]), math.sin(pose[3]), float(getattr(model, "velocity_scale", 1.0))
            velocity = ((c * vx + s * vy) / gain, (c * vy - s * vx) / gain, 0.0)
            self._joint.add_motion(name, OdometrySample(now, velocity, float(pose[3]), float(pose[2])), now)

    def _seen(
        self, poses: Mapping[str, Array], place: Sequence[float], at_s: float, circling: bool
    ) -> list[SensorReading]:
        """Return the measurements of all sensors at a time, without noise."""
        stands, target = self._moved(poses, place, at_s, circling)
        mean = self._mean(stands, target)
        return [
            SensorReading(
                0, sensor, subject, self._expected(sensor, subject, mean, len(std)),
                tuple(np.diag(np.square(std)).ravel().tolist()),
            )
            for sensor, subject, std in self._sightings(stands, target)
        ]  # fmt: skip

    def _sightings(self, poses: Mapping[str, Array], target: Array) -> Iterator[tuple[str, str, list[float]]]:
        """Return observer and subject of all sightings, with deviations of place and, of robots, heading."""
        team = self.team
        points = {name: self._views.marker(name, pose) for name, pose in poses.items()}
        points[team.target] = self._views.ground((float(target[0]), float(target[1])))
        for camera in self.parameters.sensors:
            if camera in self._ranges:
                one = self._ranges[camera]
                if self._views.sees(one.system, np.zeros(4), points[one.robot]):
                    yield camera, one.robot, [one.std_m]
                continue
            model = team.sensors.onboard.get(camera) or team.sensors.world[camera]
            pose = poses.get(camera, np.zeros(4))
            for name, point in points.items():
                if name == camera or not self._views.sees(camera, pose, point):
                    continue
                if name == team.target and not self.parameters.sensors[camera].observes_targets:
                    continue
                distance = float(np.linalg.norm(team.sensors.eye(camera, pose) - point))
                std = math.hypot(model.noise.base_m, model.noise.per_m2 * distance**2)
                yield camera, name, [std] * 3 + [model.noise.yaw_rad] * (name != team.target)

    def _mean(self, poses: Mapping[str, Array], target: Array) -> Array:
        mean = np.zeros(self._tables.dim)
        for name, index in self._index.items():
            part = self._tables.part(index)
            mean[part] = self._tables.priors["mean"][index, : part.stop - part.start]
            if name in poses or name == self.team.target:
                mean[part.start : part.start + 4] = poses.get(name, target)
        return mean

    def _expected(self, sensor: str, subject: str, mean: Array, rows: int) -> tuple[float, ...]:
        model, number = self.parameters.sensors[sensor], self._sensor[sensor]
        observer, seen = self._index[model.carrier], self._index[subject]
        event, out = EventRow.row(observer=observer, subject=seen, sensor=number, size=rows), Prediction.row(size=rows)
        memory = EntityMemory.rows(len(self._index))
        belief = Belief(mean, np.zeros((0, 0)), self._tables.entities[0], memory)
        model.kernels.measure(belief, self._tables.sensors[number], event, out)
        return tuple(out["h"][:rows].tolist())


def _of_team(parameters: EstimatorParameters, team: Team, ranges: Mapping[str, _Range]) -> EstimatorParameters:
    """Return the parameters without the entities and sensors that the team lacks."""
    kept = {*team.sensors.world, *team.sensors.onboard, *ranges}
    sensors = {name: model for name, model in parameters.sensors.items() if name in kept}
    known = {*team.robots, team.target, *(model.carrier for model in sensors.values())}
    entities = {name: model for name, model in parameters.entities.items() if name in known}
    return replace(parameters, entities=entities, sensors=sensors)
