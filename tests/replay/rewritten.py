"""Modified copies of recordings: a message changed, a topic left out, the end cut off."""

from collections.abc import Callable
from pathlib import Path

from flown_study import UNIX_OFFSET_NS

from groundstation.bus.api import Sample
from groundstation.recording.capture import Capture
from groundstation.recording.chunks import RawRecord
from groundstation.recording.mcap_file import McapFile
from groundstation.recording.preamble import Preamble
from groundstation.recording.reader import open_recording
from groundstation.recording.timeline import Timeline

Change = Callable[[RawRecord], bytes | None]


def rewritten(source: Path, folder: Path, change: Change, field: bytes = b"") -> Path:
    """Copy a recording message by message through `change`, which returns the new content, or None to drop it."""
    folder.mkdir()
    opened = open_recording(source / "state.mcap")
    attachments = {name: ("", data) for name, data in opened.attachments.items()}
    if field:
        attachments["field.json"] = ("", field)
    capture = Capture(Timeline(opened.metadata["run"]["clock"], UNIX_OFFSET_NS))
    file = McapFile(folder / "state.mcap", Preamble(opened.metadata, attachments, 0))
    for record in opened.raw_records():
        data = change(record)
        if data is not None:
            entry = capture.entry(Sample(str(record.key), data), record.log_time_ns - UNIX_OFFSET_NS)
            assert entry is not None
            file.write(entry)
    file.close()
    return folder


def without(*topics: str) -> Change:
    """Leave topics out."""
    return lambda record: None if record.key.topic.name in topics else record.data
