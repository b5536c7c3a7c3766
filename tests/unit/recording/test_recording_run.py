"""A run in parts: nothing is lost between them, and any moment is read at once."""

import itertools
import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from groundstation.bus.topics import ESTIMATE, EVENT, IMAGE, IMU, PLAN
from groundstation.recording.cut import cut_run
from groundstation.recording.file_topics import LATCHED_TOPICS
from groundstation.recording.mcap_file import McapFile
from groundstation.recording.reader import RawRecord, RecordingError, open_recording, parts
from groundstation.recording.rotating_file import Rotation
from groundstation.recording.run import open_run
from groundstation.recording.synthetic import SyntheticRun, write_run
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.time_units import NS_PER_S

DURATION_S = 5.0


@pytest.fixture(scope="module")
def field() -> bytes:
    return load_field(find_field("lab"), ()).model_dump_json().encode()


@pytest.fixture(scope="module")
def run_dir(field: bytes, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    (folder / "run.json").write_text('{"mode": "demo", "scenario": "realistic", "seed": 7}')
    write_run(folder, field, DURATION_S, Rotation(age_ns=2 * NS_PER_S))
    return folder


def test_parts_follow_each_other_and_nothing_is_lost_between_them(run_dir: Path) -> None:
    names = [path.name for path in parts(run_dir, "state")]
    assert names == ["state.mcap", "state-2.mcap", "state-3.mcap"]
    sent = Counter(sample.key for _, sample in SyntheticRun().samples(0.0, DURATION_S))
    assert {str(key): count for key, count in open_run(run_dir).counts().items()} == sent


def test_parts_are_begun_by_size_too(field: bytes, tmp_path: Path) -> None:
    write_run(tmp_path, field, 3.0, Rotation(size_bytes=150_000))
    state = parts(tmp_path, "state")
    assert len(state) > 1
    assert all(path.stat().st_size < 300_000 for path in state)


def test_every_part_can_be_understood_alone(run_dir: Path) -> None:
    state = parts(run_dir, "state")
    assert len(state) > 1
    for number, path in enumerate(state, 1):
        opened = open_recording(path)
        assert opened.metadata["part"] == {"stem": "state", "number": str(number)}
        assert opened.metadata["seeds"] == {"scenario": "realistic", "seed": "7"}
        assert {"numpy", "mcap", "python"} <= set(opened.metadata["versions"])
        assert set(opened.metadata["run"]) >= {"clock", "unix_offset_ns", "message_version"}
        assert set(json.loads(opened.attachments["calibrations.json"])) == {
            "ceiling",
            "drone_1_camera",
            "drone_2_camera",
        }
        assert json.loads(opened.attachments["field.json"])["site"] == "lab"
        assert len(list(opened.records())) > 0 and opened.damage == []


def test_a_part_that_was_taken_away_does_not_hide_the_others(field: bytes, tmp_path: Path) -> None:
    write_run(tmp_path, field, 3.0, Rotation(age_ns=NS_PER_S))
    (tmp_path / "state.mcap").unlink()
    assert [path.name for path in parts(tmp_path, "state")] == ["state-2.mcap", "state-3.mcap"]
    assert open_run(tmp_path).counts()
    write_run(tmp_path, field, 0.5)
    assert [path.name for path in parts(tmp_path, "state")] == ["state-2.mcap", "state-3.mcap", "state-4.mcap"]


def test_where_no_next_part_can_be_begun_the_full_one_goes_on(
    field: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begin = McapFile._begin

    def refuse_second(file: McapFile, preamble: object) -> None:
        if "-2" in file.path.name:
            raise OSError(28, "No space left on device")
        begin(file, preamble)  # type: ignore[arg-type]

    monkeypatch.setattr(McapFile, "_begin", refuse_second)
    write_run(tmp_path, field, 3.0, Rotation(age_ns=NS_PER_S))
    assert [path.name for path in sorted(tmp_path.glob("*.mcap"))] == ["raw.mcap", "state.mcap"]
    assert sum(open_run(tmp_path).counts().values()) == sum(1 for _ in SyntheticRun().samples(0.0, 3.0))


def until(end_ns: int, records: Iterator[RawRecord]) -> Iterator[RawRecord]:
    return itertools.takewhile(lambda record: record.log_time_ns < end_ns, records)


def test_records_come_in_order_of_time_from_any_moment(run_dir: Path) -> None:
    run = open_run(run_dir)
    everything = list(run.records_from(run.start_ns))
    times = [record.log_time_ns for record in everything]
    assert times == sorted(times) and len(times) == sum(run.counts().values())
    middle = run.start_ns + round(2.37 * NS_PER_S)
    later = [record.log_time_ns for record in run.records_from(middle)]
    assert later == [time for time in times if time >= middle]
    some = list(until(middle + NS_PER_S, run.records_from(middle, lambda topic: topic is PLAN)))
    assert len(some) == 10 and {record.key.topic for record in some} == {PLAN}


@pytest.mark.parametrize("at_s", [0.0, 0.013, 1.99, 3.4, 99.0])
def test_latest_messages_before_a_time_are_the_last_of_each_key(run_dir: Path, at_s: float) -> None:
    run = open_run(run_dir)
    at_ns = run.start_ns + round(at_s * NS_PER_S)
    expected = {}
    for record in run.records_from(0):
        if record.log_time_ns < at_ns:
            expected[record.key] = record
    found = run.latest_before(at_ns)
    assert {key: record.log_time_ns for key, record in found.items()} == {
        key: record.log_time_ns for key, record in expected.items()
    }
    assert {key.topic for key in run.latest_before(at_ns, lambda topic: topic is IMAGE)} <= {IMAGE}


def test_a_rare_message_is_found_long_after_it_was_said(run_dir: Path) -> None:
    run = open_run(run_dir)
    (event,) = run.latest_before(run.end_ns, lambda topic: topic is EVENT).values()
    assert event.log_time_ns == run.start_ns


def test_a_stretch_is_a_run_of_its_own_with_what_was_known_when_it_begins(run_dir: Path, tmp_path: Path) -> None:
    written = cut_run(open_run(run_dir), run_dir, 1.5, 3.5, tmp_path / "stretch")
    assert [path.name for path in written] == ["state.mcap", "raw.mcap"]
    whole, stretch = open_run(run_dir), open_run(tmp_path / "stretch")
    assert stretch.damage == [] and stretch.duration_s == pytest.approx(2.0, abs=0.05)
    begin_ns = whole.start_ns + round(1.5 * NS_PER_S)
    latched = whole.latest_before(begin_ns, LATCHED_TOPICS.__contains__)
    first = {record.key: record for record in until(begin_ns + 1, stretch.records_from(0))}
    for key, record in latched.items():
        assert key in first
        assert record.data in {one.data for one in until(begin_ns + 1, stretch.records_from(0)) if one.key == key}
    count = sum(1 for _ in until(begin_ns + 2 * NS_PER_S, whole.records_from(begin_ns)))
    assert sum(stretch.counts().values()) == count + len(latched)
    assert stretch.attachments == whole.attachments
    assert stretch.metadata["cut"]["from_unix_ns"] == str(begin_ns)
    assert (tmp_path / "stretch" / "run.json").is_file()


@pytest.mark.parametrize(
    ("begin_s", "end_s", "reason"), [(3.0, 2.0, "not before"), (60.0, None, "not before"), (60.0, 70.0, "lasts 5.0 s")]
)
def test_a_stretch_of_nothing_is_refused(
    run_dir: Path, tmp_path: Path, begin_s: float, end_s: float | None, reason: str
) -> None:
    with pytest.raises(RecordingError, match=reason):
        cut_run(open_run(run_dir), run_dir, begin_s, end_s, tmp_path / "nothing")
    assert not (tmp_path / "nothing").exists()


def test_one_file_is_a_recording_too(run_dir: Path) -> None:
    run = open_run(run_dir / "state-2.mcap")
    assert {IMU, ESTIMATE} <= {key.topic for key in run.counts()}
    assert IMAGE not in {key.topic for key in run.counts()}


def test_a_folder_without_recording_is_named(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="is it a run folder"):
        open_run(tmp_path)


def test_a_part_that_never_got_its_first_byte_does_not_hide_the_others(run_dir: Path, tmp_path: Path) -> None:
    for path in run_dir.glob("state*.mcap"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "state-4.mcap").write_bytes(b"")
    run = open_run(tmp_path)
    assert sum(run.counts().values()) > 1000
    assert run.damage == ["state-4.mcap: not an MCAP recording (the file is empty)"]


def test_a_damaged_attachment_is_named_and_costs_nothing_else(run_dir: Path, tmp_path: Path) -> None:
    data = bytearray((run_dir / "state.mcap").read_bytes())
    data[data.index(b'"schema_version"') + 2] ^= 0xFF
    (tmp_path / "state.mcap").write_bytes(data)
    run = open_run(tmp_path)
    assert "field.json" not in run.attachments and "calibrations.json" in run.attachments
    (damage,) = run.damage
    assert "attachment" in damage and "wrong checksum" in damage
    assert sum(run.counts().values()) == sum(open_run(run_dir / "state.mcap").counts().values())
