"""Recording: times, refusals, files that survive write errors, cut files."""

import errno
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from mcap.reader import make_reader

from groundstation.bus import messages as m
from groundstation.bus.api import Sample
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.topics import IMAGE, ODOMETRY, RAW_RX, TRUTH, VIDEO
from groundstation.recording.capture import Capture, Entry
from groundstation.recording.disk_space import Space, assess
from groundstation.recording.index import FileIndex
from groundstation.recording.mcap_file import McapFile
from groundstation.recording.preamble import Preamble
from groundstation.recording.reader import RecordingError, open_recording, parts, payload
from groundstation.recording.rotating_file import RETRY_PERIOD_NS, FileSeries
from groundstation.recording.timeline import Timeline

S = 1_000_000_000
UNIX = 1_700_000_000 * S
PREAMBLE = Preamble({"run": {"epoch": "7"}}, {"field.json": ("application/json", b"{}")}, UNIX)


def _header(seq: int = 0, stamp_ns: int = S, clock: str = "here", entity: str = "drone_1") -> m.Header:
    return m.Header(stamp_ns, clock, entity, "tester", seq)


def _truth(seq: int) -> m.TruthState:
    return m.TruthState(
        header=_header(seq, S + seq * 20_000_000),
        position_m=(float(seq), 0.0, 1.0),
        velocity_m_s=(0.0, 0.0, 0.0),
        attitude_rad=(0.0, 0.0, 0.0),
        on_ground=False,
    )


def _samples(count: int) -> list[Sample]:
    exchange = MemoryExchange()
    bus = MemoryBus(exchange, "lab", "tester")
    queue = bus.subscribe([TRUTH, IMAGE, RAW_RX])
    for seq in range(count):
        bus.publish(TRUTH, _truth(seq))
    return queue.drain_samples()


def _entries(count: int) -> Iterator[Entry]:
    capture = Capture(Timeline("here", UNIX))
    for sample in _samples(count):
        entry = capture.entry(sample, S)
        assert entry is not None
        yield entry


def _write(path: Path, count: int, flush_every: int = 50) -> None:
    file = McapFile(path, PREAMBLE)
    for index, entry in enumerate(_entries(count)):
        file.write(entry)
        if index % flush_every == flush_every - 1:
            file.flush()
    file.close()


def test_log_time_is_the_measurement_in_unix_time() -> None:
    timeline = Timeline("here", UNIX)
    assert timeline.times(5 * S, "here", 6 * S) == (UNIX + 5 * S, UNIX + 5 * S)


def test_stamp_of_unknown_clock_is_logged_at_arrival_until_its_offset_is_known() -> None:
    timeline = Timeline("here", UNIX)
    assert timeline.times(900 * S, "there", 6 * S) == (UNIX + 6 * S, UNIX + 6 * S)
    timeline.learn(m.ClockOffset(header=_header(clock="here"), of="there", offset_ns=-895 * S))
    assert timeline.times(900 * S, "there", 6 * S) == (UNIX + 5 * S, UNIX + 5 * S)


def test_implausible_stamp_does_not_stretch_the_time_axis() -> None:
    logged, published = Timeline("here", UNIX).times(10_000 * S, "here", 6 * S)
    assert (logged, published) == (UNIX + 6 * S, UNIX + 10_000 * S)


def test_no_stamp_leaves_the_63_bits_of_a_table() -> None:
    timeline = Timeline("here", UNIX)
    timeline.learn(m.ClockOffset(header=_header(clock="here"), of="there", offset_ns=(1 << 63) - 1))
    for stamp_ns in ((1 << 63) - 1, -(1 << 63)):
        for clock in ("here", "there"):
            assert all(0 <= time_ns < 1 << 63 for time_ns in timeline.times(stamp_ns, clock, S))


def test_capture_keeps_payload_bytes_as_they_came() -> None:
    (sample,) = _samples(1)
    entry = Capture(Timeline("here", UNIX)).entry(sample, S)
    assert entry is not None
    assert entry.data is sample.payload
    assert entry.channel == "gs/@v1/lab/@truth/drone_1/state/tester"


@pytest.mark.parametrize(
    ("sample", "reason"),
    [
        (Sample("gs/@v1/lab/drone_1/odometry/tester", b"{"), "malformed"),
        (Sample("gs/@v1/lab/drone_1/odometry/tester", b'{"header":[1]}'), "malformed"),
        (Sample("gs/@v1/lab/drone_1/image/tester", b"jpeg"), "malformed"),
        (Sample("gs/@v1/lab/drone_1/nonsense/tester", b"{}"), "unknown_topic"),
        (Sample("gs/@v1/lab/*/odometry/tester", b"{}"), "wildcard_key"),
    ],
)
def test_capture_counts_what_no_reader_could_use(sample: Sample, reason: str) -> None:
    capture = Capture(Timeline("here", UNIX))
    assert capture.entry(sample, S) is None
    assert capture.refused == {reason: 1}


def test_capture_refuses_a_header_that_contradicts_its_key() -> None:
    (sample,) = _samples(1)
    capture = Capture(Timeline("here", UNIX))
    assert capture.entry(Sample(sample.key.replace("drone_1", "drone_2"), sample.payload), S) is None
    assert capture.refused == {"header_mismatch": 1}


def test_pictures_and_datagrams_come_back_to_the_byte(tmp_path: Path) -> None:
    exchange = MemoryExchange()
    bus = MemoryBus(exchange, "lab", "tester")
    queue = bus.subscribe([IMAGE, VIDEO, RAW_RX])
    bus.publish_bytes(IMAGE, _header(3), bytes(range(256)))
    bus.publish_bytes(VIDEO, _header(5), b"\0\0\0\1gE")
    bus.publish_bytes(RAW_RX, _header(4), b"\x88\x77\x66\x55")
    capture, file = Capture(Timeline("here", UNIX)), McapFile(tmp_path / "raw.mcap", PREAMBLE)
    for sample in queue.drain_samples():
        entry = capture.entry(sample, S)
        assert entry is not None
        file.write(entry)
    file.close()
    found = {raw.key.topic: payload(raw) for raw in open_recording(tmp_path / "raw.mcap").raw_records()}
    assert {topic: data for topic, (_, data) in found.items()} == {
        IMAGE: bytes(range(256)),
        VIDEO: b"\0\0\0\1gE",
        RAW_RX: b"\x88\x77\x66\x55",
    }
    assert [header.seq for header, _ in found.values()] == [3, 5, 4]


def test_the_ordinary_mcap_reader_opens_it(tmp_path: Path) -> None:
    _write(tmp_path / "state.mcap", 120)
    with (tmp_path / "state.mcap").open("rb") as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert summary is not None
        (channel,) = summary.channels.values()
        assert channel.topic == "gs/@v1/lab/@truth/drone_1/state/tester"
        assert channel.metadata["plane"] == "@truth"
        assert [schema.name for schema in summary.schemas.values()] == ["skein.TruthState"]
        assert sum(1 for _ in reader.iter_messages()) == 120
        assert [attachment.name for attachment in reader.iter_attachments()] == ["field.json"]


def test_reader_returns_messages_attachments_and_metadata(tmp_path: Path) -> None:
    _write(tmp_path / "state.mcap", 60)
    recording = open_recording(tmp_path / "state.mcap")
    records = list(recording.records())
    assert [record.message for record in records] == [_truth(seq) for seq in range(60)]
    assert records[0].log_time_ns == UNIX + S
    assert recording.attachments == {"field.json": b"{}"}
    assert recording.metadata == {"run": {"epoch": "7"}}
    assert recording.damage == []


def test_reader_passes_over_unwanted_topics(tmp_path: Path) -> None:
    _write(tmp_path / "state.mcap", 10)
    assert list(open_recording(tmp_path / "state.mcap").records(lambda topic: topic is ODOMETRY)) == []


def test_cut_anywhere_a_recording_yields_a_prefix(tmp_path: Path) -> None:
    whole, cut = tmp_path / "state.mcap", tmp_path / "cut.mcap"
    _write(whole, 200, flush_every=20)
    data, expected, counts = whole.read_bytes(), [_truth(seq) for seq in range(200)], []
    for size in range(8, len(data), 37):
        cut.write_bytes(data[:size])
        recording = open_recording(cut)
        read = [record.message for record in recording.records()]
        assert read == expected[: len(read)]
        assert recording.damage
        counts.append(len(read))
    assert counts == sorted(counts)
    assert counts[-1] == 200


@pytest.mark.parametrize(("place", "bits"), [(40, 0xFF), (-1, 0x80), (4, 0x80)])  # content, lengths of chunk and frame
def test_a_damaged_chunk_costs_its_own_messages_only(tmp_path: Path, place: int, bits: int) -> None:
    path = tmp_path / "state.mcap"
    _write(path, 100, flush_every=20)
    data = bytearray(path.read_bytes())
    second = data.index(b"\x28\xb5\x2f\xfd", data.index(b"\x28\xb5\x2f\xfd") + 4)  # magic of the second zstd frame
    data[second + place] ^= bits
    path.write_bytes(data)
    recording = open_recording(path)
    read = [record.message.header.seq for record in recording.records()]
    assert read == [seq for seq in range(100) if not 20 <= seq < 40]
    assert all("damaged chunk" in str(noted) for noted in (recording.damage, FileIndex(path).checked_damage()))


@pytest.mark.parametrize("content", [b"", b"\x89MCAP", b"not a recording at all"])
def test_files_that_are_no_recording_are_refused_by_name(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=r"x\.mcap: not an MCAP"):
        open_recording(path)
    with pytest.raises(RecordingError, match="No such file"):
        open_recording(tmp_path / "absent.mcap")


class _FullDisk:
    """Opens files whose writes fail while `full`."""

    def __init__(self) -> None:
        self.full = False

    def __call__(self, path: Path, preamble: Preamble) -> McapFile:
        disk = self

        class Failing(McapFile):
            def write(self, entry: Entry) -> None:
                if disk.full:
                    raise OSError(errno.ENOSPC, "No space left on device")
                super().write(entry)

        return Failing(path, preamble)


def test_series_goes_on_in_a_new_file_after_a_write_error(tmp_path: Path) -> None:
    disk = _FullDisk()
    series = FileSeries(tmp_path, "state", PREAMBLE, opener=disk)
    entries = list(_entries(40))
    for entry in entries[:10]:
        series.write(entry, 0)
    series.tick(S)
    disk.full = True
    for entry in entries[10:20]:
        series.write(entry, S)
    (trouble,) = series.take_troubles()
    assert "No space left" in trouble.text and not trouble.recovered and series.failing
    series.tick(2 * S)
    assert series.take_troubles() == []
    disk.full = False
    series.tick(S + RETRY_PERIOD_NS)
    (back,) = series.take_troubles()
    assert back.recovered and "state-2.mcap" in back.text and "removed" not in back.text
    for entry in entries[20:]:
        series.write(entry, 4 * S)
    series.close()
    assert [path.name for path in parts(tmp_path, "state")] == ["state.mcap", "state-2.mcap"]
    first, second = (list(open_recording(path).records()) for path in parts(tmp_path, "state"))
    assert (len(first), len(second)) == (10, 20)
    assert (series.written, series.lost) == (30, 10)


def test_series_begins_no_file_without_room_and_leaves_no_fragments(tmp_path: Path) -> None:
    series = FileSeries(tmp_path, "state", PREAMBLE, has_room=lambda: False)
    for entry in _entries(5):
        series.write(entry, 0)
    assert series.lost == 5
    assert len(series.take_troubles()) == 1
    assert list(tmp_path.iterdir()) == []


def test_a_recording_goes_on_after_its_folder_was_removed(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    series = FileSeries(folder, "state", PREAMBLE)
    entries = list(_entries(20))
    for entry in entries[:10]:
        series.write(entry, 0)
    shutil.rmtree(folder)
    series.tick(S)
    (trouble,) = series.take_troubles()
    assert trouble.text == "cannot write the state recording: the file was removed"
    series.tick(S + RETRY_PERIOD_NS)
    (back,) = series.take_troubles()
    assert back.text.endswith("messages are lost, and all that was in the file that was removed")
    for entry in entries[10:]:
        series.write(entry, 4 * S)
    series.close()
    (part,) = parts(folder, "state")
    assert len(list(open_recording(part).records())) == 10
    assert (series.written, series.lost) == (10, 10)


def test_a_restarted_recorder_does_not_overwrite(tmp_path: Path) -> None:
    for _ in range(2):
        series = FileSeries(tmp_path, "state", PREAMBLE)
        for entry in _entries(3):
            series.write(entry, 0)
        series.close()
    assert [path.name for path in parts(tmp_path, "state")] == ["state.mcap", "state-2.mcap"]


def test_two_recorders_that_begin_a_part_at_once_overwrite_nothing(tmp_path: Path) -> None:
    def late(path: Path, preamble: Preamble) -> McapFile:
        if path.name == "state.mcap":
            path.write_text("the other's, begun after this one looked")
        return McapFile(path, preamble)

    series = FileSeries(tmp_path, "state", PREAMBLE, opener=late)
    series.tick(0)
    series.close()
    assert (tmp_path / "state.mcap").read_text().startswith("the other's")
    assert open_recording(tmp_path / "state-2.mcap").metadata["part"]["number"] == "2"


def test_space_levels_have_hysteresis() -> None:
    assert assess(5_000_000_000) is Space.AMPLE
    assert assess(900_000_000) is Space.LOW
    assert assess(1_050_000_000, Space.LOW) is Space.LOW
    assert assess(1_050_000_000, Space.AMPLE) is Space.AMPLE
    assert assess(150_000_000) is Space.NO_IMAGES
    assert assess(1_000_000) is Space.FULL
