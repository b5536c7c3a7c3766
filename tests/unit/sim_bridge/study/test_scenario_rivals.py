"""Decisions of the planners compared with ours, and the observations that each uses."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from groundstation.bus.messages import Event, Header, Message, RelativeObservation, Severity
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, TARGET_CORE, EntityKind, StateLayout
from groundstation.planning.parameters import parameters_from_field
from groundstation.planning.planner import Planner, PlanResult
from groundstation.planning.problem import scene_from_belief
from groundstation.sensing.from_field import sensors_from_field
from groundstation.sensing.topology import Topology
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field
from sim_bridge.study.scenarios.first_program import DiscProblems, along_an_edge
from sim_bridge.study.scenarios.fixed_topologies import EveryPair
from sim_bridge.study.scenarios.samplers import PRIMITIVES, SAMPLES
from sim_bridge.study.scenarios.strategies import STRATEGIES

LAB = resolved_field(load_field(Path(__file__).parents[4] / "config/lab.yaml"))
PLANNER = Planner(parameters_from_field(LAB), sensors_from_field(LAB))
STRING = Topology.parse("drone_1/drone_2")
POSES = {"drone_1": (-0.5, 0.0, 1.3, 0.0), "drone_2": (-1.2, 0.9, 1.3, 2.0)}


def belief(target: tuple[float, float], poses: Mapping[str, tuple[float, ...]] = POSES) -> JointBelief:
    layout, mean, variances = StateLayout(), list[float](), list[float]()
    for name, pose in poses.items():
        layout = layout.with_entity(name, EntityKind.ROBOT, ROBOT_CORE)
        mean += pose
        variances += [0.03**2] * 4
    layout = layout.with_entity("turtlebot", EntityKind.TARGET, TARGET_CORE)
    return JointBelief(np.array([*mean, *target, 0.0, 0.0]), np.diag([*variances, *[0.01] * 4]), layout, 0)


def decision(strategy: str, at: JointBelief, current: Topology = STRING) -> PlanResult:
    return STRATEGIES[strategy].planner_of(PLANNER).plan(at, current, None, lambda: False)


def test_without_a_topology_every_camera_counts_on_everybody() -> None:
    scene = scene_from_belief(belief((0.6, 0.0)), STRING.robots)
    builder = EveryPair(PLANNER.parameters, PLANNER.sensors)
    seen = set(builder.edge_names(scene, builder.build(scene, Topology.flat(STRING.robots))))
    assert {("drone_1", "drone_2"), ("drone_2", "drone_1"), ("drone_1", "turtlebot"), ("ceiling", "drone_1")} <= seen
    assert len(seen) == 6


@pytest.mark.parametrize("strategy", ["no-topology", "sampling", "lattice"])
def test_each_does_better_than_hovering_where_it_looks_away(strategy: str) -> None:
    """drone_2 looks away from a target that drone_1 sees: any search finds something cheaper than hovering."""
    at = belief((0.6, 0.0))
    builder = EveryPair(PLANNER.parameters, PLANNER.sensors)
    problem = builder.build(scene_from_belief(at, STRING.robots), STRING)
    chosen = decision(strategy, at)
    assert chosen.cost < 0.9 * problem.value(np.zeros(8))
    assert chosen.topology == STRING


def test_samplers_say_how_much_they_tried() -> None:
    at = belief((0.6, 0.0))
    assert decision("sampling", at).solver.evaluations == SAMPLES + 2
    assert decision("lattice", at).solver.evaluations == 1 + 2 * 2 * len(PRIMITIVES)
    assert (
        decision("sampling", at).controls["drone_1"].tolist() == decision("sampling", at).controls["drone_1"].tolist()
    )


def test_the_lattice_keeps_what_is_better_than_all_its_primitives() -> None:
    planner, at = STRATEGIES["lattice"].planner_of(PLANNER), belief((0.6, 0.0))
    best = PLANNER.plan(at, STRING, None, lambda: False)
    first = planner.plan(at, STRING, None, lambda: False)
    again = planner.plan(at, STRING, best.warm_start, lambda: False)
    assert again.cost <= first.cost


@pytest.mark.parametrize(("ahead_m", "seen"), [(1.2, True), (1.7, True), (2.3, False), (0.2, False)])
def test_the_first_program_sees_a_disc_with_a_hard_edge(ahead_m: float, seen: bool) -> None:
    """0.75 m about a point 1.2 m ahead of a camera that is tilted by 45 deg."""
    x, y = POSES["drone_1"][:2]
    target = PLANNER.sensors.marker_height_m["turtlebot"]
    at = belief((x + 0.09 + ahead_m, y), {"drone_1": (x, y, target + 1.2, 0.0)})
    scene, alone = scene_from_belief(at, frozenset({"drone_1"})), Topology.flat(["drone_1"])
    builder = DiscProblems(PLANNER.parameters, PLANNER.sensors)
    problem = builder.build(scene, alone)
    hover = np.array([0.0, 0.0, 0.0, (target + 1.2 - builder.height_m) / problem.scale[3]])
    hidden = belief((x - 40.0, y), {"drone_1": (x, y, target + 1.2, 0.0)})
    blind = builder.build(scene_from_belief(hidden, frozenset({"drone_1"})), alone)
    assert (problem.value(hover) < 0.5 * blind.value(hover)) is seen


def sighting(observer: str, subject: str) -> Message:
    header = Header(1, "boot", observer, "camera", 1)
    return RelativeObservation(
        header=header, observer=observer, subject=subject, camera="c", position_m=(0.0, 0.0, 1.0), yaw_rad=None,
        covariance=tuple(np.eye(3).ravel()),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("observer", "subject", "fused"),
    [
        ("ceiling", "drone_1", True), ("ceiling", "drone_2", False), ("drone_1", "drone_2", True),
        ("drone_2", "drone_1", False), ("drone_1", "turtlebot", False), ("drone_2", "turtlebot", True),
        ("ceiling", "turtlebot", False), ("ceiling", "drone_9", True),
    ],
)  # fmt: skip
def test_the_first_program_fuses_along_the_topology_only(observer: str, subject: str, fused: bool) -> None:
    assert along_an_edge(sighting(observer, subject), STRING, {"turtlebot": None}) is fused


def test_the_first_program_hears_all_that_is_no_sighting() -> None:
    said = Event(header=Header(1, "boot", "drone_1", "x", 1), severity=Severity.INFO, text="x")
    assert along_an_edge(said, STRING, {})
