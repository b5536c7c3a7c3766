"""The library examples of the documentation run unchanged."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.estimation import models

HOW_TO = Path(__file__).parents[3] / "docs" / "how-to"
PAGE, SENSOR_PAGE = HOW_TO / "use-the-estimator-as-a-library.md", HOW_TO / "add-a-sensor-model.md"
MOTION_PAGE = HOW_TO / "add-a-model-of-motion.md"


def examples_of(page: Path) -> list[str]:
    return re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.S)


def run_example(number: int) -> dict[str, Any]:
    names: dict[str, Any] = {}
    exec(compile(examples_of(PAGE)[number], str(PAGE), "exec"), names)
    return names


def test_the_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    belief = run_example(0)["belief"]
    rover, drone = belief.mean_of("rover"), belief.mean_of("drone")
    # The camera looks 45 degrees down and has the rover 0.898 m ahead of it.
    np.testing.assert_allclose(drone[:2], (0.52, 0.0), atol=0.05)
    np.testing.assert_allclose(rover[:2], (drone[0] + 0.09 + 0.898, 0.0), atol=0.05)
    assert "ACCEPTED" in capsys.readouterr().out


def test_the_example_on_real_data_runs(monkeypatch: pytest.MonkeyPatch, real_data: Callable[[str], Path]) -> None:
    monkeypatch.setenv("GROUNDSTATION_DATA", str(real_data("mrclam7").parent))
    assert max(run_example(1)["errors_m"]) < 0.3


@pytest.fixture
def tests_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[Path, str], dict[str, Any]]:
    """Save a page's model beside the models, as the page requires, and return the test that it defines."""

    def saved(page: Path, name: str) -> dict[str, Any]:
        model, test = examples_of(page)
        (tmp_path / name).write_text(model)
        monkeypatch.setattr(models, "__path__", [*models.__path__, str(tmp_path)])
        names: dict[str, Any] = {}
        exec(compile(test, str(page), "exec"), names)
        return names

    return saved


def test_the_sensor_model_of_the_how_to_passes_its_own_test(tests_of: Callable[[Path, str], dict[str, Any]]) -> None:
    names, (model, _) = tests_of(SENSOR_PAGE, "uwb_range.py"), examples_of(SENSOR_PAGE)
    names["test_the_derivatives_are_exact"]()
    names["test_four_anchors_find_the_robot"]()
    assert len(model[model.index("\nclass") :].strip().splitlines()) <= 40


def test_the_model_of_motion_of_the_how_to_passes_its_own_test(tests_of: Callable[[Path, str], dict[str, Any]]) -> None:
    names = tests_of(MOTION_PAGE, "coasting_target.py")
    names["test_out_of_sight_it_rolls_to_rest"]()
    names["test_its_velocity_becomes_as_uncertain_as_it_was_and_no_more"]()
