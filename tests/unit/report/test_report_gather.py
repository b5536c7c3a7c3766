"""From the files of a run to measurements of its processes and links."""

import tracemalloc
from pathlib import Path

import pytest

from groundstation.bus import codec, keys
from groundstation.bus import messages as m
from groundstation.bus.api import Sample
from groundstation.bus.topics import ESTIMATE, ODOMETRY, PROCESS_STATUS, Topic
from groundstation.recording.copies import recover
from groundstation.recording.timeline import Timeline
from groundstation.recording.writing import RunWriter
from groundstation.report import run_facts
from groundstation.report.gather import gather
from groundstation.report.load import process_loads
from groundstation.report.run_facts import RunFacts
from groundstation.report.tracks import UNKNOWN_FIELD
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import yaml_of
from groundstation.time_units import NS_PER_S


class _Writer:
    def __init__(self, folder: Path) -> None:
        field = load_field(find_field("lab"), ()).model_dump_json().encode()
        self._run = RunWriter(folder, field, 1, Timeline("c", 0))

    def status(self, time_s: int, name: str, source: str, **said: float) -> None:
        header = m.Header((time_s + 1) * NS_PER_S, "c", name, source, time_s)
        told = {"pid": 7, "cpu": 0.0, "ticks": 0} | said
        self.write(PROCESS_STATUS, m.ProcessStatus(header=header, state=m.Lifecycle.READY, **told))  # type: ignore[arg-type]

    def write(self, topic: Topic, message: m.Message) -> None:
        head = message.header
        key = keys.expression("lab", topic, head.entity, head.source)
        self._run.write([Sample(key, codec.encode(message))], self._run.state, head.stamp_ns)

    def close(self) -> None:
        self._run.close()


def test_supervisor_reports_of_an_absent_process_are_no_restart(tmp_path: Path) -> None:
    writer = _Writer(tmp_path)
    for second in range(3):
        writer.status(second, "tracker", "supervisor", pid=0)
        writer.status(second, "router", "supervisor", pid=5, cpu=0.1)
    for second in range(3, 11):
        writer.status(second, "tracker", "tracker", cpu=0.5, ticks=50 * second)
        writer.status(second, "router", "supervisor", pid=5, cpu=0.1)
    writer.status(7, "tracker", "supervisor")
    writer.close()
    tracker, router = process_loads(gather(tmp_path))
    assert (tracker.name, tracker.restarts, tracker.ticks) == ("tracker", 0, 500)
    assert router.restarts == 0 and router.cores == pytest.approx(0.1)


def test_the_silence_of_a_vehicle_is_that_of_its_telemetry(tmp_path: Path) -> None:
    writer = _Writer(tmp_path)
    for second in (1, 2, 6, 7):
        header = m.Header(second * NS_PER_S, "c", "drone_1", "drone_1", second)
        still = (0.0, 0.0, 0.0)
        writer.write(ODOMETRY, m.Odometry(header=header, velocity_m_s=still, velocity_covariance=(0.01,) * 9,
                                          yaw_rad=0.0, roll_rad=0.0, pitch_rad=0.0, height_m=1.0))  # fmt: skip
    writer.status(0, "tracker", "tracker")
    writer.close()
    heard_s = gather(tmp_path).heard_s["drone_1"]
    assert heard_s.tolist() == [0.0, 1.0, 5.0, 6.0]


def test_a_recovered_recording_keeps_the_damage_of_its_original(tmp_path: Path) -> None:
    writer = _Writer(tmp_path)
    for second in range(60):
        writer.status(second, "tracker", "tracker")
    writer.close()
    original, copy, second_copy = tmp_path / "state.mcap", tmp_path / "copy", tmp_path / "second"
    original.write_bytes(original.read_bytes()[:-2000])
    for path, folder in ((original, copy), (copy / "state.mcap", second_copy)):
        folder.mkdir()
        recover(path, folder / "state.mcap")
        (damage,) = gather(folder).damage
        assert damage.startswith("state.mcap: recovered, before: cut off at byte "), damage
        assert gather(folder).breaks_off


def test_an_estimate_is_kept_as_plain_numbers(tmp_path: Path) -> None:
    """As a message it took 1.2 kB, and the report of an hour a gigabyte."""
    writer, count = _Writer(tmp_path), 2000
    for number in (*range(count - 1, 0, -1), 0):
        header = m.Header(NS_PER_S + number * 20_000_000, "c", "team", "tracker", number)
        figures = tuple(float(number + i) for i in range(16))
        entity = m.EntityEstimate("drone_1", "robot", figures[:4], figures, (0.1, 0.2, 0.3), True, 0.1)
        wrong = m.EntityEstimate("drone_1", "robot", figures[:2], figures[:4], (0.1, 0.2), True, 0.1)
        writer.write(ESTIMATE, m.Estimate(header=header, entities=(entity, wrong), epoch=1))
    writer.close()
    tracemalloc.start()
    track = gather(tmp_path).estimates["drone_1"]
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert track.mean[:, 0].tolist() == list(range(count)) and track.covariance[7].ravel().tolist() == [*range(7, 23)]
    assert peak < 1700 * count, "with the buffers of one file, and both entities of each message"


@pytest.mark.parametrize("rescued_by", ["nothing", "state-2.mcap", "resolved.yaml"])
def test_a_damaged_field_is_found_elsewhere(tmp_path: Path, rescued_by: str) -> None:
    writer = _Writer(tmp_path)
    writer.status(0, "tracker", "tracker")
    writer.close()
    path = tmp_path / "state.mcap"
    whole = path.read_bytes()
    flown = gather(tmp_path).resolved
    at = whole.index(b'"drone_1"')
    path.write_bytes(whole[:at] + b'"drone_7"' + whole[at + 9 :])
    if rescued_by == "state-2.mcap":
        (tmp_path / rescued_by).write_bytes(whole)
    elif rescued_by == "resolved.yaml":
        (tmp_path / rescued_by).write_text(yaml_of(load_field(find_field("lab"), ())))
    data = gather(tmp_path)
    assert data.resolved == (UNKNOWN_FIELD if rescued_by == "nothing" else flown)
    assert any("unreadable attachment" in damage for damage in data.damage)


@pytest.mark.parametrize(("clock", "command_s"), [("c", -9), ("other", 3600)])
def test_the_command_is_dated_by_the_clock_of_the_recording(tmp_path: Path, clock: str, command_s: int) -> None:
    """UNIX time was set by an hour between the command and the recorder's start."""
    writer = _Writer(tmp_path)
    writer.status(0, "tracker", "tracker")
    writer.close()
    told = RunFacts(command_unix_ns=3600 * NS_PER_S, command_ns=-9 * NS_PER_S, clock=clock)
    run_facts.write(tmp_path, told)
    assert gather(tmp_path).facts.command_unix_ns == command_s * NS_PER_S
