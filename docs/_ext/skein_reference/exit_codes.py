"""Page of the exit codes of the command line."""

from groundstation.cli.exits import ExitCode
from skein_reference.markdown import code, page, prose, table


def exit_codes() -> str:
    """Return the page of every exit code."""
    rows = [(code(int(one)), code(one.name), prose(one.meaning)) for one in ExitCode]
    return page(
        "Exit codes", "Every `groundstation` command ends with one of these.", table(("code", "name", "meaning"), rows)
    )
