"""Flights of scenario files: the target is found and held, and what a strategy does not change stays the same."""

import json
from typing import Any

import msgspec
import pytest

from groundstation.settings.files import find_field, find_scenario
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field
from groundstation.settings.scenario import load_scenario
from groundstation.settings.sections import CAMERA, driver_sections
from sim_bridge.scenario import parse_scenario
from sim_bridge.study.scenarios.flight import ScenarioFlight, as_drawn

pytestmark = [pytest.mark.slow, pytest.mark.study]


def fly(name: str, strategy: str, seconds: float = 8.0) -> dict[str, Any]:
    path = find_field("lab")
    scenario = parse_scenario(json.dumps(load_scenario(find_scenario(name, path))))
    field = load_field(path, ("recording.raw_datagrams=false",))
    sections = [(s.kind, s.section) for s in driver_sections(field) if s.kind != CAMERA]
    drawn = as_drawn(msgspec.to_builtins(resolved_field(field)), scenario, 1)
    return ScenarioFlight(drawn, sections, seconds, strategy).fly()


@pytest.mark.parametrize("strategy", ["ours", "string", "relay", "chase"])
def test_a_target_that_wanders_is_found_and_held(strategy: str) -> None:
    flown = fly("random-walk", strategy)
    assert flown["flown"]
    assert flown["found_s"] is not None
    assert flown["lost_s"] == 0.0
    assert (flown["landings"], flown["violations"]) == (0, [])
    if strategy == "string":
        assert flown["switches"] <= 1
