"""Writes a re-run as a new run folder: the recording, with the tracker's present messages in place of its old ones."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from groundstation.bus import codec, keys
from groundstation.bus.api import Sample
from groundstation.bus.messages import Message
from groundstation.bus.topics import JOURNAL, Topic
from groundstation.recording.capture import Capture
from groundstation.recording.chunks import among
from groundstation.recording.copies import preamble_copy
from groundstation.recording.mcap_file import McapFile
from groundstation.recording.outputs import errors_named
from groundstation.recording.preamble import FIELD_NAME
from groundstation.recording.reader import RawRecord, RecordingError, open_recording
from groundstation.recording.rerun import Rerun
from groundstation.recording.timeline import Timeline
from groundstation.replay import versions
from groundstation.replay.source import Source
from groundstation.replay.tick_log import OUTPUTS
from groundstation.replay.verify import Lived, Repetition

_FACTS = "run.json"
_is_replaced = among((*OUTPUTS, JOURNAL))


def require_new(folder: Path) -> None:
    """Raise RecordingError if a folder is not empty."""
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise RecordingError(f"{folder}: exists already; name a new folder")


def live_again(source: Source, repetition: Repetition, folder: Path, field: bytes, changes: str) -> None:
    """Run a repetition to its end and write it to a new run folder.

    field: the resolved field (JSON) that it runs with; changes: differences from the recording, in words.
    """
    require_new(folder)
    opened = open_recording(source.state[0])
    note = {**Rerun(source.name, changes).as_metadata(), "versions": {**source.versions, **versions.current()}}
    preamble = preamble_copy(opened, note)
    attachments = {**preamble.attachments, FIELD_NAME: ("application/json", field)}
    with errors_named(folder):
        folder.mkdir(parents=True, exist_ok=True)
        if _FACTS in opened.attachments:
            (folder / _FACTS).write_bytes(opened.attachments[_FACTS])
        file = McapFile(folder / "state.mcap", replace(preamble, attachments=attachments))
        try:
            _write(source, repetition, file)
        finally:
            file.close()


def _write(source: Source, repetition: Repetition, file: McapFile) -> None:
    capture = Capture(Timeline(source.run.get("clock", ""), source.unix_offset_ns))
    lives = repetition.ticks()
    lived = next(lives, None)
    now_ns = 0
    for record in _copied(source):
        now_ns = max(now_ns, record.log_time_ns)
        while lived is not None and lived.tick.at_ns <= now_ns:
            _write_lived(source, lived, capture, file)
            lived = next(lives, None)
        _put(capture, file, Sample(str(record.key), record.data), record.log_time_ns - source.unix_offset_ns)
    while lived is not None:
        _write_lived(source, lived, capture, file)
        lived = next(lives, None)


def _copied(source: Source) -> Iterator[RawRecord]:
    def is_kept(topic: Topic) -> bool:
        return topic.type is not None and not _is_replaced(topic)

    for path in source.state:
        yield from open_recording(path).raw_records(is_kept)


def _write_lived(source: Source, lived: Lived, capture: Capture, file: McapFile) -> None:
    site = source.run.get("site", "")
    for topic, message in lived.said:
        _put(capture, file, _sample(site, topic, message), lived.tick.entry.now_ns)


def _sample(site: str, topic: Topic, message: Message) -> Sample:
    header = message.header
    return Sample(keys.expression(site, topic, header.entity, header.source), codec.encode(message))


def _put(capture: Capture, file: McapFile, sample: Sample, arrival_ns: int) -> None:
    entry = capture.entry(sample, arrival_ns)
    if entry is not None:
        file.write(entry)
