"""Target settings of a field file reach estimator, planner and cameras."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.errors import SettingsError
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, TARGET_CORE, EntityKind, StateLayout
from groundstation.estimation.models import ConstantVelocityTarget, CoordinatedTurnTarget, ManoeuvringTarget
from groundstation.estimation.parameters import parameters_from_field
from groundstation.field.resolved import ResolvedField
from groundstation.planning import parameters as planning
from groundstation.planning.planner import Planner
from groundstation.sensing.from_field import sensors_from_field
from groundstation.sensing.topology import Topology
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field
from groundstation.settings.schema import Field
from groundstation.settings.sections import CAMERA, driver_sections

CONFIG = Path(__file__).parents[3] / "config"
FIXTURE = Path(__file__).parents[2] / "fixtures" / "field" / "lab.yaml"


def resolved(*options: str) -> ResolvedField:
    return resolved_field(load_field(FIXTURE, options))


@pytest.mark.parametrize(
    ("model", "kind"),
    [
        ("constant_velocity", ConstantVelocityTarget),
        ("coordinated_turn", CoordinatedTurnTarget),
        ("manoeuvring", ManoeuvringTarget),
    ],
)
def test_the_model_of_the_target_is_a_choice_of_the_field(model: str, kind: type[Any]) -> None:
    plain = parameters_from_field(resolved(f"target.model={model}")).entities["turtlebot"]
    turned = parameters_from_field(resolved(f"target.model={model}", "target.heading=true")).entities["turtlebot"]
    assert isinstance(plain, kind)
    assert turned.labels == (*plain.labels, "yaw")


def test_figures_of_the_model_replace_its_own() -> None:
    options = ("target.model=manoeuvring", "target.turn_rate_std_deg_s=90", "target.turning_s=7")
    target = parameters_from_field(resolved(*options)).entities["turtlebot"]
    assert isinstance(target, ManoeuvringTarget)
    usual = ManoeuvringTarget()
    assert target.stay_s == (usual.stay_s[0], 7.0)
    turning = target.modes[1]
    assert isinstance(turning, CoordinatedTurnTarget)
    assert math.isclose(turning.turn_rate_std_rad_s, math.pi / 2)
    assert turning.turn_rate_correlation_s == CoordinatedTurnTarget().turn_rate_correlation_s


def two_targets(*options: str) -> Field:
    return load_field(CONFIG / "two-targets.yaml", options)


def problems_of(tmp_path: Path, old: str, new: str) -> list[str]:
    text = (CONFIG / "two-targets.yaml").read_text(encoding="utf-8")
    assert text.count(old) == 1, old
    path = tmp_path / "two.yaml"
    path.write_text(text.replace(old, new).replace("calibration: ", f"calibration: {CONFIG}/"), encoding="utf-8")
    with pytest.raises(SettingsError) as caught:
        load_field(path)
    return caught.value.problems


def test_several_targets_reach_estimator_planner_and_every_camera() -> None:
    field = two_targets("targets.turtlebot_2.weight=4", "targets.turtlebot_2.model=coordinated_turn")
    assert Field.model_validate_json(field.model_dump_json()) == field
    plain = resolved_field(field)
    entities = parameters_from_field(plain).entities
    assert isinstance(entities["turtlebot_1"], ConstantVelocityTarget)
    assert isinstance(entities["turtlebot_2"], CoordinatedTurnTarget)
    assert planning.parameters_from_field(plain).target_weights == {"turtlebot_1": 1.0, "turtlebot_2": 4.0}
    assert {"turtlebot_1", "turtlebot_2"} <= set(sensors_from_field(plain).marker_height_m)
    cameras = [section for section in driver_sections(field) if section.kind == CAMERA]
    assert len(cameras) == 3
    assert all('"turtlebot_1"' in camera.section and '"turtlebot_2"' in camera.section for camera in cameras)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("marker: {code: 6,", "marker: {code: 5,", "targets.turtlebot_2.marker.code: marker code 5 is already that of"),
        ("  turtlebot_2:", "  drone_1:", "targets.drone_1: the name drone_1 is already that of a drone"),
        ("  turtlebot_2:", "  tracker:", "targets.tracker: the name tracker is taken by the ground station itself"),
        ("  turtlebot_2:", "  run:", "targets.run: the name run is taken by the ground station itself"),
        ("targets:  ", "target: {name: third, marker: {code: 9}}\ntargets:  ", "targets: must not stand beside target"),
    ],
)
def test_errors_in_settings_of_several_targets_are_named(tmp_path: Path, old: str, new: str, expected: str) -> None:
    found = problems_of(tmp_path, old, new)
    assert len(found) == 1
    assert expected in found[0] and found[0].startswith(f"{tmp_path}/two.yaml:")


def test_a_field_without_any_target_is_refused() -> None:
    with pytest.raises(SettingsError, match="target: is required"):
        load_field(FIXTURE, ["target=null"])


def test_an_option_invents_no_target() -> None:
    with pytest.raises(SettingsError, match="did you mean targets"):
        two_targets("targets.turtlebot_3.weight=2")


@pytest.mark.parametrize(("heavy", "side"), [("turtlebot_1", 1.0), ("turtlebot_2", -1.0)])
def test_a_lone_drone_turns_to_the_target_that_weighs_more(heavy: str, side: float) -> None:
    plain = resolved_field(two_targets(f"targets.{heavy}.weight=50"))
    layout = StateLayout().with_entity("drone_1", EntityKind.ROBOT, ROBOT_CORE)
    for name in ("turtlebot_1", "turtlebot_2"):
        layout = layout.with_entity(name, EntityKind.TARGET, TARGET_CORE)
    mean = np.array([0.0, 0.0, 1.6, 0.0, 0.7, 1.0, 0.0, 0.0, 0.7, -1.0, 0.0, 0.0])
    variances = np.array([0.03] * 4 + [0.3, 0.3, 0.1, 0.1] * 2) ** 2
    planner = Planner(planning.parameters_from_field(plain), sensors_from_field(plain))
    belief = JointBelief(mean, np.diag(variances), layout, 0)
    plan = planner.plan(belief, Topology.flat(["drone_1"]), {}, lambda: False)
    _, left_m_s, turn_rad_s = plan.controls["drone_1"]
    assert side * left_m_s > 0.05 and side * turn_rad_s > 0.2
