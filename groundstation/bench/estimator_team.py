"""The team of `bench estimator`: two levels of robots, a ceiling camera, a target, every edge between levels.

30 robots: the camera sees the upper 15, each of these sees the lower 15, each of those sees the target: 255 edges.
"""

import math
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from groundstation.arrays import Array
from groundstation.estimation.event_log import observation_values, write_event
from groundstation.estimation.filter_state import Belief, State, Tables
from groundstation.estimation.measurement import Measurement
from groundstation.estimation.models import (
    ConstantVelocityTarget,
    FixedMount,
    MotionModel,
    MountedCamera,
    ObservationModel,
    OdometryRobot,
)
from groundstation.estimation.models.camera import measure_relative_pose
from groundstation.estimation.parameters import WORLD_FROM_DOWN, EstimatorParameters, parameters_from_field
from groundstation.estimation.records import EntityMemory, EventRow, Prediction
from groundstation.estimation.tables import empty_state, tables_from_parameters
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.rotations import base_from_tilted_optical
from groundstation.kernel import Rows

CEILING, TARGET = "ceiling", "target"
ODOMETRY_HZ, CAMERA_HZ = 200, 30
SPEED_M_S, TURN_RAD_S = 0.1, 0.05  # of the robots' odometry in the runs of the bare kernels
POSITION_STD_M, YAW_STD_RAD = 0.02, 0.03  # of a sighting
_PRIOR_STD = 0.05
_GATE = 1.0 - 1e-9  # the peers have none


@dataclass(frozen=True, slots=True)
class BenchTeam:
    """Parameters and tables, true states (mean, n), and edges."""

    parameters: EstimatorParameters
    tables: Tables
    truth: Array
    robots: tuple[str, ...]
    edges: tuple[tuple[str, str], ...]

    def index(self, name: str) -> int:
        """Return the place of an entity in the tables."""
        return list(self.parameters.entities).index(name)


def minimal_parameters(robots: int) -> EstimatorParameters:
    """Return a team whose robots have only (x, y, z, yaw), as the paper's, with odometry without delay."""
    tilted = base_from_tilted_optical(math.radians(45.0))
    names = robot_names(robots)
    robot = OdometryRobot(slow_states=(), reports_climb=True, velocity_delay_s=0.0, height_delay_s=0.0)
    entities: dict[str, MotionModel] = dict.fromkeys(names, robot)
    entities |= {TARGET: ConstantVelocityTarget(), CEILING: FixedMount((0.0, 0.0, 4.0), 0.003, 0.01)}
    sensors: dict[str, ObservationModel] = {name: MountedCamera(name, tilted, (0.09, 0.0, 0.0)) for name in names}
    sensors[CEILING] = MountedCamera(CEILING, WORLD_FROM_DOWN, observes_targets=False)
    return EstimatorParameters(entities, sensors, gate_probability=_GATE)


def product_parameters(robots: int, resolved: ResolvedField) -> EstimatorParameters:
    """Return a team of copies of the first drone and the first camera of a resolved field, as in flight."""
    drone, camera = next(iter(resolved.drones.values())), next(iter(resolved.cameras.values()))
    drones = dict.fromkeys(robot_names(robots), drone)
    flown = parameters_from_field(msgspec.structs.replace(resolved, drones=drones, cameras={CEILING: camera}))
    entities = {TARGET if name in resolved.tracked else name: model for name, model in flown.entities.items()}
    return replace(flown, entities=entities)


def robot_names(robots: int) -> tuple[str, ...]:
    """Return the names of the robots, upper level first."""
    return tuple(f"robot_{i + 1}" for i in range(robots))


def team_of(parameters: EstimatorParameters) -> BenchTeam:
    """Return the team of some parameters, hovering in two rows that look at each other and at the target."""
    tables = tables_from_parameters(parameters)
    robots = tuple(name for name in parameters.entities if name not in (TARGET, CEILING))
    upper, lower = robots[: (len(robots) + 1) // 2], robots[(len(robots) + 1) // 2 :]
    truth = np.zeros(tables.dim)
    for i, (name, model) in enumerate(parameters.entities.items()):
        place = truth[tables.part(i)]
        place[:] = tables.priors["mean"][i, : len(model.labels)]
        if name == TARGET:
            place[:2] = 4.0, 0.0
        elif name != CEILING:
            row = upper if name in upper else lower
            across = 0.4 * (row.index(name) - 0.5 * (len(row) - 1))
            place[:4] = (0.0, across, 2.0, 0.1) if row is upper else (2.0, across, 1.2, -0.1)
    edges = [(CEILING, name) for name in upper] + [(a, b) for a in upper for b in lower]
    return BenchTeam(parameters, tables, truth, robots, (*edges, *((name, TARGET) for name in lower or upper)))


def sighting(team: BenchTeam, edge: tuple[str, str], stamp_ns: int, rng: np.random.Generator) -> Measurement:
    """Return an observer's sighting of a subject, with noise; a heading only of robots."""
    observer, subject = map(team.index, edge)
    rows = 3 if edge[1] == TARGET else 4
    event, prediction = EventRow.row(observer=observer, subject=subject), Prediction.row(size=rows)
    tables = team.tables
    sensor = tables.sensors[list(team.parameters.sensors).index(edge[0])]
    measure_relative_pose(belief_at(tables, team.truth), sensor, event, prediction)
    deviations = np.array([POSITION_STD_M] * 3 + [YAW_STD_RAD])[:rows]
    z = prediction["h"][:rows] + deviations * rng.normal(size=rows)
    x, y, depth, *yaw = z.tolist()
    covariance = tuple(np.diag(deviations**2).ravel().tolist())
    return Measurement(stamp_ns, *edge, (x, y, depth), yaw[0] if yaw else None, covariance)


def belief_at(tables: Tables, mean: Array) -> Belief:
    """Return a belief of one mean, for uses without covariance."""
    return Belief(mean, np.zeros((0, 0)), tables.entities[0], EntityMemory.rows(len(tables.priors)))


def frame_of(team: BenchTeam, rng: np.random.Generator) -> Rows[EventRow]:
    """Return the events (edges) of one sighting along every edge, all at time 0."""
    events = EventRow.rows(len(team.edges))
    as_bytes, sensors = np.asarray(events).view(np.uint8).data, list(team.parameters.sensors)
    for row, edge in enumerate(team.edges):
        m = sighting(team, edge, 0, rng)
        values = observation_values(m, 0.0, 0, team.index(edge[0]), team.index(edge[1]), sensors.index(edge[0]))
        write_event(as_bytes, row, values)
    return events


def joined_state(team: BenchTeam, rng: np.random.Generator) -> State:
    """Return a state in which all entities have joined, are correlated, and move by their odometry."""
    tables, n = team.tables, team.tables.dim
    state = empty_state(tables, [True] * len(team.parameters.entities))
    root = rng.normal(size=(n, n)) / math.sqrt(n)
    deviations = np.full(n, _PRIOR_STD)
    for i in range(len(team.parameters.entities)):
        part = tables.part(i)
        deviations[part.start + 4 : part.stop] = np.sqrt(tables.priors["variances"][i, 4 : part.stop - part.start])
    P = deviations[:, None] * (0.5 * root @ root.T + 0.5 * np.eye(n)) * deviations
    state.covariances[0, :n, :n] = 0.5 * (P + P.T)
    state.means[0, :n] = team.truth
    state.memory["active"] = 1
    for name in team.robots:
        memory = state.memory[team.index(name)]
        memory["held_vx"], memory["held_vy"], memory["yaw_rate"] = SPEED_M_S, -0.5 * SPEED_M_S, TURN_RAD_S
    return state
