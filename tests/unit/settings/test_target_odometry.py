"""A target's odometry in a field file: refusals, values for driver and estimator, and its emulation."""

from pathlib import Path

import pytest

from drivers.target_odometry.settings import OdometrySection
from groundstation.errors import SettingsError
from groundstation.estimation.models import ReportedVelocity
from groundstation.estimation.parameters import parameters_from_field
from groundstation.flight.composition import Simulation, process_table, simulated
from groundstation.flight.real_parts import RealParts
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field, summary_of
from groundstation.settings.schema import Field
from groundstation.supervisor.network import Network

CONFIG = Path(__file__).parents[3] / "config"
SOURCE = "ros2://192.168.1.20/odom?domain=3"
NETWORK = Network("127.64.1", -1, 7447, 8080, "")


@pytest.fixture
def field() -> Field:
    return load_field(CONFIG / "lab.yaml", (f"target.odometry.source={SOURCE}", "target.odometry.speed_std_m_s=0.1"))


@pytest.mark.parametrize(
    ("option", "told"),
    [
        ("target.odometry.source=ros2://192.168.1.20", "target.odometry.source: must be a topic behind a ROS 2"),
        ("target.odometry.source=ros2://192.168.1.20/odom?domain=900", "there may be domain=0 to 232"),
        ("target.odometry={speed_std_m_s: 0.1}", "target.odometry.source"),
        ("target.name=rover_odometry", "the name rover_odometry is taken"),
    ],
)
def test_a_wrong_one_is_refused_with_its_place(option: str, told: str) -> None:
    with pytest.raises(SettingsError) as refused:
        load_field(CONFIG / "lab.yaml", (option,))
    assert told in str(refused.value)


def test_its_driver_speaks_of_the_target_alone(field: Field, tmp_path: Path) -> None:
    table = {one.name: one for one in process_table(field, "tcp/127.0.0.1:1", tmp_path, simulation=None, monitor=False)}
    row = table["turtlebot_odometry"]
    assert (row.role, row.entities, row.required) == ("target", ("turtlebot", "turtlebot_odometry"), False)
    own = OdometrySection.model_validate_json(row.section)
    assert (own.source, own.target, own.speed_std_m_s, own.max_speed_m_s) == (SOURCE, "turtlebot", 0.1, 0.7)
    assert f"constant velocity, odometry from {SOURCE}" in summary_of(field)


def test_the_estimator_has_a_sensor_that_the_target_carries(field: Field) -> None:
    parameters = parameters_from_field(resolved_field(field))
    assert parameters.sensors["turtlebot_odometry"] == ReportedVelocity("turtlebot")
    assert parameters.reporting == {"turtlebot"}
    assert parameters_from_field(resolved_field(load_field(CONFIG / "lab.yaml"))).reporting == frozenset()


def test_in_simulation_the_same_topic_is_behind_an_emulated_router(field: Field, tmp_path: Path) -> None:
    moved = simulated(field, NETWORK)
    assert moved.target is not None and moved.target.odometry is not None
    assert moved.target.odometry.source == "ros2://127.64.1.53:8080/odom?domain=3"
    run = Simulation(NETWORK, {}, 1)
    (bridge,) = [
        one
        for one in process_table(moved, "tcp/127.0.0.1:1", tmp_path, simulation=run, monitor=False)
        if one.name == "sim_bridge"
    ]
    assert '"turtlebot_odometry": ["127.64.1.53", 8080]' in bridge.section


def test_a_real_target_keeps_its_own(field: Field) -> None:
    real = RealParts(targets=frozenset({"turtlebot"}), cameras=frozenset({"ceiling"}))
    assert simulated(field, NETWORK, real).target == field.target


def test_one_of_several_targets_may_have_one(tmp_path: Path) -> None:
    field = load_field(CONFIG / "two-targets.yaml", (f"targets.turtlebot_2.odometry.source={SOURCE}",))
    moved = simulated(field, NETWORK)
    assert moved.targets["turtlebot_1"] == field.targets["turtlebot_1"]
    assert moved.targets["turtlebot_2"].odometry != field.targets["turtlebot_2"].odometry
