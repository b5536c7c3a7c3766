"""Re-run of a recorded run: beliefs and plans are equal to the bit, or the first difference is reported."""

import json
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
from click.testing import CliRunner
from rewritten import rewritten, without

from groundstation.bus.messages import Belief
from groundstation.cli.main import groundstation
from groundstation.recording.chunks import RawRecord
from groundstation.recording.reader import open_recording
from groundstation.replay.source import open_source
from groundstation.replay.verify import Repetition
from groundstation.settings.recorded import recorded_field
from groundstation.settings.resolved import resolved_field

FIXTURE = Path(__file__).parents[1] / "fixtures" / "replay"
SAID = {"estimate", "belief", "plan", "setpoint", "innovation"}


def code_of(*arguments: object) -> tuple[int, str]:
    """Return exit code and output as the `groundstation` command has them."""
    result = CliRunner().invoke(groundstation, ["replay", *map(str, arguments)], standalone_mode=False)
    if result.exception is not None:
        return -1, f"{result.output}{result.exception}"
    return int(result.return_value or 0), result.output


@pytest.fixture
def verdict() -> Any:
    def read(*arguments: object) -> tuple[int, dict[str, Any]]:
        code, output = code_of(*arguments, "--json")
        assert code >= 0, output
        return code, dict(json.loads(output))

    return read


def test_a_recording_is_repeated_to_the_bit(flown: Path, verdict: Any) -> None:
    code, said = verdict(flown, "--recompute")
    assert code == 0 and said["identical"]
    compared = said["comparison"]
    assert set(compared["same"]) == SAID and compared["same"]["estimate"] == compared["ticks"] == 400
    assert compared["same"]["plan"] == compared["plans"] > 50 and compared["same"]["belief"] == 40
    assert not (compared["unrecorded"] or compared["missing_count"] or compared["differing"])


def test_one_measurement_changed_by_a_nanometre_is_noticed(flown: Path, tmp_path: Path, verdict: Any) -> None:
    changed: list[int] = []
    began_ns = next(open_recording(flown / "state.mcap").raw_records()).log_time_ns

    def change(record: RawRecord) -> bytes:
        if record.key.topic.name != "observation" or record.log_time_ns < began_ns + 7_000_000_000 or changed:
            return record.data
        changed.append(record.log_time_ns)
        message = json.loads(record.data)
        message["position_m"][0] += 1e-9
        return json.dumps(message).encode()

    code, said = verdict(rewritten(flown, tmp_path / "changed", change), "--recompute")
    assert code == 1 and not said["identical"]
    first = said["first_differences"][0]
    at_s = float(first.split(", ")[1].split(" s")[0])
    # The difference is found where the observation was used: a camera's delay after its exposure.
    assert 0.0 < at_s - (changed[0] - began_ns) / 1e9 < 0.4, first
    assert "recorded" in first and "now" in first


def test_an_input_that_was_not_recorded_is_named(flown: Path, tmp_path: Path) -> None:
    lost: list[RawRecord] = []

    def lose(record: RawRecord) -> bytes | None:
        if record.key.topic.name == "odometry" and record.sequence == 250 and not lost:
            lost.append(record)
            return None
        return record.data

    code, output = code_of(rewritten(flown, tmp_path / "lost", lose), "--recompute")
    assert code == 1
    assert "1 messages that the tracker took in are not recorded" in output
    assert f"{lost[0].key} number 250" in output


def test_lost_output_messages_are_no_difference(flown: Path, tmp_path: Path, verdict: Any) -> None:
    some = rewritten(
        flown,
        tmp_path / "some",
        lambda r: None if r.key.topic.name in ("innovation", "plan") and r.sequence % 7 == 0 else r.data,
    )
    code, said = verdict(some, "--recompute")
    assert code == 0
    assert set(said["comparison"]["unrecorded"]) == {"innovation", "plan"}


def test_a_cut_recording_is_repeated_as_far_as_it_goes(flown: Path, tmp_path: Path, verdict: Any) -> None:
    whole = (flown / "state.mcap").read_bytes()
    (tmp_path / "state.mcap").write_bytes(whole[: len(whole) * 2 // 3])
    code, said = verdict(tmp_path / "state.mcap", "--recompute")
    assert 100 < said["comparison"]["ticks"] < 400
    assert said["comparison"]["damage"] and said["comparison"]["differing"] == 0
    assert code == 0


def test_a_journal_that_begins_late_proves_nothing(flown: Path, tmp_path: Path) -> None:
    def change(record: RawRecord) -> bytes | None:
        early = record.key.topic.name == "journal" and json.loads(record.data)["tick"] < 30
        return None if early else record.data

    code, output = code_of(rewritten(flown, tmp_path / "late", change), "--recompute")
    assert code == 1
    assert "the journal begins, or goes on after a gap, at tick 30" in output


@pytest.mark.parametrize(("last_tick", "code"), [(200, 1), (370, 0)])
def test_a_journal_that_ends_early_proves_nothing(flown: Path, tmp_path: Path, last_tick: int, code: int) -> None:
    """But the last half second of a killed run may lack it."""

    def change(record: RawRecord) -> bytes | None:
        late = record.key.topic.name == "journal" and json.loads(record.data)["tick"] > last_tick
        return None if late else record.data

    found, output = code_of(rewritten(flown, tmp_path / "early", change), "--recompute")
    assert found == code and ("IDENTICAL to the bit" in output) == (code == 0)
    assert ("not all of it: the journal ends at 4." in output) == (code == 1), output
    assert "before the tracker's last message" in output or code == 0


def test_other_settings_are_computed_the_same_twice(flown: Path, tmp_path: Path, verdict: Any) -> None:
    change = ("--set", "planner.horizon_steps=3", "--set", "estimator.gate_probability=0.5")
    code, first = verdict(flown, *change, "--output", tmp_path / "what-if")
    _, second = verdict(flown, *change)
    assert code == 0 and first["changed_anything"]
    assert first["output_sha256"] == second["output_sha256"]
    figures = first["figures"]
    inflated = figures["observations INFLATED"]
    assert (inflated["after"] or 0) > (inflated["before"] or 0)
    assert 0.0 < figures["target rmse [m]"]["after"] < 0.5  # judged by the recorded truth
    # The written re-run is a run of its own: with its settings in it, it is repeated to the bit.
    assert code_of(tmp_path / "what-if", "--recompute")[0] == 0
    assert open_source([tmp_path / "what-if"]).resolved.planner.horizon_steps == 3


def test_a_setting_that_is_none_of_the_trackers_changes_nothing(flown: Path, verdict: Any) -> None:
    _, said = verdict(flown, "--set", "console.port=9001")
    assert said["changed_anything"] is False


def test_the_estimator_of_another_file(flown: Path, tmp_path: Path, verdict: Any) -> None:
    other = tmp_path / "other.yaml"
    other.write_text("estimator:\n  gate_probability: 0.5\n")
    _, with_file = verdict(flown, "--estimator", other)
    assert with_file["changed_anything"] and with_file["with"] == [f"estimator of {other}"]
    other.write_text("planner: {}\n")
    assert "has no `estimator:` section" in code_of(flown, "--estimator", other)[1]


def test_the_truth_is_for_judging_only(flown: Path, tmp_path: Path, verdict: Any) -> None:
    blind = rewritten(flown, tmp_path / "blind", without("state"))
    _, seeing = verdict(flown, "--recompute")
    _, unseeing = verdict(blind, "--recompute")
    assert seeing["output_sha256"] == unseeing["output_sha256"]


@pytest.mark.parametrize(
    ("topics", "reason"),
    [
        (("journal",), "no journal of the tracker"),
        (("odometry", "observation", "vehicle_status", "searched_picture"), "nothing to re-run with"),
    ],
)
def test_a_recording_that_cannot_be_rerun_is_refused_with_a_reason(
    flown: Path, tmp_path: Path, topics: tuple[str, ...], reason: str
) -> None:
    code, output = code_of(rewritten(flown, tmp_path / "less", without(*topics)), "--recompute")
    assert code == -1 and reason in output


def test_a_foreign_version_is_said(flown: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from groundstation.replay import versions

    assert versions.foreign(open_source([flown]).versions) == []
    monkeypatch.setattr(versions, "version", lambda name: "99.0")
    lines = versions.foreign(open_source([flown]).versions)
    assert any(line.startswith("numba ") and line.endswith(", 99.0 now") for line in lines)


def test_recordings_made_earlier_are_understood() -> None:
    """The stored recording: every message still has its meaning, and today's tracker has nearly the same beliefs."""
    source = open_source([FIXTURE])
    repetition = Repetition(source, resolved_field(recorded_field(source.field)))
    now = {m.header.stamp_ns: m for lived in repetition.ticks() for _, m in lived.said if isinstance(m, Belief)}
    recording = open_recording(source.state[0])
    then = [record.message for record in recording.records(lambda topic: topic.name == "belief")]
    assert repetition.comparison.ticks == 400 and not repetition.comparison.missing_count
    assert not recording.damage and not repetition.tape.damage
    compared = later = 0
    for belief in then:
        assert isinstance(belief, Belief)
        again = dict(zip(now[belief.header.stamp_ns].layout, now[belief.header.stamp_ns].mean, strict=True))
        for label, value in zip(belief.layout, belief.mean, strict=True):
            if label.endswith((".x", ".y", ".z")) and not label.startswith("ceiling"):
                if label not in again:  # it joins later now: not through a robot that was itself observed only once
                    later += 1
                    continue
                compared += 1
                assert again[label] == pytest.approx(value, abs=0.15), label
    assert compared > 100 and later < 20, (compared, later)
    assert np.isfinite([value for belief in now.values() for value in belief.mean]).all()


def test_nothing_is_left_of_a_rerun_that_was_interrupted(
    flown: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> None:
        assert (tmp_path / "again" / "state.mcap").exists()
        raise KeyboardInterrupt

    monkeypatch.setattr("groundstation.replay.rerun_export._write_lived", interrupted)
    result = CliRunner().invoke(
        groundstation, ["replay", str(flown), "--recompute", "-o", str(tmp_path / "again")], standalone_mode=False
    )
    assert isinstance(result.exception, click.Abort | KeyboardInterrupt)
    assert not (tmp_path / "again").exists(), "half of it would be taken for a flight"
