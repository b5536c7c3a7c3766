"""Exit codes of the `groundstation` command, for scripts."""

from enum import IntEnum

import click

from groundstation.errors import GroundStationError, OperatorMistake, SettingsError, is_wrong_place


class ExitCode(IntEnum):
    """Result of a command."""

    OK = 0
    FAILED = 1
    SETTINGS = 2
    UNREACHABLE = 3
    FAULT = 4
    BUG = 70
    INTERRUPTED = 130

    @property
    def meaning(self) -> str:
        """Return one line for the help text."""
        return _MEANING[self]


_MEANING = {
    ExitCode.OK: "done",
    ExitCode.FAILED: "judged and not good: a run failed its criteria, a check found something to mend, "
    "a re-run differs",
    ExitCode.SETTINGS: "wrong settings or wrong usage",
    ExitCode.UNREACHABLE: "no running ground station could be reached",
    ExitCode.FAULT: "a driver, a link or a process failed, or a command was not confirmed",
    ExitCode.BUG: "a fault of the program itself, with a traceback",
    ExitCode.INTERRUPTED: "interrupted by the operator",
}


class UnreachableError(GroundStationError):
    """No running ground station answers."""


def exit_code_of(error: BaseException) -> ExitCode:
    """Return the exit code of a failed command."""
    match error:
        case SettingsError() | OperatorMistake() | click.UsageError():
            return ExitCode.SETTINGS
        case OSError(filename=place) if place is not None and is_wrong_place(error):
            return ExitCode.SETTINGS
        case UnreachableError():
            return ExitCode.UNREACHABLE
        case GroundStationError() | click.ClickException() | OSError():
            return ExitCode.FAULT
        case KeyboardInterrupt() | click.Abort():
            return ExitCode.INTERRUPTED
        case _:
            return ExitCode.BUG
