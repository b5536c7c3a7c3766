"""Results of flown scenarios: criteria for found, lost and as expected, and the comparison of strategies."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.cli.experiment_campaign import PICTURES_ONLY, flown_scenario
from groundstation.cli.experiment_scenarios import _labelled
from groundstation.experiments.scenarios import STRATEGIES, against_best_fixed, comparison, paired, rows_of, table
from groundstation.settings.files import SHIPPED, find_field
from sim_bridge.scenario import CameraScenario
from sim_bridge.study.scenarios.figures import TrackingErrors, shortfalls
from sim_bridge.surroundings import ScenarioExpectation


def errors_of(*meters: float | None) -> dict[str, Any]:
    errors = TrackingErrors(period_s=0.5)
    for off in meters:
        errors.take({"target": np.zeros(13)}, {"target": None if off is None else np.array([off, 0.0])})
    return errors.figures()


def flight(seed: int, rmse_m: float | None, strategy: str = "ours", **more: Any) -> dict[str, Any]:
    figures = {"rmse_m": rmse_m, "lost_s": 0.0, "longest_loss_s": 0.0, "found_s": 0.5, "switches": 1, "plan_ms": 2.5}
    return {"scenario": "walk", "strategy": strategy, "seed": seed, "missed": [], "flown": True, **figures, **more}


def test_figures_count_from_when_the_target_was_found() -> None:
    figures = errors_of(None, 5.0, 0.1, 0.1, 0.7, 0.8, 0.1, 0.9)
    assert figures["found_s"] == 1.0
    assert figures["lost_s"] == 1.5
    assert figures["longest_loss_s"] == 1.0
    assert figures["worst_m"] == 0.9
    assert figures["rmse_m"] == pytest.approx(np.sqrt((3 * 0.01 + 0.49 + 0.64 + 0.81) / 6), abs=1e-4)


def test_a_target_that_is_given_up_counts_as_lost() -> None:
    assert errors_of(0.1, None, None)["lost_s"] == 1.0


def test_a_target_that_was_never_found_has_no_error() -> None:
    assert errors_of(None, 2.0)["found_s"] is None
    assert errors_of(None, 2.0)["rmse_m"] is None


def test_each_figure_is_that_of_the_target_for_which_it_is_worst() -> None:
    errors = TrackingErrors(period_s=0.5)
    for steady, lost in zip((0.2, 0.2, 0.2, 0.2), (0.0, 0.6, 0.0, 0.0), strict=True):
        places = {"steady": np.array([steady, 0.0]), "lost": np.array([lost, 0.0])}
        errors.take(dict.fromkeys(places, np.zeros(13)), places)
    figures = errors.figures()
    assert (figures["lost_s"], figures["longest_loss_s"], figures["worst_m"]) == (0.5, 0.5, 0.6)
    apart = TrackingErrors(period_s=0.5)
    for off in (0.2, 0.2, 0.2):
        apart.take(dict.fromkeys("ab", np.zeros(13)), {"a": np.array([off, 0.0]), "b": None})
    assert set(apart.figures().values()) == {None}, "one target was never found"


def test_missed_criteria_are_named_with_their_limits() -> None:
    expected = ScenarioExpectation(rmse_m=0.05, lost_s=0.0, found_s=10.0)
    flown = {"found_s": None, "rmse_m": 0.1, "lost_s": 0.0, "landings": 1, "violations": ["fence 0.10 m"]}
    assert shortfalls(flown, expected) == [
        "found_s never > 10", "rmse_m 0.1 > 0.05", "landings 1 > 0", "fence 0.10 m",
    ]  # fmt: skip
    good = {"found_s": 1.0, "rmse_m": 0.01, "lost_s": 0.0, "landings": 0, "violations": []}
    assert shortfalls(good, expected) == []


def test_strategies_are_compared_seed_by_seed() -> None:
    ours = [flight(seed, value) for seed, value in ((1, 0.02), (2, 0.04), (3, 0.03))]
    relay = [flight(seed, value, "relay") for seed, value in ((1, 0.03), (2, 0.05), (4, 9.0))]
    assert paired(relay, ours) == pytest.approx((0.01, 0.0), abs=1e-12)
    assert paired(relay[:1], ours) is None
    apart = [one | {"rmse_m": one["rmse_m"] + rank} for rank, one in enumerate(relay[:2])]
    gap = paired(apart, ours)
    assert gap is not None and gap[1] == pytest.approx(12.706 / 2.0, abs=1e-3), "Student's factor of two flights"
    first, second = rows_of([*ours, *relay])
    assert first["against"] is None
    assert second["rmse_m"] == pytest.approx([(0.03 + 0.05 + 9.0) / 3, 0.05, 9.0])
    assert "+0.010" in table([first, second])[2]
    assert second["plan_ms"] == 2.5 and "  2.5  +0.010" in table([first, second])[2]


def test_the_best_fixed_topology_is_compared_with_over_the_seeds_of_both() -> None:
    flown = {
        "ours": (0.02, 0.03, 0.5), "relay": (0.03, 0.06),
        "string": (0.03, 0.05), "reversed": (0.02, 0.04), "flat": (0.5, None),
    }  # fmt: skip
    flights = [flight(seed, rmse, name) for name, errors in flown.items() for seed, rmse in enumerate(errors)]
    ours, relay = against_best_fixed(flights)
    assert (ours["strategy"], ours["best"], relay["strategy"]) == ("ours", "reversed", "relay")
    assert ours["share"] == pytest.approx(0.05 / 0.06 - 1.0)
    assert ours["gap_m"][0] == pytest.approx(-0.005)
    assert relay["share"] == pytest.approx(0.5)
    assert comparison([ours])[0].startswith("walk ours: -17% against reversed (-0.005 +- ")


def test_a_fixed_topology_that_hardly_ever_finds_the_target_is_not_the_best() -> None:
    flown: dict[str, tuple[float | None, ...]] = {
        "ours": (0.02, 0.03, 0.04), "string": (0.03, 0.04, 0.08), "reversed": (0.04, 0.05, 0.05),
        "flat": (0.001, None, None),
    }  # fmt: skip
    flights = [flight(seed, rmse, name) for name, errors in flown.items() for seed, rmse in enumerate(errors)]
    (ours,) = against_best_fixed(flights)
    assert (ours["best"], ours["seeds"]) == ("reversed", 3)
    assert comparison([ours])[0].endswith(" over 3 seeds (found 3/3, 3/3)")
    never = [row["never_found"] for row in rows_of(flights)]
    assert never == [0, 0, 0, 2] and [line.split()[3] for line in table(rows_of(flights))[1:]] == list("0002")


def test_as_often_found_topologies_are_ranked_over_the_seeds_of_all() -> None:
    flown = {"ours": (0.02, 0.03, 0.04), "string": (0.03, 0.04, None), "flat": (0.02, None, 0.9)}
    flights = [flight(seed, rmse, name) for name, errors in flown.items() for seed, rmse in enumerate(errors)]
    assert [one["best"] for one in against_best_fixed(flights)] == ["flat"]


def test_without_a_fixed_topology_or_a_second_seed_there_is_less_to_say() -> None:
    assert against_best_fixed([flight(1, 0.02), flight(1, 0.03, "relay")]) == []
    (one,) = against_best_fixed([flight(1, 0.02), flight(1, 0.04, "flat")])
    assert (one["share"], one["gap_m"]) == (pytest.approx(-0.5), None)
    assert comparison([one]) == ["walk ours: -50% against flat over 1 seed (found 1/1, 1/1)"]


def test_a_scenario_that_never_found_its_target_has_a_row() -> None:
    lost = flight(1, None, missed=["found_s never > 25"], lost_s=None, longest_loss_s=None, found_s=None)
    (row,) = rows_of([lost])
    assert (row["never_found"], row["as_expected"]) == (1, 0)
    assert table([row])[1].split()[2:6] == ["0/1", "1", "0", "-"]


def test_a_team_that_did_not_take_off_has_not_failed_to_find() -> None:
    grounded = dict.fromkeys(("rmse_m", "lost_s", "longest_loss_s", "found_s")) | {"flown": False}
    (row,) = rows_of([flight(1, 0.02), flight(2, None), flight(3, None, missed=["did not take off"]) | grounded])
    assert (row["never_found"], row["not_flown"]) == (1, 1)
    assert table([row])[1].split()[2:5] == ["2/3", "1", "1"]


def test_a_comparison_says_how_often_each_found_the_target() -> None:
    flown = {"ours": (0.02, 0.02, None), "relay": (None, None, None), "string": (0.03, 0.03, 0.05)}
    flights = [flight(seed, rmse, name) for name, errors in flown.items() for seed, rmse in enumerate(errors)]
    ours, relay = comparison(against_best_fixed(flights))
    assert ours.startswith("walk ours: -33% against string") and ours.endswith(" over 2 seeds (found 2/3, 3/3)")
    assert relay == "walk relay: no seed that both found against string (found 0/3, 3/3)"


def test_both_sides_know_the_same_strategies() -> None:
    from sim_bridge.study.scenarios.strategies import STRATEGIES as SIMULATED  # imported here: it compiles kernels

    assert tuple(SIMULATED) == STRATEGIES


def test_each_scenario_says_what_it_expects_in_its_header() -> None:
    told = [
        path for path in (SHIPPED / "scenarios").glob("*.yaml") if "\nexpected:" in path.read_text(encoding="utf-8")
    ]
    assert len(told) >= 15
    for path in told:
        assert "# Expected: " in path.read_text(encoding="utf-8"), path.name


def test_scenarios_of_one_name_are_rows_of_their_own_and_one_named_twice_is_flown_once() -> None:
    named = ("a/hard.yaml", "b/hard.yaml", "corner", "corner")
    assert _labelled(named) == {"a/hard.yaml": "a/hard.yaml", "b/hard.yaml": "b/hard.yaml", "corner": "corner"}


def test_picture_settings_without_effect_at_message_level_are_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dark = tmp_path / "dark.yaml"
    dark.write_text("schema_version: 1\ncameras: {light: 0.2, rolling_shutter_ms: 20, fps: 12, exposure_ms: 4.0}\n")
    assert flown_scenario(str(dark), find_field("lab"))["cameras"]["light"] == 0.2
    assert "cameras.rolling_shutter_ms, cameras.light: " in capsys.readouterr().err
    flown_scenario("realistic", find_field("lab"))
    assert not capsys.readouterr().err
    assert set(PICTURES_ONLY) < set(CameraScenario.model_fields)
