"""Pictures of cameras for the gravest moments of a run's story."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from groundstation.bus.jpeg import stated_size
from groundstation.bus.keys import Key
from groundstation.bus.topics import IMAGE, Topic
from groundstation.errors import MessageError
from groundstation.recording.reader import RawRecord, RecordingError, payload
from groundstation.recording.run import RecordedRun, open_run
from groundstation.report.story import Moment
from groundstation.report.tracks import RunData
from groundstation.time_units import NS_PER_S

_MOST = 8
_OLDEST_NS = NS_PER_S
# The gravest first; among equals the earliest.
_KINDS = ("failsafe", "fault", "error", "warning", "flight")


@dataclass(frozen=True, slots=True)
class MomentPicture:
    """A moment, the camera that shows it, and its picture as a data URI."""

    moment: Moment
    camera: str
    uri: str


def moment_pictures(run_dir: Path, data: RunData, moments: Sequence[Moment]) -> list[MomentPicture]:
    """Return pictures of at most eight moments, in order of time; none if the run has no pictures."""
    try:
        run = open_run(run_dir)
    except (RecordingError, OSError):
        return []
    shown = [moment for moment in moments if moment.kind in _KINDS]
    shown.sort(key=lambda moment: (_KINDS.index(moment.kind), moment.time_s))
    found: dict[str, MomentPicture] = {}
    for moment in shown:
        picture = _picture(run, data, moment) if len(found) < _MOST else None
        if picture is not None:
            found.setdefault(picture.uri, picture)  # one picture may show several moments
    return sorted(found.values(), key=lambda picture: picture.moment.time_s)


def _is_image(topic: Topic) -> bool:
    return topic is IMAGE


def _picture(run: RecordedRun, data: RunData, moment: Moment) -> MomentPicture | None:
    at_ns = data.start_unix_ns + round(moment.time_s * NS_PER_S)
    newest = run.latest_before(at_ns + 1, _is_image)
    fresh = {key: record for key, record in newest.items() if at_ns - record.log_time_ns <= _OLDEST_NS}
    for key in sorted(fresh, key=lambda key: _rank(key, data, moment)):
        if uri := _uri(fresh[key]):
            return MomentPicture(moment, key.entity, uri)
    return None


def _rank(key: Key, data: RunData, moment: Moment) -> tuple[bool, bool, str]:
    """Rank a camera that the moment names first, then world-fixed ones."""
    fixed: Mapping[str, object] = data.resolved.cameras
    return key.entity not in moment.text, key.entity not in fixed, key.entity


def _uri(record: RawRecord) -> str:
    """Return a recorded picture as a data URI, "" if it is none."""
    try:
        _, jpeg = payload(record)
    except MessageError:
        return ""
    return f"data:image/jpeg;base64,{base64.b64encode(jpeg).decode()}" if stated_size(jpeg) else ""
