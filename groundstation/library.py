"""Skein for scripts and notebooks: fields, beliefs, one step of planning, the judgement of a recording.

The names in `__all__` are the public interface: it changes with an entry in the change log only. Everything else may
change at any time. Examples that run: docs/notebooks.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, TARGET_CORE, EntityKind, StateLayout
from groundstation.field.resolved import ResolvedField
from groundstation.planning.planner import Planner, PlanResult
from groundstation.report.build import build_report
from groundstation.report.judge import RunReport
from groundstation.sensing.topology import Topology
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field
from groundstation.tracker import tracker_from_field

__all__ = [
    "JointBelief",
    "PlanResult",
    "Planner",
    "ResolvedField",
    "RunReport",
    "Topology",
    "belief_of",
    "field_named",
    "judge_recording",
    "plan_step",
    "planner_of",
]

Pose = tuple[float, float, float, float]


def field_named(name: str, options: Sequence[str] = ()) -> ResolvedField:
    """Return a field by its path, or by the name of a shipped one ("lab"); options: "a.b=c", as with --set.

    Raises SettingsError with all problems.
    """
    return resolved_field(load_field(find_field(name), options))


def belief_of(
    robots: Mapping[str, Pose], targets: Mapping[str, Pose], std: Sequence[float] = (0.05, 0.05, 0.04, 0.05)
) -> JointBelief:
    """Return a belief without correlations.

    robots: (x, y, z, yaw) [m, rad; world]; targets: (x, y, vx, vy) [m, m/s; world]; std: of each robot, in its order.
    The targets' deviations are 0.1 m and 0.2 m/s.
    """
    layout = StateLayout()
    for names, kind, core in ((robots, EntityKind.ROBOT, ROBOT_CORE), (targets, EntityKind.TARGET, TARGET_CORE)):
        for name in names:
            layout = layout.with_entity(name, kind, core)
    mean = np.array([value for pose in (*robots.values(), *targets.values()) for value in pose])
    deviations = np.array([*std] * len(robots) + [0.1, 0.1, 0.2, 0.2] * len(targets))
    return JointBelief(mean, np.diag(deviations**2), layout, 0)


def planner_of(field: ResolvedField) -> Planner:
    """Return the flight planner of a field, with the field's sensors, limits and costs."""
    return tracker_from_field(field, "library", 0).planner


def plan_step(
    planner: Planner,
    belief: JointBelief,
    topology: Topology | None = None,
    should_stop: Callable[[], bool] = lambda: False,
) -> PlanResult:
    """Return the plan for a belief, from a topology now (None: all on one level); raises EstimatorFault."""
    return planner.plan(belief, topology or Topology.flat(belief.layout.robots), None, should_stop)


def judge_recording(run: Path | str, plot: bool = False) -> RunReport:
    """Return the judgement of a run's folder, and write its report.json (plot: its page and picture as well).

    Raises RecordingError when there is no recording.
    """
    return build_report(Path(run), plot=plot)
