"""A field's figure for a target matches the target's capabilities."""

import math
from pathlib import Path

import numpy as np
import pytest

from groundstation.bus.messages import Verdict
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.measurement import Measurement
from groundstation.estimation.models import ConstantVelocityTarget, CoordinatedTurnTarget, FixedMount, MountedCamera
from groundstation.estimation.parameters import WORLD_FROM_DOWN, EstimatorParameters, parameters_from_field
from groundstation.field.resolved import ResolvedField
from groundstation.planning.parameters import parameters_from_field as planner_from_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

START, MS = 10_000_000_000_000, 1_000_000
CONFIG = Path(__file__).parents[3] / "config"
HEIGHT_M, MARKER_M, SEEN_STD_M = 4.2, 0.4, 0.02
FIELDS = ("lab.yaml", "mixed-team.yaml", "two-targets.yaml")


def turns_on_the_spot(seconds: float) -> np.ndarray:
    """A Kobuki, 0.5 m/s and 0.5 m/s^2: drives for 3 s, stops, turns by a little more than a right angle; 100 Hz."""
    place, speed, heading, path = np.zeros(2), 0.0, 0.0, []
    for k in range(round(100 * seconds)):
        goes = k % 420 < 300
        speed += min(max((0.5 if goes else 0.0) - speed, -0.005), 0.005)
        heading += 0.0 if goes else 0.016
        place = place + 0.01 * speed * np.array([math.cos(heading), math.sin(heading)])
        path.append(place)
    return np.array(path)


def follow(field: ResolvedField, name: str) -> tuple[float, float]:
    """Return rmse [m] of the prediction at each observation (15 Hz, 2 cm), and the share of them beyond the gate."""
    target = parameters_from_field(field).entities[name]
    entities = {"ceiling": FixedMount((0.0, 0.0, HEIGHT_M), 0.004, 0.01), name: target}
    joint = FixedLagFilter(EstimatorParameters(entities, {"eye": MountedCamera("ceiling", WORLD_FROM_DOWN)}))
    rng, squares, beyond = np.random.default_rng(1), [], 0
    covariance = tuple(np.diag([SEEN_STD_M**2] * 3).ravel().tolist())
    for k, (x, y) in enumerate(turns_on_the_spot(40.0)[::7]):
        now = START + 70 * k * MS
        joint.advance(now)
        if k > 30:
            squares.append(float(np.sum((joint.belief().mean_of(name)[:2] - (x, y)) ** 2)))
        z = (x + SEEN_STD_M * rng.normal(), -y + SEEN_STD_M * rng.normal(), HEIGHT_M - MARKER_M)
        joint.add_observation(Measurement(now, "eye", name, z, None, covariance), "", now)
        joint.advance(now)
        beyond += joint.take_corrections()[-1].verdict is not Verdict.ACCEPTED
    return math.sqrt(float(np.mean(squares))), beyond / len(squares)


@pytest.mark.parametrize("file", FIELDS)
def test_a_turtlebot_that_turns_on_the_spot_is_followed_with_the_figure_of_a_shipped_field(file: str) -> None:
    field = resolved_field(load_field(CONFIG / file))
    for name in field.tracked:
        rmse_m, beyond = follow(field, name)
        assert rmse_m < 0.04
        assert beyond < 0.02


def test_estimator_and_planner_take_the_same_share_of_it_for_usual(lab_field: ResolvedField) -> None:
    """0.26 of the figure on time average; the planner's manoeuvres last 0.5 s."""
    usual = math.sqrt(0.07) * lab_field.tracked["turtlebot"].acceleration_std_m_s2
    target = parameters_from_field(lab_field).entities["turtlebot"]
    assert isinstance(target, ConstantVelocityTarget)
    assert target.acceleration_std_m_s2 == pytest.approx(usual)
    assert planner_from_field(lab_field).noise.target_acceleration == pytest.approx(0.5 * usual**2)


@pytest.mark.parametrize(
    ("base", "speed_m_s", "noise_m_s2", "turn_deg_s"),
    [("turtlebot_2", 0.7, 1.2, 180.0), ("person", 1.5, 4.8, 360.0), ("rc_car", 3.0, 9.6, 180.0)],
)
def test_a_base_says_what_a_target_can_do(base: str, speed_m_s: float, noise_m_s2: float, turn_deg_s: float) -> None:
    field = resolved_field(load_field(CONFIG / "lab.yaml", [f"target.base={base}"]))
    target = field.tracked["turtlebot"]
    assert (target.max_speed_m_s, target.max_turn_rate_deg_s) == (speed_m_s, turn_deg_s)
    assert target.acceleration_std_m_s2 == pytest.approx(noise_m_s2)
    model = parameters_from_field(field).entities["turtlebot"]
    assert isinstance(model, ConstantVelocityTarget)
    assert model.speed_std_m_s == pytest.approx(4 / 7 * speed_m_s)


def test_single_figures_go_before_the_base() -> None:
    told = ["target.base=person", "target.max_acceleration_m_s2=3", "target.max_speed_m_s=1"]
    target = resolved_field(load_field(CONFIG / "lab.yaml", told)).tracked["turtlebot"]
    assert (target.max_speed_m_s, target.max_turn_rate_deg_s) == (1.0, 360.0)
    assert target.acceleration_std_m_s2 == pytest.approx(7.2)
    direct = resolved_field(load_field(CONFIG / "lab.yaml", [*told, "target.acceleration_std_m_s2=0.3"]))
    assert direct.tracked["turtlebot"].acceleration_std_m_s2 == 0.3


def test_the_model_that_turns_is_scaled_by_the_turn_rate() -> None:
    field = resolved_field(load_field(CONFIG / "lab.yaml", ["target.model=coordinated_turn"]))
    model = parameters_from_field(field).entities["turtlebot"]
    assert isinstance(model, CoordinatedTurnTarget)
    assert model.turn_rate_std_rad_s == pytest.approx(0.5)
