"""What a replay needs of a recording: its field and the notes on its run, from any part."""

from pathlib import Path

import pytest

from groundstation.bus import codec, keys
from groundstation.bus import messages as m
from groundstation.bus.api import Sample
from groundstation.bus.topics import EVENT
from groundstation.recording.reader import RecordingError
from groundstation.recording.timeline import Timeline
from groundstation.recording.writing import RunWriter
from groundstation.replay.source import open_source
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.time_units import NS_PER_S


def test_a_damaged_field_is_taken_from_another_part_or_named(tmp_path: Path) -> None:
    field = load_field(find_field("lab"), ()).model_dump_json().encode()
    writer = RunWriter(tmp_path, field, 1, Timeline("c", 0))
    said = m.Event(header=m.Header(NS_PER_S, "c", "team", "tracker", 1), severity=m.Severity.INFO, text="begun")
    key = keys.expression("lab", EVENT, "team", "tracker")
    writer.write([Sample(key, codec.encode(said))], writer.state, NS_PER_S)
    writer.close()
    path = tmp_path / "state.mcap"
    whole = path.read_bytes()
    path.write_bytes(whole.replace(b'"drone_1"', b'"drone_7"', 1))
    with pytest.raises(RecordingError, match=r"its field cannot be read, and no other part has it \(unreadable att"):
        open_source([tmp_path])
    (tmp_path / "state-2.mcap").write_bytes(whole)
    source = open_source([tmp_path])
    assert source.field == field and [part.name for part in source.state] == ["state.mcap", "state-2.mcap"]
