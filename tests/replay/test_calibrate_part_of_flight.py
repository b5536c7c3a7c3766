"""Calibration from recordings that are damaged, or of a tracker that was restarted after a flight."""

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from rewritten import rewritten

from groundstation.calibration.recorded_likelihood import flown_of
from groundstation.calibration.team_record import team_record
from groundstation.cli.main import groundstation
from groundstation.field.resolved import ResolvedField
from groundstation.recording.chunks import RawRecord
from groundstation.replay.source import open_source

_RESTART, _RESTART_NS = 60, 1_001_200_000_000


def _told(record: RawRecord) -> dict[str, Any]:
    return dict(json.loads(record.data))


def _restarted(record: RawRecord, lost: int = 0) -> bytes | None:
    """Restart the tracker at its tick 60; drone_1 flies before, and both stand after that. lost: ticks not recorded."""
    message = _told(record)
    if record.key.topic.name == "journal":
        if message["tick"] < lost:
            return None
        message["tick"] -= _RESTART if message["tick"] >= _RESTART > lost else 0
    elif record.key.topic.name == "vehicle_status":
        early, name = message["header"]["stamp_ns"] < _RESTART_NS, message["header"]["entity"]
        message["flight_state"] = "FLYING" if early and name == "drone_1" else "LANDED"
    return json.dumps(message).encode()


def test_drones_that_flew_before_a_restart_stand_on_no_pad(
    flown: Path, tmp_path: Path, lab_field: ResolvedField
) -> None:
    again = flown_of(open_source([rewritten(flown, tmp_path / "again", _restarted)]))
    assert again.off_pads == {"drone_1"}
    assert team_record(again, lab_field).stands.keys() == {"drone_2"}
    assert again.doubts == (
        "the tracker was restarted, or its journal has gaps: used is part 2 of 2, 340 of 400 ticks",
    )
    late = flown_of(
        open_source([rewritten(flown, tmp_path / "late", lambda record: _restarted(record, lost=_RESTART))])
    )
    assert late.off_pads == {"drone_1", "drone_2"} and not team_record(late, lab_field).stands
    assert late.doubts == ("the tracker's first 60 ticks are not recorded: where the drones stood is not known",)


@pytest.mark.parametrize("command", ["delay", "team"])
def test_damage_of_the_recording_is_told(flown: Path, tmp_path: Path, command: str) -> None:
    def lossy(record: RawRecord) -> bytes | None:
        return None if record.key.topic.name == "odometry" and _told(record)["header"]["seq"] % 50 == 7 else record.data

    whole = rewritten(flown, tmp_path / "run", lossy) / "state.mcap"
    whole.write_bytes(whole.read_bytes()[: whole.stat().st_size * 3 // 4])
    result = CliRunner().invoke(groundstation, ["calibrate", command, str(whole), "--json"], standalone_mode=False)
    assert result.exception is None, result.exception
    assert json.loads(result.stdout)
    assert "note: state.mcap: " in result.stderr
    assert "messages that the tracker took in are not recorded: " in result.stderr
