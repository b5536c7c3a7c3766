"""The result of a run, from its folder once judged, and the report for open pages."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from groundstation.console.pages import StaticFile
from groundstation.recording.part_names import shown
from groundstation.report import run_facts
from groundstation.report.file_names import HTML_NAME, JSON_NAME

REPORT_PATH = f"/{HTML_NAME}"


class _Judged(msgspec.Struct, frozen=True):
    verdict: str = ""
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class RunEnd:
    """The end of a run. verdict: passed, failed, invalid or not flown, "" if not judged.

    command: the command that flies it again; report: the page to keep, None if there is none.
    """

    folder: Path
    verdict: str
    reasons: tuple[str, ...]
    command: str
    report: StaticFile | None

    def section(self) -> dict[str, Any]:
        """Return it for the page."""
        return {
            "verdict": self.verdict,
            "reasons": self.reasons,
            "command": self.command,
            "folder": shown(self.folder),
            "name": shown(self.folder.name),
            "report": REPORT_PATH if self.report is not None else "",
        }


def read_end(folder: Path) -> RunEnd | None:
    """Return the result of a run; None if its folder has none."""
    facts, judged = run_facts.read(folder), _judged(folder)
    if not facts.command and not judged.verdict:
        return None
    return RunEnd(folder.absolute(), judged.verdict, judged.reasons, facts.command, _report(folder))


def _judged(folder: Path) -> _Judged:
    try:
        return msgspec.json.decode((folder / JSON_NAME).read_bytes(), type=_Judged)
    except (OSError, msgspec.DecodeError):
        return _Judged()


def _report(folder: Path) -> StaticFile | None:
    try:
        return StaticFile((folder / HTML_NAME).read_bytes(), "text/html; charset=utf-8")
    except OSError:
        return None
