"""The field of a run: from any part of its recording, else from the field file in its folder."""

from collections.abc import Sequence
from pathlib import Path

import msgspec

from groundstation.errors import SettingsError
from groundstation.field.resolved import ResolvedField, field_from_json, field_from_values
from groundstation.recording.preamble import FIELD_NAME
from groundstation.recording.reader import Recording
from groundstation.report.tracks import UNKNOWN_FIELD
from groundstation.settings.document import parse

_FILE_NAME = "resolved.yaml"


def recorded_field(recordings: Sequence[Recording], run_dir: Path, damage: list[str]) -> ResolvedField:
    """Return the first field that can be read; UNKNOWN_FIELD if none can. Notes what is wrong with the others."""
    for recording in recordings:
        if FIELD_NAME in recording.attachments:
            try:
                return field_from_json(recording.attachments[FIELD_NAME])
            except msgspec.DecodeError as error:
                damage.append(f"{FIELD_NAME}: {error}")
    return _of_its_file(run_dir, damage)


def _of_its_file(run_dir: Path, damage: list[str]) -> ResolvedField:
    try:
        text = (run_dir / _FILE_NAME).read_text(encoding="utf-8")
        return field_from_values(parse(text, _FILE_NAME).plain())
    except FileNotFoundError:
        return UNKNOWN_FIELD
    except (OSError, ValueError, SettingsError) as error:
        damage.append(f"{_FILE_NAME}: {error}")
        return UNKNOWN_FIELD
