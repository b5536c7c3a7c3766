"""What a field file says of its targets reaches the estimator."""

import math
from pathlib import Path
from typing import Any

import pytest

from groundstation.estimation.models import ConstantVelocityTarget, CoordinatedTurnTarget, ManoeuvringTarget
from groundstation.estimation.parameters import parameters_from_field
from groundstation.settings.load import load_field

FIXTURE = Path(__file__).parents[1] / "fixtures" / "field" / "lab.yaml"


def resolved(*options: str) -> dict[str, Any]:
    return load_field(FIXTURE, options).model_dump(mode="json")


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
