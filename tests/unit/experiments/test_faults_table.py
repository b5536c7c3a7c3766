"""The fault campaign's table, and the command that prints it."""

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import pytest

from groundstation.cli.exits import ExitCode
from groundstation.cli.experiment import experiment
from groundstation.errors import OperatorMistake
from groundstation.experiments.faults import HEALTHY, by_kind, ends_told, table, totals
from groundstation.experiments.flight_batches import CampaignError, FlightBatch, batches, fly


def flight(seed: int, kinds: list[str], unsafe: dict[str, float], mode: str = "TRACK", **more: Any) -> dict[str, Any]:
    faults = [{"kind": kind, "stop_judged": True if kind == "velocity_stuck" else None} for kind in kinds]
    return {
        "seed": seed, "kinds": kinds, "faults": faults, "tracking_since_s": 6.0, "modes": {"a": mode},
        "separation_m": 1.0, "fence_m": 0.0, "speed_m_s": 0.5, "unlocalised_s": 0.0, "hover_s": None, "rest_s": None,
        "unsafe": unsafe, "unreached": [], "deaf": [],
    } | more  # fmt: skip


FLIGHTS = [
    flight(1, ["wind"], {}),
    flight(2, ["velocity_stuck", "wind"], {"speed": 12.0, "fence": 13.0}, separation_m=0.4),
    flight(3, ["velocity_stuck"], {"hover": 11.0}, "LANDED", hover_s=2.5, rest_s=3.0),
    flight(4, [], {}),
    flight(5, [], {}, "LANDED"),
    {"seed": 6, "kinds": ["wind"], "faults": [{}], "tracking_since_s": None, "modes": {"a": "LANDED"}},
]
HALF_FLOWN = flight(7, [], {"fence": 3.0}, "HOVER", tracking_since_s=None)


def test_the_table_counts_by_kind_and_names_seeds() -> None:
    rows = {row["kind"]: row for row in by_kind(FLIGHTS)}
    assert set(rows) == {"wind", "velocity_stuck", HEALTHY}
    stuck, wind = rows["velocity_stuck"], rows["wind"]
    assert (stuck["flights"], stuck["unsafe"], stuck["alone"], stuck["unsafe_alone"]) == (2, 2, 1, 1)
    assert stuck["seeds"] == [3, 2], "those with this fault alone first"
    assert stuck["why"] == {"hover": 1, "speed": 1}
    assert (stuck["separation_m"], stuck["hover_s"]) == (0.4, 2.5)
    assert (wind["flights"], wind["not_flown"], wind["unsafe"], wind["unsafe_alone"]) == (2, 1, 1, 0)
    (healthy,) = by_kind([HALF_FLOWN])
    assert (healthy["flights"], healthy["not_flown"], healthy["unsafe"], healthy["stopped"]) == (1, 1, 1, 0)
    text = "\n".join(table(list(rows.values())))
    assert "velocity_stuck" in text and "hover 1, speed 1; 3 2" in text


def test_stops_that_were_not_judged_are_told_from_perfect_ones() -> None:
    unjudged = flight(8, ["velocity_stuck"], {}, faults=[{"kind": "velocity_stuck", "stop_judged": False}])
    rows = {row["kind"]: row for row in by_kind([*FLIGHTS, unjudged])}
    stuck, wind = rows["velocity_stuck"], rows["wind"]
    assert (stuck["stops_judged"], stuck["stops_due"], wind["stops_due"]) == (2, 3, 0)
    head, wind_line, stuck_line, _ = (line.split() for line in table([wind, stuck, rows[HEALTHY]]))
    assert head[11:17] == ["stops", "judged", "hover", "s", "rest", "s"]
    assert wind_line[8:11] == ["-", "-", "-"], "not 0.00 s: nobody had to stop"
    assert stuck_line[8:11] == ["2/3", "2.50", "3.00"]
    assert "  1 of 3 faults that demand a stop were not judged by it" in ends_told(totals([*FLIGHTS, unjudged], []))[1]


def test_totals_name_false_alarms_and_where_time_goes() -> None:
    summary = totals(FLIGHTS, [{"tracker": 3.0, "world": 1.0, "cpu": 4.5}] * len(FLIGHTS))
    assert (summary["flights"], summary["unsafe"], summary["not_flown"]) == (5, 2, [6])
    assert summary["false_alarms"] == [5]
    assert summary["time_shares"] == {"tracker": 0.75, "world": 0.25}
    assert summary["cpu_s_per_flight"] == 4.5


def test_a_team_that_does_not_all_take_off_is_judged_and_is_no_false_alarm() -> None:
    summary = totals([HALF_FLOWN], [])
    assert (summary["flights"], summary["unsafe"], summary["not_flown"], summary["false_alarms"]) == (1, 1, [7], [])
    assert ends_told(summary) == [
        "1 of 1 flights ended unsafe; healthy flights stopped: none; did not all take off: [7]"
    ]


def test_unsafe_flights_that_nobody_could_stop_are_counted_and_named() -> None:
    spells = [{"flown_m": flown_m, "fastest_m_s": 0.5 + flown_m / 2} for flown_m in (0.2, 0.6, 1.5)]
    unsafe = {"fence": 15.0, "speed": 14.0}
    flights = [
        flight(1, ["at_deaf"], unsafe, unreached=["speed", "fence"], deaf=spells[:1]),
        flight(2, ["at_deaf", "wind"], unsafe, unreached=["speed"], deaf=spells[1:]),
        flight(3, ["wind"], {}),
    ]
    summary = totals(flights, [])
    assert (summary["unsafe"], summary["unreached"]) == (2, [1])
    assert summary["deaf"] == {
        "spells": 3, "flown_m_median": 0.6, "flown_m_most": 1.5, "fastest_m_s_median": 0.8, "fastest_m_s_most": 1.25,
    }  # fmt: skip
    unsafe_line, *told = ends_told(summary)
    assert unsafe_line.startswith("2 of 3 flights ended unsafe")
    assert "in 1 of the unsafe ones a drone heard nothing" in told[0] and told[0].endswith("could stop it (1)")
    assert "3 times" in told[1] and "0.60 m (median; 1.50 m at most) at up to 1.25 m/s" in told[1]
    assert len(ends_told(totals(FLIGHTS, []))) == 1


def test_batches_cover_all_seeds_once() -> None:
    found = batches(json.dumps({"x": 1}), 7, 45, size=20)
    assert [batch.seeds[0] for batch in found] == [7, 27, 47]
    assert sum((batch.seeds for batch in found), ()) == tuple(range(7, 52))
    assert len({batch.key for batch in found}) == 3


@pytest.mark.parametrize(("seed", "code"), [(1, ExitCode.OK), (3, ExitCode.FAILED), (6, ExitCode.FAILED)])
def test_the_command_fails_for_an_unsafe_end_and_for_a_team_on_the_floor(
    seed: int, code: ExitCode, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("groundstation.experiments.flight_batches.fly", flown_from([]))
    arguments = ["faults", "--flights", "1", "--seed", str(seed), "--scheduler", "none", "-o", str(tmp_path)]
    assert experiment.main(arguments, standalone_mode=False) == code


def flown_from(told: list[dict[str, Any]]) -> Callable[[FlightBatch], dict[str, Any]]:
    """Return a function that gives the flights above in place of flying them, and keeps the orders in `told`."""

    def flown(batch: FlightBatch) -> dict[str, Any]:
        told.append(json.loads(batch.order))
        flights = [FLIGHTS[seed - 1] for seed in batch.seeds]
        timing = [{"tracker": 1.0, "cpu": 1.0} for _ in flights]
        return {"task": {}, "merits": {"flights": flights}, "timing": {"flights": timing}}

    return flown


def test_the_command_writes_all_flights(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    told: list[dict[str, Any]] = []
    monkeypatch.setattr("groundstation.experiments.flight_batches.fly", flown_from(told))
    monkeypatch.setattr("groundstation.experiments.runner._planar_run", lambda: pytest.fail("needs no kernels"))
    options = ["--scheduler", "none", "--kinds", "wind, velocity_stuck", "--set", "safety.min_separation_m=0.7"]
    arguments = ["faults", "--flights", "3", *options, "--output", str(tmp_path)]
    code = experiment.main(arguments, standalone_mode=False)
    assert code == ExitCode.FAILED
    document = json.loads((tmp_path / "faults.json").read_text())
    assert [flight["seed"] for flight in document["flights_flown"]] == [1, 2, 3]
    assert document["unsafe"] == 2
    assert "2 of 3 flights ended unsafe" in capsys.readouterr().out
    order = told[0]
    assert order["kinds"] == ["wind", "velocity_stuck"]
    assert order["field"]["safety"]["min_separation_m"] == 0.7
    assert [kind for kind, _ in order["sections"]] == ["ardrone", "ardrone"]
    assert all(json.loads(section)["raw_datagrams"] is False for _, section in order["sections"])


def test_an_interrupted_campaign_goes_on_where_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    flown: list[tuple[int, ...]] = []

    def fly_two(batch: FlightBatch) -> dict[str, Any]:
        if len(flown) == 2:
            raise KeyboardInterrupt
        flown.append(batch.seeds)
        flights = [flight(seed, [], {}) for seed in batch.seeds]
        return {"task": {}, "merits": {"flights": flights}, "timing": {"flights": [{"cpu": 1.0} for _ in flights]}}

    monkeypatch.setattr("groundstation.experiments.flight_batches.fly", fly_two)
    arguments = ["faults", "--flights", "3", "--scheduler", "none", "-o", str(tmp_path)]
    with pytest.raises(click.Abort):
        experiment.main(arguments, standalone_mode=False)
    first, flown[:] = list(flown), []
    assert experiment.main(arguments, standalone_mode=False) == ExitCode.OK
    assert (first, flown) == ([(1,), (2,)], [(3,)])


def test_another_program_flies_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    (batch,) = batches("{}", 1, 1)
    key = batch.key
    monkeypatch.setattr("groundstation.experiments.flight_batches.program_digest", lambda *_: "of another program")
    assert batch.key != key


@pytest.mark.parametrize("out", ["", '{"seed": 1, "spent_s": {}}\n'])
def test_a_batch_whose_process_ends_early_without_an_error_is_refused(
    out: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    ended = subprocess.CompletedProcess((), 0, out, "last words")
    monkeypatch.setattr("groundstation.experiments.flight_batches.subprocess.run", lambda *_, **__: ended)
    (batch,) = batches("{}", 1, 2)
    with pytest.raises(CampaignError, match=rf"{out.count('seed')} of 2 flights .* last words"):
        fly(batch)


def test_an_unknown_kind_is_the_operators_mistake() -> None:
    order = {"field": {"drones": {}}, "sections": [], "scenario": {}, "seconds": 20.0, "kinds": ["wind", "gremlins"]}
    (batch,) = batches(json.dumps(order), 1, 1)
    with pytest.raises(OperatorMistake, match=r"no kind of fault: gremlins; there are .*wind"):
        fly(batch)


@pytest.mark.parametrize("study", ["faults", "scenarios"])
def test_a_vehicle_that_cannot_be_hosted_is_named_with_what_flies_it(study: str) -> None:
    order = {"field": {"drones": {"drone_1": {"kind": "ardrone"}, "scout": {"kind": "tello"}}}, "strategy": "ours"}
    (batch,) = batches(json.dumps(order), 1, 1, study=study)
    with pytest.raises(OperatorMistake, match=r"^scout is of kind tello: .*only; .*groundstation sitl"):
        fly(batch)
