"""Sensor delays measured from a flight with known delays: the study's cameras have exact time stamps."""

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from rewritten import rewritten, without

from groundstation.cli.main import groundstation
from groundstation.errors import SettingsError
from groundstation.field.resolved import ResolvedField
from groundstation.recording.chunks import RawRecord

SHIFT_MS = 40.0


def measured(folder: Path) -> dict[str, Any]:
    result = CliRunner().invoke(groundstation, ["calibrate", "delay", str(folder), "--json"], standalone_mode=False)
    assert result.exception is None, result.exception
    return {one["sensor"]: one for one in json.loads(result.stdout)}


@pytest.fixture(scope="module")
def tracked(tmp_path_factory: pytest.TempPathFactory, lab_field: ResolvedField) -> Path:
    """A recorded flight of tracking: drones that move little give slow information about delays."""
    from flown_study import FlownStudy

    from sim_bridge.study.runner import StudyOptions

    folder = tmp_path_factory.mktemp("flight")
    FlownStudy(lab_field, folder, StudyOptions(seed=4, duration_s=150.0)).fly()
    return folder


@pytest.mark.slow
@pytest.mark.exhaustive
@pytest.mark.timeout(3000)
def test_the_delays_of_cameras_are_found_and_a_wrong_setting_shows(tracked: Path, tmp_path: Path) -> None:
    def later(record: RawRecord) -> bytes:
        if record.key.topic.name != "observation":
            return record.data
        message = json.loads(record.data)
        if message["observer"] in ("ceiling", "drone_1"):
            message["header"]["stamp_ns"] += round(SHIFT_MS * 1e6)
        return json.dumps(message).encode()

    told = measured(rewritten(tracked, tmp_path / "wrong", later))
    for name, error_ms in (("ceiling", SHIFT_MS), ("drone_1 camera", SHIFT_MS), ("drone_2 camera", 0.0)):
        one = told[name]
        # Two minutes and a half give a delay to 9 ms (one deviation); a minute and a half does not on every processor,
        # whose last digits make another flight.
        assert one["sure"] and one["std_ms"] < 15.0, one
        assert abs(one["measured_ms"] - 120.0 - error_ms) < 2.5 * one["std_ms"], one
        assert abs(one["measured_ms"] - one["now_ms"]) > 20.0 or not error_ms, one
    # Delays that a recording does not determine must be marked so: no confident one may be far from the truth.
    for drone in ("drone_1", "drone_2"):
        for kind, truth_ms in (("velocity", 30.0), ("height", 85.0)):
            one = told[f"{drone} {kind}"]
            assert not one["sure"] or abs(one["measured_ms"] - truth_ms) < 3.0 * one["std_ms"] + 10.0, one


def test_a_recording_without_cameras_is_refused(flown: Path, tmp_path: Path) -> None:
    result = CliRunner().invoke(
        groundstation,
        ["calibrate", "delay", str(rewritten(flown, tmp_path / "blind", without("observation")))],
        standalone_mode=False,
    )
    assert "no observation of any camera" in str(result.exception)


def test_the_same_recording_gives_the_same_figures(flown: Path) -> None:
    assert measured(flown) == measured(flown)


def test_a_short_flight_is_told_to_be_too_short(flown: Path) -> None:
    result = CliRunner().invoke(groundstation, ["calibrate", "delay", str(flown)], standalone_mode=False)
    assert result.exception is None, result.exception
    assert "it saw too little" in result.output or "too unsure" in result.output


@pytest.mark.parametrize("text", ["- 1\n", "a: {", "", "schema_version: 1\nschema_version: 1\n"])
def test_a_field_file_that_cannot_be_changed_is_named_before_anything_is_computed(
    flown: Path, tmp_path: Path, text: str
) -> None:
    wrong = tmp_path / "lab.yaml"
    wrong.write_text(text, encoding="utf-8")
    arguments = ["calibrate", "team", str(flown), "--field", str(wrong), "-o", str(tmp_path / "new.yaml")]
    result = CliRunner().invoke(groundstation, arguments, standalone_mode=False)
    assert isinstance(result.exception, SettingsError) and "lab.yaml" in str(result.exception)
    assert "sightings" not in result.output
