"""Page of the processes of a run, from the process table of a shipped field."""

from pathlib import Path

from groundstation.flight.composition import fly_endpoint, process_table
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.supervisor.process_spec import ProcessSpec
from skein_reference.markdown import code, page, table

_INTRODUCTION = """\
Generated from the process table of `config/lab.yaml`. The supervisor starts guardian and router first and then all
others at once. A process whose heartbeat is older than its hang limit is killed and started again; the limit counts
from READY on, before that the start limit holds. At the end of a run processes stop in the order of the last column,
those of one group together.

A driver that dies, or is silent for {silence}, is replaced at once by prepared datagrams of the supervisor to its
drone, or of the guardian where the supervisor is silent as well: hover, then land."""


def processes() -> str:
    """Return the page."""
    field = load_field(find_field("lab"))
    specs = process_table(field, fly_endpoint(field), Path("runs"), simulation=None, monitor=True)
    silence = " or ".join(sorted({f"{spec.silence_limit_s:g} s" for spec in specs if spec.failsafe_datagrams}))
    headings = ("process", "role", "entry", "hang limit", "start limit", "when it ends", "stops in group")
    return page("Processes", _INTRODUCTION.format(silence=silence), table(headings, map(_row, specs)))


def _row(spec: ProcessSpec) -> tuple[str, ...]:
    return (
        code(spec.name),
        spec.role,
        code(spec.entry or " ".join(spec.command)),
        f"{spec.hang_limit_s:g} s",
        f"{spec.start_limit_s:g} s",
        {"ALWAYS": "started again", "ENDS_RUN": "the run ends"}[spec.restart],
        f"{int(spec.stop_order)} {spec.stop_order.name.lower()}",
    )
