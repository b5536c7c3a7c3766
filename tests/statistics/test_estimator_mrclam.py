"""The joint filter on real data: UTIAS MRCLAM set 7, causal, one set of parameters; bounds as needed in real use."""

from collections.abc import Callable
from pathlib import Path

import pytest

from groundstation.experiments.mrclam.dataset import Dataset, read_dataset
from groundstation.experiments.mrclam.run import ScenarioErrors, run_scenario
from groundstation.experiments.mrclam.scenarios import SCENARIOS

BY_NAME = {scenario.name: scenario for scenario in SCENARIOS}

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]


@pytest.fixture(scope="module")
def dataset(real_data: Callable[[str], Path]) -> Dataset:
    return read_dataset(real_data("mrclam7"))


def both(dataset: Dataset, name: str) -> tuple[ScenarioErrors, ScenarioErrors]:
    return run_scenario(dataset, BY_NAME[name], False), run_scenario(dataset, BY_NAME[name], True)


def test_all_landmarks(dataset: Dataset) -> None:
    alone, together = both(dataset, "all landmarks")
    assert together.rmse_m <= 0.105
    assert together.rmse_deg <= 5.0
    assert together.rmse_m <= 0.7 * alone.rmse_m
    assert together.anees <= 2.0
    assert not alone.lost
    assert not together.lost


@pytest.mark.exhaustive
def test_only_robot_1_sees_landmarks(dataset: Dataset) -> None:
    alone, together = both(dataset, "robot 1 only")
    assert together.rmse_m <= 0.20
    assert alone.rmse_m >= 8.0 * together.rmse_m
    assert together.anees <= 2.0
    assert not together.lost


@pytest.mark.exhaustive
def test_a_camera_over_half_the_room(dataset: Dataset) -> None:
    together = run_scenario(dataset, BY_NAME["half-room camera"], True)
    assert together.rmse_m <= 0.10
    assert together.anees <= 2.0
    assert not together.lost


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("camera with dark spells", marks=pytest.mark.exhaustive),
        "half-room camera with dark spells",
    ],
)
def test_dark_spells_lose_nobody(dataset: Dataset, name: str) -> None:
    together = run_scenario(dataset, BY_NAME[name], True)
    assert together.anees <= 4.0
    assert not together.lost
