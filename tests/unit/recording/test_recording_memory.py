"""A recorder that runs for hours keeps little of each chunk, and its index is still complete."""

import sys
from pathlib import Path

from mcap.reader import make_reader

from groundstation.recording.packed_index import PackedIndex
from groundstation.recording.synthetic import CLOCK, UNIX_OFFSET_NS, SyntheticRun, turns, write_turn
from groundstation.recording.timeline import Timeline
from groundstation.recording.writing import RunWriter
from groundstation.settings.load import load_field

FIELD = load_field(Path(__file__).parents[2] / "fixtures/field/lab.yaml").model_dump_json().encode()


def write(folder, seconds):
    writer = RunWriter(folder, FIELD, 1, Timeline(CLOCK, UNIX_OFFSET_NS))
    for turn_ns, turn in turns(list(SyntheticRun(1).samples(0.0, seconds))):
        write_turn(writer, turn, turn_ns)
    return writer


def test_each_chunks_index_is_packed_at_once(tmp_path):
    writer = write(tmp_path, 3.0)
    kept = writer.state._file._writer._Writer__chunk_indices
    assert len(kept) > 15 and all(isinstance(index, PackedIndex) for index in kept)
    assert max(sys.getsizeof(index._record) for index in kept) < 600
    writer.close()


def test_the_summary_is_that_of_the_library(tmp_path, monkeypatch):
    (tmp_path / "packed").mkdir(), (tmp_path / "plain").mkdir()
    write(tmp_path / "packed", 2.0).close()
    monkeypatch.setattr("groundstation.recording.mcap_file.pack_indices", lambda writer: None)
    write(tmp_path / "plain", 2.0).close()
    summaries = []
    for kind in ("packed", "plain"):
        with (tmp_path / kind / "state.mcap").open("rb") as stream:
            summaries.append(make_reader(stream).get_summary())
    packed, plain = summaries
    assert packed and plain and packed.statistics and plain.statistics
    assert packed.chunk_indexes == plain.chunk_indexes != []
    assert packed.statistics.message_count == plain.statistics.message_count
