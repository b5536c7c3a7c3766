"""Facts known only to the command that started a run; written to `run.json` beside the recording."""

from pathlib import Path
from typing import Any

import msgspec

NAME = "run.json"
_CHECK = "preflight"


class RunFacts(msgspec.Struct, frozen=True, omit_defaults=True):
    """The command that started a run.

    mode: demo, sitl, fly or preflight; command_unix_ns: when the operator gave the command (0: unknown, or the run
    asked before the take-off); command_ns, clock: the same by that boot clock, which nobody sets; tracking_s: time of
    ordered tracking; kernels_lacked: whether they had to be compiled first, once per version; real: real parts of a
    simulated run; command: as typed, without passwords; expected: the section of the scenario's file, verbatim
    (`report/expectation.py` reads it).
    """

    mode: str = ""
    field: str = ""
    scenario: str = ""
    seed: int | None = None
    command_unix_ns: int = 0
    command_ns: int = 0
    clock: str = ""
    tracking_s: float | None = None
    kernels_lacked: bool = False
    real: tuple[str, ...] = ()
    command: str = ""
    expected: Any = None

    @property
    def is_check(self) -> bool:
        """Return whether the command only checks what forbids a take-off: no drone flies."""
        return self.mode == _CHECK


def write(run_dir: Path, facts: RunFacts) -> None:
    """Write the facts into the run folder."""
    (run_dir / NAME).write_bytes(msgspec.json.encode(facts))


def read(run_dir: Path) -> RunFacts:
    """Return the facts of a run, or empty ones if there are none that can be read."""
    try:
        return msgspec.json.decode((run_dir / NAME).read_bytes(), type=RunFacts)
    except (OSError, msgspec.DecodeError):
        return RunFacts()
