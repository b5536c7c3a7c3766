"""`groundstation recording`: output for whole, cut, foreign and missing recordings."""

import csv
import json
import os
import resource
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from mcap.reader import make_reader
from mcap.writer import Writer

from groundstation.bus import codec, keys
from groundstation.bus import messages as m
from groundstation.bus.api import Sample
from groundstation.bus.topics import ESTIMATE, PROCESS_STATUS
from groundstation.cli.exits import ExitCode, exit_code_of
from groundstation.cli.main import groundstation
from groundstation.cli.verbs import VERBS
from groundstation.recording import compatibility
from groundstation.recording.capture import Entry
from groundstation.recording.mcap_file import McapFile
from groundstation.recording.preamble import Preamble
from groundstation.recording.reader import decode, open_recording
from groundstation.recording.run import open_run
from groundstation.recording.schemas import description_of
from groundstation.recording.synthetic import write_run
from groundstation.recording.timeline import Timeline
from groundstation.recording.writing import RunWriter
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field

DURATION_S = 3.0
REPOSITORY = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole")
    write_run(folder, load_field(find_field("lab"), ()).model_dump_json().encode(), DURATION_S)
    return folder


@pytest.fixture
def run_dir(whole: Path, tmp_path: Path) -> Path:
    """Return a run whose state file was cut off as by kill -9."""
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "raw.mcap").write_bytes((whole / "raw.mcap").read_bytes())
    data = (whole / "state.mcap").read_bytes()
    (folder / "state.mcap").write_bytes(data[: len(data) * 2 // 3])
    return folder


def _run(*arguments: object) -> Result:
    return CliRunner().invoke(groundstation, [str(one) for one in ("recording", *arguments)], standalone_mode=False)


def _refusal(*arguments: object) -> tuple[ExitCode, str]:
    error = _run(*arguments).exception
    assert isinstance(error, Exception)
    return exit_code_of(error), str(error)


def test_info_names_parts_topics_rates_versions_and_damage(run_dir: Path) -> None:
    shown = _run("info", run_dir).output
    assert "cut off at byte" in shown and "groundstation recording recover" in shown
    assert "skein-groundstation" in shown and "field.json" in shown
    found = json.loads(_run("info", run_dir, "--json").output)
    assert not found["whole"]
    estimate = next(one for one in found["channels"] if "/estimate/" in one["channel"])
    assert estimate["rate_hz"] == pytest.approx(50.0, abs=0.5)
    assert estimate["schema"] == "skein.Estimate"
    assert [Path(part["path"]).name for part in found["parts"]] == ["state.mcap", "raw.mcap"]


def test_info_of_a_whole_run_finds_nothing_wrong(whole: Path) -> None:
    found = json.loads(_run("info", whole, "--json").output)
    assert found["whole"] and found["holes"] == [] and found["missing_parts"] == [] and found["changed_messages"] == []


def test_info_names_holes_and_missing_parts(whole: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "a", tmp_path / "b"
    assert _run("cut", whole, "--to", 0.8, "--output", first).exit_code == 0
    assert _run("cut", whole, "--from", 2.2, "--output", second).exit_code == 0
    (second / "state.mcap").rename(first / "state-2.mcap")
    found = json.loads(_run("info", first, "--json").output)
    odometry = next(hole for hole in found["holes"] if "drone_1/odometry" in hole["channel"])
    assert (odometry["from_s"], odometry["to_s"]) == pytest.approx((0.8, 2.2), abs=0.05)
    (first / "state-2.mcap").rename(first / "state-3.mcap")
    assert json.loads(_run("info", first, "--json").output)["missing_parts"] == ["state-2.mcap"]


def test_info_calls_it_no_hole_that_the_supervisor_speaks_for_a_process_now_and_then(tmp_path: Path) -> None:
    rare, often = [0.0, 0.5, 1.0, 40.0, 40.5, 41.0], [float(second) for second in (*range(20), *range(30, 41))]
    field = load_field(find_field("lab"), ()).model_dump_json().encode()
    writer = RunWriter(tmp_path, field, 1, Timeline("c", 0))
    for source, times in (("supervisor", rare), ("tracker", often)):
        for number, time_s in enumerate(times):
            header = m.Header(round(time_s * 1e9) + 1, "c", "tracker", source, number)
            status = m.ProcessStatus(header=header, state=m.Lifecycle.READY, pid=1, cpu=0.0, ticks=0)
            key = keys.expression("lab", PROCESS_STATUS, "tracker", source)
            writer.write([Sample(key, codec.encode(status))], writer.state, header.stamp_ns)
    writer.close()
    (hole,) = json.loads(_run("info", tmp_path, "--json").output)["holes"]
    assert hole["channel"].endswith("/tracker") and (hole["from_s"], hole["to_s"]) == (19.0, 30.0)


def test_recover_makes_a_file_for_other_programs_and_keeps_the_original(run_dir: Path) -> None:
    before = (run_dir / "state.mcap").read_bytes()
    result = _run("recover", run_dir)
    recovered = run_dir / "state-recovered.mcap"
    assert f"{recovered}" in result.output and "cut off" in result.output
    assert (run_dir / "state.mcap").read_bytes() == before
    with recovered.open("rb") as stream:
        read = sum(1 for _ in make_reader(stream).iter_messages())
    run = open_run(run_dir / "state.mcap")
    assert read >= sum(run.counts().values()) > 500
    assert open_recording(recovered).attachments == open_recording(run_dir / "state.mcap").attachments
    assert _refusal("recover", run_dir) == (
        ExitCode.SETTINGS,
        f"{recovered}: exists already; name another place with --output",
    )


def test_recover_leaves_whole_recordings_alone(whole: Path) -> None:
    files = sorted(path.name for path in whole.iterdir())
    assert "nothing is damaged" in _run("recover", whole).output
    assert sorted(path.name for path in whole.iterdir()) == files


def test_recover_finds_a_damaged_chunk_in_a_file_that_ends_well(whole: Path, tmp_path: Path) -> None:
    index = open_run(whole / "state.mcap").indexes[0]
    data = bytearray((whole / "state.mcap").read_bytes())
    chunk = index.chunks[len(index.chunks) // 2]
    data[chunk.offset + chunk.length - 100] ^= 0xFF
    (tmp_path / "state.mcap").write_bytes(data)
    result = _run("recover", tmp_path)
    recovered = tmp_path / "state-recovered.mcap"
    assert f"{recovered}: " in result.output and "damaged chunk" in result.output
    assert json.loads(_run("info", recovered, "--json").output)["whole"]


def test_recover_names_a_part_of_which_nothing_is_left(whole: Path, tmp_path: Path) -> None:
    (tmp_path / "raw.mcap").write_bytes((whole / "raw.mcap").read_bytes())
    (tmp_path / "state.mcap").touch()
    result = _run("recover", tmp_path)
    assert "nothing is damaged" not in result.output
    assert "state.mcap: nothing can be recovered" in result.stderr and result.return_value == ExitCode.SETTINGS


def test_cut_takes_a_stretch_of_a_cut_off_run(run_dir: Path) -> None:
    result = _run("cut", run_dir, "--from", 0.5, "--to", 1.0)
    folder = run_dir.parent / "run-0.5s-1s"
    assert f"{folder / 'state.mcap'}" in result.output
    assert open_run(folder).duration_s == pytest.approx(0.5, abs=0.05)
    assert "cut off at byte" in result.stderr


@pytest.mark.parametrize("here", [".", "log/.."])
def test_a_stretch_of_the_folder_one_stands_in_lies_beside_it(
    run_dir: Path, here: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    (run_dir / "log").mkdir()
    monkeypatch.chdir(run_dir)
    assert _run("cut", here, "--from", 0.5, "--to", 1.0).exit_code == 0
    assert open_run(run_dir.parent / "run-0.5s-1s").duration_s == pytest.approx(0.5, abs=0.05)


def test_csv_tables_say_what_the_messages_said(whole: Path, tmp_path: Path) -> None:
    result = _run("export", "--csv", whole, "--output", tmp_path / "tables")
    assert f"{tmp_path / 'tables' / 'odometry.csv'}" in result.output
    with (tmp_path / "tables" / "estimate.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    run = open_run(whole)
    raw = next(run.records_from(run.start_ns, lambda topic: topic is ESTIMATE))
    entity = decode(raw).message.entities[0]  # type: ignore[attr-defined]
    assert rows[0]["name"] == entity.name
    named = [float(rows[0][name]) for name in ("x_m", "y_m", "z_m", "yaw_rad", "covariance_x_x_m2", "velocity_y_m_s")]
    assert named == [*entity.mean, entity.covariance[0], entity.velocity_m_s[1]]
    assert float(rows[-1]["time_s"]) == pytest.approx(DURATION_S, abs=0.05)
    with (tmp_path / "tables" / "columns.csv").open(newline="") as stream:
        units = {(row["file"], row["column"]): row["unit"] for row in csv.DictReader(stream)}
    assert units["odometry.csv", "velocity_x_m_s"] == "m/s"
    assert units["plan.csv", "cost"] == "m^2"
    assert units["estimate.csv", "covariance_yaw_yaw_rad2"] == "rad^2"


def test_a_cut_recording_is_exported_as_far_as_it_goes_and_says_so(run_dir: Path) -> None:
    result = CliRunner().invoke(groundstation, ["export", "--csv", str(run_dir)], standalone_mode=False)
    assert "cut off at byte" in result.stderr
    assert (run_dir / "csv" / "estimate.csv").stat().st_size > 1000


def test_export_is_one_command_under_two_names() -> None:
    from groundstation.cli.export import export
    from groundstation.cli.recording import recording

    assert recording.get_command(None, "export") is export  # type: ignore[arg-type]
    assert VERBS["export"].target == "groundstation.cli.export:export"


def _foreign(path: Path) -> None:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="rosbag2")
        writer.finish()


@pytest.mark.parametrize("command", [("info",), ("recover",), ("cut",), ("export", "--csv")])
def test_unreadable_files_are_refused_by_name(command: tuple[str, ...], tmp_path: Path) -> None:
    cases = {
        "empty.mcap": (b"", "not an MCAP recording (the file is empty)"),
        "text.mcap": (b"time,x,y\n" * 9, "not an MCAP recording"),
    }
    for name, (content, reason) in cases.items():
        (tmp_path / name).write_bytes(content)
        assert _refusal(*command, tmp_path / name) == (ExitCode.SETTINGS, f"{tmp_path / name}: {reason}")
    _foreign(tmp_path / "foreign.mcap")
    code, text = _refusal(*command, tmp_path / "foreign.mcap")
    assert code is ExitCode.SETTINGS and "another program (profile 'ros2' by rosbag2)" in text
    (tmp_path / "folder").mkdir()
    code, text = _refusal(*command, tmp_path / "folder")
    assert code is ExitCode.SETTINGS and "is it a run folder" in text
    code, text = _refusal(*command, tmp_path / "absent")
    assert code is ExitCode.SETTINGS
    os.mkfifo(tmp_path / "pipe")  # without a writer
    assert _refusal(*command, tmp_path / "pipe") == (ExitCode.SETTINGS, f"{tmp_path / 'pipe'}: is a pipe, not a file")
    there = ["empty.mcap", "folder", "foreign.mcap", "pipe", "text.mcap"]
    assert sorted(path.name for path in tmp_path.iterdir()) == there


def test_a_file_that_may_not_be_read_is_named(run_dir: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_path: Path, *_arguments: object, **_options: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    assert _refusal("info", run_dir) == (ExitCode.SETTINGS, f"{run_dir / 'state.mcap'}: Permission denied")


def test_info_names_messages_that_were_others_when_they_were_recorded(tmp_path: Path) -> None:
    described = description_of(ESTIMATE)
    schema = json.loads(described.schema)
    del schema["properties"]["epoch"]
    schema["properties"]["era"] = {"type": "integer"}
    then = replace(described, schema=json.dumps(schema).encode())
    file = McapFile(tmp_path / "state.mcap", Preamble({}, {}, 0))
    file.write(Entry("gs/@v1/lab/team/estimate/tracker", 1, 1, 0, b"{}", then, {}))
    file.close()
    found = json.loads(_run("info", tmp_path, "--json").output)
    assert found["changed_messages"] == ["skein.Estimate: then era; now epoch"]
    assert "skein.Estimate: then era; now epoch" in _run("info", tmp_path).output


def test_messages_of_another_version_are_refused_with_the_remedy(tmp_path: Path) -> None:
    metadata = {"run": {compatibility.VERSION_FIELD: "9"}, "versions": {"skein-groundstation": "4.2.0"}}
    McapFile(tmp_path / "state.mcap", Preamble(metadata, {}, 0)).close()
    code, text = _refusal("info", tmp_path)
    assert code is ExitCode.SETTINGS
    assert "message version 9 by skein-groundstation 4.2.0" in text and "Install skein-groundstation 4.2.0" in text


def test_output_that_exists_is_never_touched(whole: Path, tmp_path: Path) -> None:
    taken = tmp_path / "taken"
    taken.write_text("mine")
    for command in (("cut",), ("export", "--csv")):
        code, text = _refusal(*command, whole, "--output", taken)
        assert code is ExitCode.SETTINGS and "exists already" in text
    assert taken.read_text() == "mine"


@pytest.mark.parametrize("command", [("cut", "--output", "out"), ("export", "--csv", "--output", "out")])
def test_a_full_disk_is_named_and_nothing_is_left_behind(command: tuple[str, ...], whole: Path, tmp_path: Path) -> None:
    def little_room() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))

    result = subprocess.run(
        [sys.executable, "-m", "groundstation", "recording", command[0], str(whole), *command[1:]],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(REPOSITORY), "PYTHONDONTWRITEBYTECODE": "1"},
        preexec_fn=little_room,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert result.returncode == ExitCode.FAULT
    assert "out" in result.stderr and "make room" in result.stderr and "Traceback" not in result.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_missing_extra_names_its_command(whole: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from groundstation.engineering_views import extras

    monkeypatch.setattr(extras, "find_spec", lambda _name: None)
    for arguments, extra in (
        (("recording", "export", "--parquet", whole), "parquet"),
        (("recording", "export", "--rrd", whole), "rerun"),
        (("recording", "export", "--foxglove-scene", whole), "foxglove"),
        (("view", "--rerun"), "rerun"),
        (("view", "--foxglove"), "foxglove"),
    ):
        result = CliRunner().invoke(groundstation, [str(one) for one in arguments], standalone_mode=False)
        assert f'pip install "skein-groundstation[{extra}]"' in str(result.exception)
        assert exit_code_of(result.exception) is ExitCode.SETTINGS  # type: ignore[arg-type]


def test_messages_that_came_together_have_no_rate(tmp_path: Path) -> None:
    write_run(tmp_path, load_field(find_field("lab"), ()).model_dump_json().encode(), 0.5)
    channels = json.loads(_run("info", tmp_path, "--json").output)["channels"]
    assert max(channel["messages"] for channel in channels) > 20
    assert {channel["rate_hz"] for channel in channels} == {0.0}
    rows = [line.split() for line in _run("info", tmp_path).output.splitlines() if "/estimate/" in line]
    assert rows and all(row[2] == "-" for row in rows)
