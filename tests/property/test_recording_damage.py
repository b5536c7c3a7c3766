"""A cut or damaged recording is read up to the damage, or refused by name; never a traceback."""

import shutil
import struct
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from groundstation.errors import OperatorMistake
from groundstation.recording.copies import recover
from groundstation.recording.cut import cut_run
from groundstation.recording.info import info_of
from groundstation.recording.run import open_run
from groundstation.recording.synthetic import write_run
from groundstation.recording.table_files import CsvFile, write_tables
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field

_SETTINGS = settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    folder = tmp_path_factory.mktemp("whole")
    write_run(folder, load_field(find_field("lab"), ()).model_dump_json().encode(), 1.3)
    return (folder / "state.mcap").read_bytes()


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    yield tmp_path


def _read_everything(path: Path) -> int:
    """Use every command on a damaged file; returns the number of messages read, -1 for a refusal by name."""
    folder = path.parent
    for made in ("csv", "cut.mcap", "recovered.mcap"):
        shutil.rmtree(folder / made, ignore_errors=True)
        (folder / made).unlink(missing_ok=True)
    try:
        run = open_run(path)
    except OperatorMistake as error:
        assert str(path) in str(error)
        return -1
    found = info_of(run)
    read = list(run.records_from(run.start_ns))
    times = [record.log_time_ns for record in read]
    assert times == sorted(times) or any("wrong times" in text for text in run.damage)
    run.latest_before((run.start_ns + run.end_ns) // 2)
    write_tables(run, folder / "csv", CsvFile)
    try:
        recover(path, folder / "recovered.mcap")
        with (folder / "recovered.mcap").open("rb") as stream:
            assert sum(1 for _ in make_reader(stream).iter_messages()) >= len(read)
        cut_run(open_run(path), path, 0.0, None, folder / "cut.mcap")
    except OperatorMistake as error:
        assert str(path) in str(error) or "not before" in str(error)
    assert sum(part.messages for part in found.parts) >= len(read)
    return len(read)


@_SETTINGS
@given(st.floats(0.0, 1.0))
def test_cut_anywhere(whole: bytes, folder: Path, share: float) -> None:
    path = folder / "state.mcap"
    path.write_bytes(whole[: round(share * len(whole))])
    _read_everything(path)


@_SETTINGS
@given(st.lists(st.tuples(st.floats(0.0, 0.999), st.integers(1, 255)), min_size=1, max_size=6))
def test_flipped_bytes_anywhere(whole: bytes, folder: Path, flips: list[tuple[float, int]]) -> None:
    data = bytearray(whole)
    for share, mask in flips:
        data[int(share * len(data))] ^= mask
    path = folder / "state.mcap"
    path.write_bytes(data)
    _read_everything(path)


@_SETTINGS
@given(st.floats(0.0, 0.999), st.binary(min_size=1, max_size=64))
def test_garbage_after_a_cut(whole: bytes, folder: Path, share: float, garbage: bytes) -> None:
    path = folder / "state.mcap"
    path.write_bytes(whole[: round(share * len(whole))] + garbage)
    _read_everything(path)


def test_a_shorter_cut_never_holds_more_messages_than_a_longer_one(whole: bytes, folder: Path) -> None:
    path, counts = folder / "state.mcap", []
    for size in range(len(whole) // 8, len(whole) + 1, len(whole) // 8):
        path.write_bytes(whole[:size])
        counts.append(sum(open_run(path).counts().values()))
    assert counts == sorted(counts) and counts[-1] > 1000


def test_a_flipped_length_costs_its_chunk_and_not_the_flight(whole: bytes, folder: Path) -> None:
    path = folder / "state.mcap"
    path.write_bytes(whole)
    run = open_run(path)
    total, chunks = sum(run.counts().values()), run.indexes[0].chunks
    assert len(chunks) > 4
    lost = chunks[2]
    for bit in (3, 61):  # slightly too long, and longer than any disk
        data = bytearray(whole)
        data[lost.offset + 1 + bit // 8] ^= 1 << bit % 8
        path.write_bytes(data)
        assert sum(open_run(path).counts().values()) >= total - 2 * sum(lost.counts.values())
        assert _read_everything(path) > total / 2
    assert any(f"unreadable from byte {lost.offset} to " in text for text in open_run(path).damage)


def test_a_length_that_promises_too_much_is_damage_not_memory(whole: bytes, folder: Path) -> None:
    path = folder / "state.mcap"
    path.write_bytes(whole[: len(whole) // 2] + struct.pack("<BQ", 6, 1 << 62) + whole[len(whole) // 2 :])
    assert _read_everything(path) > 0
