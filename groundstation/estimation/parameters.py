"""Settings of the estimator, derived from a resolved field."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from groundstation.estimation.models import (
    Anchor,
    ConstantVelocityTarget,
    CoordinatedTurnTarget,
    FixedMount,
    ManoeuvringTarget,
    MotionModel,
    MountedCamera,
    ObservationModel,
    OdometryRobot,
    RangeSensor,
    ReportedVelocity,
)
from groundstation.estimation.models.odometry_robot import AERIAL
from groundstation.estimation.ranged_robot import RangedRobot
from groundstation.field.drones import FieldDrone, OnboardCamera
from groundstation.field.resolved import ResolvedField
from groundstation.field.room import MotionCapture, Ranging, WorldCamera, ranging_link
from groundstation.field.targets import Target, odometry_name
from groundstation.geometry.rotations import (
    WORLD_FROM_DOWNWARD_OPTICAL,
    base_from_tilted_optical,
    world_from_downward_optical,
)
from groundstation.vehicles import kind_named

# `looking: down`: picture right is world x, picture down is world -y, optical axis is -z.
WORLD_FROM_DOWN = WORLD_FROM_DOWNWARD_OPTICAL
# Deviation of the exposure time about the calibrated delay of a video: +-20 ms, as in the honest scenario [s].
STAMP_STD_S = 0.0115
# The same for a motion capture system, which reports its own delay except that of the network [s].
CAPTURE_STAMP_STD_S = 0.002
# The ranges of one round are measured one after the other, and stamped alike [s].
RANGE_STAMP_STD_S = 0.02
# A calibrated velocity scale is this accurate, and creeps by this in a second.
_SCALE_STD, _SCALE_DRIFT = 0.04, 0.002
_VELOCITY_LABELS = ("velocity_bias_x", "velocity_bias_y")
# Deviations of the velocity's lasting error, and of the quicker one, relative to the whole.
_LASTING_SHARE, _QUICK_SHARE = 0.6, 0.1
# A target accelerates at its maximum for this share of the time.
_MANOEUVRING_SHARE = 0.07
# Deviation of a target's turn rate relative to its highest, and of each component of its velocity before it is seen,
# relative to its highest speed.
_TURN_SHARE, _SPEED_SHARE = 0.5 / math.pi, 0.4 / 0.7
# From this team size on, observations wait for the odometry of their time; and the time that odometry takes to arrive
# [s].
_LARGE_TEAM, _ARRIVES_S = 12, 0.01
# Share of a turning target's acceleration that remains for one that drives straight.
_STRAIGHT_SHARE = 0.5


@dataclass(frozen=True, slots=True)
class EstimatorParameters:
    """Entities and sensors by name, and the settings of the filter.

    step_s: odometry is condensed and checkpoints are kept at this spacing; max_lateness_s: the rewind's bound; wait_s:
    how long observations wait for the odometry of their time (0: each counts at once, and is computed again whenever
    odometry of its time arrives); wild_gates: beyond this many gates a measurement is not even used inflated;
    divergence_count of them in a row over at least divergence_s re-initialise the entity. inertial: robots whose
    attitude is taken from their IMU where they publish one (inertial.py), with their velocity scale. joins_early:
    robots that join as soon as they begin to take off. tells_steps: robots whose odometry may repeat itself in flight.
    fastest_m_s: for robots, the reported speed beyond which it is no measurement.
    world_cameras: sensors mounted in the room that can be bumped. ranging: robots with a transponder, by system.
    reporting: targets whose own odometry is received.
    """

    entities: Mapping[str, MotionModel]
    sensors: Mapping[str, ObservationModel] = field(default_factory=dict)
    step_s: float = 0.01
    max_lateness_s: float = 0.5
    wait_s: float = 0.0
    gate_probability: float = 0.997
    wild_gates: float = 6.0
    divergence_count: int = 5
    divergence_s: float = 0.6
    inertial: Mapping[str, float] = field(default_factory=dict)
    joins_early: frozenset[str] = frozenset()
    tells_steps: frozenset[str] = frozenset()
    fastest_m_s: Mapping[str, float] = field(default_factory=dict)
    world_cameras: frozenset[str] = frozenset()
    ranging: Mapping[str, Mapping[str, RangedRobot]] = field(default_factory=dict)
    reporting: frozenset[str] = frozenset()


def parameters_from_field(resolved: ResolvedField) -> EstimatorParameters:
    """Return the parameters for a resolved field."""
    drones, estimator = resolved.drones, resolved.estimator
    habits = {name: kind_named(drone.kind).habits for name, drone in drones.items()}
    return EstimatorParameters(
        _entities(resolved),
        _sensors(resolved),
        max_lateness_s=estimator.max_lateness_s,
        wait_s=_wait_s(drones.values()),
        gate_probability=estimator.gate_probability,
        inertial={n: drones[n].odometry.velocity_scale for n, habit in habits.items() if not habit.tells_attitude},
        joins_early=frozenset(n for n, habit in habits.items() if habit.flies_on_estimate),
        tells_steps=frozenset(n for n, habit in habits.items() if habit.tells_steps),
        fastest_m_s={n: habit.fastest_m_s for n, habit in habits.items()},
        world_cameras=frozenset(resolved.cameras),
        ranging={name: _ranged(system, drones) for name, system in resolved.ranging.items()},
        reporting=frozenset(name for name, target in resolved.tracked.items() if target.odometry is not None),
    )


def _entities(resolved: ResolvedField) -> dict[str, MotionModel]:
    """Return the models of motion in the order of the state: robots, targets, mountings, ranging links."""
    entities: dict[str, MotionModel] = {name: _robot(drone) for name, drone in resolved.drones.items()}
    entities |= {name: _target(target) for name, target in resolved.tracked.items()}
    fixed: dict[str, WorldCamera | MotionCapture] = {**resolved.cameras, **resolved.sensing_capture}
    entities |= {name: _mount(sensor) for name, sensor in fixed.items()}
    for name, system in resolved.ranging.items():
        for link, (anchor, _) in _links(name, system, resolved.drones).items():
            entities[link] = Anchor(system.anchors[anchor], system.bias_std_m)
    return entities


def _sensors(resolved: ResolvedField) -> dict[str, ObservationModel]:
    """Return the models of observation by the sensor's name on the bus; a camera on a drone has the drone's."""
    sensors: dict[str, ObservationModel] = {
        name: _world_camera(name, camera) for name, camera in resolved.cameras.items()
    }
    sensors |= {name: _capture(name, system) for name, system in resolved.sensing_capture.items()}
    for name, system in resolved.ranging.items():
        for link, (_, drone) in _links(name, system, resolved.drones).items():
            sensors[link] = RangeSensor(link, system.transponder(drone).position_m, system.reach_m, RANGE_STAMP_STD_S)
    sensors |= {name: _onboard_camera(name, drone.camera) for name, drone in resolved.drones.items()}
    reporting = [name for name, target in resolved.tracked.items() if target.odometry is not None]
    return sensors | {odometry_name(name): ReportedVelocity(name) for name in reporting}


def _wait_s(drones: Collection[FieldDrone]) -> float:
    """Return how long observations wait for odometry [s]: 0 for a small team, whose steps are cheap to recompute."""
    if len(drones) < _LARGE_TEAM:
        return 0.0
    delays_ms = [delay for d in drones for delay in (d.odometry.velocity_delay_ms, d.odometry.height_delay_ms)]
    return max(0.0, *delays_ms) / 1000 + _ARRIVES_S


def _robot(drone: FieldDrone) -> OdometryRobot:
    odometry, habits = drone.odometry, kind_named(drone.kind).habits
    return OdometryRobot(
        marker_position_m=drone.marker.position_m,
        velocity_scale=odometry.velocity_scale,
        scale_std=_SCALE_STD,
        scale_drift=_SCALE_DRIFT,
        velocity_std_m_s=_QUICK_SHARE * odometry.velocity_std_m_s,
        velocity_bias_std_m_s=_LASTING_SHARE * odometry.velocity_std_m_s / odometry.velocity_scale,
        velocity_bias_correlation_s=habits.velocity_s,
        velocity_walk=habits.velocity_walk,
        velocity_delay_s=odometry.velocity_delay_ms / 1000,
        yaw_std_rad=math.radians(odometry.yaw_rate_std_deg_s),
        attitude_std_rad=math.radians(odometry.attitude_std_deg),
        attitude_correlation_s=habits.attitude_s,
        height_std_m=odometry.height_std_m,
        height_delay_s=odometry.height_delay_ms / 1000,
        climb_std_m_s=habits.climb_m_s + habits.climb_share * drone.limits.max_climb_m_s,
        climb_correlation_s=habits.climb_s,
        reports_climb=habits.reports_climb,
        slow_states=AERIAL + _VELOCITY_LABELS,
    )


def usual_acceleration_m_s2(target: Target) -> float:
    """Return the rms of one component of a target's acceleration over time."""
    return math.sqrt(_MANOEUVRING_SHARE) * target.acceleration_std_m_s2


def _target(target: Target) -> MotionModel:
    height_m, acceleration_std = target.marker.height_m, usual_acceleration_m_s2(target)
    speed_std = _SPEED_SHARE * target.max_speed_m_s
    if target.model == "constant_velocity":
        return ConstantVelocityTarget(height_m, acceleration_std, speed_std_m_s=speed_std, heading=target.heading)
    usual, rate_deg_s = CoordinatedTurnTarget(), target.turn_rate_std_deg_s
    turning = CoordinatedTurnTarget(
        height_m,
        acceleration_std,
        speed_std_m_s=speed_std,
        turn_rate_std_rad_s=math.radians(rate_deg_s or target.max_turn_rate_deg_s * _TURN_SHARE),
        turn_rate_correlation_s=target.turn_rate_correlation_s or usual.turn_rate_correlation_s,
        heading=target.heading,
    )
    if target.model == "coordinated_turn":
        return turning
    straight = replace(turning, acceleration_std_m_s2=_STRAIGHT_SHARE * acceleration_std, turning=False)
    straight_s, turning_s = ManoeuvringTarget().stay_s
    return ManoeuvringTarget((straight, turning), (target.straight_s or straight_s, target.turning_s or turning_s))


def _mount(sensor: WorldCamera | MotionCapture) -> FixedMount:
    # A motion capture system's poses are along the world's axes from its origin; an error of these is one error for
    # all.
    return FixedMount(
        position_m=sensor.position_m if isinstance(sensor, WorldCamera) else (0.0, 0.0, 0.0),
        attitude_std_rad=math.radians(sensor.attitude_std_deg),
        position_std_m=sensor.position_std_m,
    )


def _capture(name: str, system: MotionCapture) -> MountedCamera:
    return MountedCamera(
        carrier=name,
        rotation=np.eye(3),
        sees_all_round=True,
        observes_targets="targets" in system.observes,
        stamp_std_s=CAPTURE_STAMP_STD_S,
    )


def _links(name: str, system: Ranging, drones: Mapping[str, FieldDrone]) -> dict[str, tuple[str, str]]:
    """Return the pairs of an anchor and a drone, by their names."""
    return {ranging_link(name, anchor, drone): (anchor, drone) for anchor in system.anchors for drone in drones}


def _ranged(system: Ranging, drones: Mapping[str, FieldDrone]) -> dict[str, RangedRobot]:
    return {
        name: RangedRobot(
            system.transponder(name).position_m,
            math.radians(drone.pad_yaw_deg),
            math.radians(system.pad_heading_std_deg),
            math.radians(drone.odometry.yaw_rate_std_deg_s),
            drone.pad_m,
            system.pad_limit_m,
        )
        for name, drone in drones.items()
    }


def _world_camera(name: str, camera: WorldCamera) -> MountedCamera:
    return MountedCamera(
        carrier=name,
        rotation=world_from_downward_optical(camera.rotation_deg),
        observes_targets="targets" in camera.observes,
        stamp_std_s=STAMP_STD_S,
    )


def _onboard_camera(name: str, camera: OnboardCamera) -> MountedCamera:
    return MountedCamera(
        carrier=name,
        rotation=base_from_tilted_optical(math.radians(camera.tilt_down_deg), math.radians(camera.pan_left_deg)),
        translation=camera.position_m,
        stamp_std_s=STAMP_STD_S,
    )
