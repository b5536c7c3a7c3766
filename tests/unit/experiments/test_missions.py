"""Results of missions: rows by stated covariance, and the seeds that broke a bound."""

from typing import Any

from groundstation.experiments.missions import rows_of, table

FIGURES: dict[str, Any] = {"separation_m": 0.9, "fence_m": 0.0, "obstacle_m": None, "unlocalised_s": 0.0, "unsafe": {}}


def flown(seed: int, share: float = 1.0, drift: float = 0.0, **figures: Any) -> dict[str, Any]:
    ends = {"landed_before": [], "landed": True}
    wrong = {"covariance_share": share, "drift_m_s": drift, "drones": 2}
    return {"seed": seed, **wrong, "flown": True, **FIGURES, **ends, **figures}


def test_a_broken_bound_counts_and_another_fault_does_not() -> None:
    near = flown(2, separation_m=0.5, unsafe={"separation": 12.0, "speed": 14.0})
    (row,) = rows_of([flown(1), near, flown(3, unsafe={"unlocalised": 9.0}, unlocalised_s=1.4)])
    assert (row["flights"], row["violations"]) == (3, {2: {"separation": 12.0}})
    assert (row["separation_m"], row["unlocalised_s"]) == (0.5, 1.4)


def test_who_comes_near_to_a_pillar_breaks_a_bound() -> None:
    (row,) = rows_of([flown(1, obstacle_m=0.5), flown(2, obstacle_m=0.2, unsafe={"obstacle": 20.0}), flown(3)])
    assert (row["obstacle_m"], row["violations"]) == (0.2, {2: {"obstacle": 20.0}})


def test_flights_that_state_too_little_have_a_row_of_their_own() -> None:
    whole, less = rows_of([flown(1), flown(3, 0.25, fence_m=0.1, unsafe={"fence": 31.0}, landed=False)])
    assert whole["violations"] == {} and whole["not_landed"] == []
    assert less["violations"] == {3: {"fence": 31.0}} and less["not_landed"] == [3]
    assert table([whole, less])[2].split() == ["0.25", "0.00", "1", "1", "0.90", "0.10", "-", "0.00", "0", "1", "3"]


def test_missions_not_flown_are_listed_without_figures() -> None:
    on_the_floor = {name: value for name, value in flown(7).items() if name not in FIGURES} | {"flown": False}
    (row,) = rows_of([on_the_floor])
    assert (row["flights"], row["not_flown"], row["separation_m"]) == (0, [7], None)
    assert table([row])[1].split() == ["1.00", "0.00", "0", "0", "-", "-", "-", "-", "0", "0", "7"]


def test_a_violation_before_all_have_taken_off_counts() -> None:
    (row,) = rows_of([flown(7, fence_m=0.2, unsafe={"fence": 4.0}) | {"flown": False}])
    assert (row["flights"], row["not_flown"], row["violations"], row["fence_m"]) == (0, [7], {7: {"fence": 4.0}}, 0.2)


def test_drifting_flights_have_a_row_of_their_own_and_rows_name_the_sizes_of_teams() -> None:
    whole, drifting = rows_of([flown(1, drift=0.05, drones=3), flown(2), flown(4, drift=0.05), flown(5)])
    assert (whole["drift_m_s"], whole["flights"], whole["drones"]) == (0.0, 2, [2])
    assert (drifting["drift_m_s"], drifting["flights"], drifting["drones"]) == (0.05, 2, [2, 3])
