"""The RECORDING on a command line: its files, its field, and the programs that made it."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from groundstation.field.resolved import ResolvedField, field_from_json
from groundstation.recording.file_topics import RAW, STATE
from groundstation.recording.foreign import kind_of_folder
from groundstation.recording.part_names import shown
from groundstation.recording.preamble import COMMAND_NAME, FIELD_NAME
from groundstation.recording.reader import Recording, RecordingError, open_parts, open_recording, parts
from groundstation.recording.rerun import Rerun, rerun_of

_TYPICAL = "a run folder holds state.mcap"


@dataclass(frozen=True, slots=True)
class Source:
    """One recorded run.

    state, raw: files in order of time (of state, the readable ones); field: the resolved field as JSON; run, versions:
    the recorder's notes on the run and the programs; began_ns: UNIX time of the first message; unix_offset_ns: UNIX
    time minus the run's boot clock; damage: state files that are no recording at all, and why; rerun: its origin if it
    is a re-run.
    """

    name: str
    state: tuple[Path, ...]
    raw: tuple[Path, ...] = ()
    field: bytes = b"{}"
    run: dict[str, str] = dataclasses.field(default_factory=dict)
    versions: dict[str, str] = dataclasses.field(default_factory=dict)
    began_ns: int = 0
    unix_offset_ns: int = 0
    damage: tuple[str, ...] = ()
    rerun: Rerun | None = None

    @property
    def resolved(self) -> ResolvedField:
        """Return the resolved field; raises msgspec.DecodeError for one unknown to this program."""
        return field_from_json(self.field)


def open_source(paths: Sequence[Path]) -> Source:
    """Return the run of a folder, or of one or several parts; raises RecordingError that names the fault."""
    if len(paths) == 1 and paths[0].is_dir():
        folder = paths[0]
        state, raw = parts(folder, STATE), parts(folder, RAW)
        if not state:
            raise RecordingError(f"{folder}: there is no recording in this folder ({_TYPICAL}){_hint(folder)}")
        return _source(shown(folder.resolve().name), state, raw)
    folders = [path for path in paths if path.is_dir()]
    if folders:
        raise RecordingError(f"{folders[0]}: name one run folder, or the parts of one recording, not both")
    state = [path for path in paths if not path.name.startswith(RAW)]
    raw = [path for path in paths if path.name.startswith(RAW)]
    if not state:
        raise RecordingError(f"{paths[0]}: holds pictures and datagrams only; name its run folder, or state.mcap too")
    return _source(state[0].stem, state, raw)


def _hint(folder: Path) -> str:
    what = kind_of_folder(folder)
    if what:
        return f"; this is {what}"
    inner = sorted(folder.glob("*/state*.mcap"), key=lambda path: path.stat().st_mtime)
    return f"; did you mean {inner[-1].parent}?" if inner else ""


def _source(name: str, state: Sequence[Path], raw: Sequence[Path]) -> Source:
    readable, unread = open_parts(state)
    # Where damage hides when one was begun, the order given is the better one: in a folder that of the names.
    opened = sorted(readable, key=_created_ns) if all(map(_created_ns, readable)) else readable
    first = opened[0]
    if not _are_of_one_run(opened):
        raise RecordingError(f"{', '.join(map(str, state))}: these are not parts of one recording")
    field = next((one.attachments[FIELD_NAME] for one in opened if FIELD_NAME in one.attachments), None)
    run = next((one.metadata["run"] for one in opened if "run" in one.metadata), None)
    if field is None or run is None:
        raise RecordingError(_lacking(first, field, run))
    try:
        msgspec.json.decode(field, type=dict[str, msgspec.Raw])
        offset_ns = int(run.get("unix_offset_ns", "0"))
    except (msgspec.DecodeError, ValueError) as error:
        raise RecordingError(f"{first.path}: its field or run cannot be read ({error})") from error
    files = tuple(recording.path for recording in opened)
    versions = next((one.metadata["versions"] for one in opened if "versions" in one.metadata), {})
    began_ns = next((record.log_time_ns for path in files for record in open_recording(path).raw_records()), 0)
    damage = tuple(f"{path.name}: {why}" for path, why in unread.items())
    return Source(name, files, tuple(raw), field, run, versions, began_ns, offset_ns, damage, rerun_of(first.metadata))


def _lacking(first: Recording, field: bytes | None, run: dict[str, str] | None) -> str:
    """Return why a recording cannot be replayed: damaged, or made by something else."""
    if first.preamble_damage:
        which = " and ".join(name for name, found in (("field", field), ("run", run)) if found is None)
        return f"{first.path}: its {which} cannot be read, and no other part has it ({first.preamble_damage[0]})"
    return f"{first.path}: no recording of a ground station (its field or run is not in it)"


def _are_of_one_run(opened: Sequence[Recording]) -> bool:
    """Return whether files may be parts of one run: of one boot, and begun by one command; damage may hide either."""
    boots = {recording.metadata.get("run", {}).get("clock", "") for recording in opened}
    commands = {recording.attachments.get(COMMAND_NAME, b"") for recording in opened}
    return len(boots - {""}) <= 1 and len(commands - {b""}) <= 1


def _created_ns(recording: Recording) -> int:
    text = recording.metadata.get("run", {}).get("created_unix_ns", "")
    return int(text) if text.isdigit() else 0
