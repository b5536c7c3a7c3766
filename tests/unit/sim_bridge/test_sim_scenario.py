"""Scenario files: every key is checked, and the default scenario is not optimistic."""

import json
import math
from pathlib import Path
from typing import Any

import pytest
from realism import weaker_than_reality
from ruamel.yaml import YAML

from groundstation.errors import SettingsError
from sim_bridge.scenario import Scenario, parse_scenario

SCENARIOS = Path(__file__).parents[3] / "config" / "scenarios"


def read(name: str) -> dict[str, Any]:
    data: dict[str, Any] = YAML(typ="safe").load((SCENARIOS / name).read_text())
    return data


def test_the_default_scenario_is_honest() -> None:
    assert weaker_than_reality(parse_scenario(json.dumps(read("realistic.yaml")))) == []


def test_keys_missing_in_a_scenario_have_realistic_defaults() -> None:
    data = read("realistic.yaml")
    data["cameras"]["fps"] = 15  # docs/decisions/0138: fewer are harder, and fit two slow cores
    assert parse_scenario(json.dumps(data)) == Scenario()


def test_the_default_scenario_names_every_figure() -> None:
    data = read("realistic.yaml")
    default = Scenario()
    for section, figures in (("drones", default.drones), ("cameras", default.cameras), ("target", default.target)):
        assert set(data[section]) >= set(type(figures).model_fields) - {"downwash"}, section


@pytest.mark.parametrize(
    ("section", "key", "value"),
    [
        ("drones", "navdata_hz", 100),
        ("drones", "velocity_gain", [0.85, 1.0]),
        ("drones", "velocity_gain", [0.86, 0.9]),
        ("drones", "velocity_delay_ms", [0, 40]),
        ("drones", "velocity_delay_ms", [20, 30]),
        ("drones", "height_noise_m", 0.033),
        ("drones", "height_delay_ms", 84),
        ("drones", "attitude_noise_deg", 0.9),
        ("drones", "attitude_correlation_s", 1.0),
        ("drones", "yaw_wander_deg", 2.9),
        ("drones", "yaw_jump_at_lift_off_deg", [0, 0]),
        ("cameras", "video_delay_ms", 119),
        ("cameras", "video_jitter_ms", 19),
        ("cameras", "fps", 30),
        ("cameras", "frame_loss", 0.04),
        ("cameras", "corner_noise_px", 0.19),
        ("target", "path", {"shape": "none"}),
        ("target", "path", {"shape": "figure_eight", "speed_m_s": 0.19}),
    ],
)
def test_weaker_values_are_refused(section: str, key: str, value: Any) -> None:
    data = read("realistic.yaml")
    data[section][key] = value
    assert [line for line in weaker_than_reality(parse_scenario(json.dumps(data))) if line.startswith(section)]


def test_all_problems_are_named_at_once() -> None:
    text = '{"drones": {"velocity_gain": [0.9, 0.8], "speling": 1}, "seed": -1, "faults": [{"kind": "flood"}]}'
    with pytest.raises(SettingsError) as refused:
        parse_scenario(text)
    lines = str(refused.value)
    for part in ("drones.velocity_gain", "drones.speling", "seed", "faults.0.kind", "faults.0.entity"):
        assert part in lines


def test_faults_need_what_they_use() -> None:
    with pytest.raises(SettingsError, match="end_s must be after start_s"):
        parse_scenario('{"faults": [{"kind": "navdata_silent", "entity": "d", "start_s": 2, "end_s": 1}]}')
    with pytest.raises(SettingsError, match="battery_drop needs a value"):
        parse_scenario('{"faults": [{"kind": "battery_drop", "entity": "d", "start_s": 2}]}')


@pytest.mark.parametrize(
    "scenario",
    [
        {"cameras": {"fps": 1e-300}},
        {"target": {"departs_after_team_s": 1e308}},
        {"target": {"path": {"shape": "none", "position_m": [1e300, 0.0]}}},
        {"target": {"path": {"shape": "figure_eight", "centre_m": [0.0, -1e300]}}},
    ],
)
def test_absurd_values_are_refused(scenario: dict[str, Any]) -> None:
    with pytest.raises(SettingsError):
        parse_scenario(json.dumps(scenario))


def test_the_unkind_scenario_wanders_as_the_recorded_flight_did() -> None:
    drones = parse_scenario(json.dumps(read("unkind.yaml"))).drones
    share = 1.0 - math.exp(-60.0 / drones.yaw_wander_correlation_s)
    assert drones.yaw_wander_deg * math.sqrt(2.0 * share) == pytest.approx(8.0, abs=0.1)
    assert drones.moving_air_lean_deg == 10.0


def test_the_shipped_scenarios_are_whole() -> None:
    for path in SCENARIOS.glob("*.yaml"):
        parse_scenario(json.dumps(read(path.name)))
