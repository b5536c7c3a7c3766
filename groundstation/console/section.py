"""What the console is handed at its start."""

import hashlib
from pathlib import Path

import msgspec

from groundstation.field.resolved import ResolvedField


class ConsoleSection(msgspec.Struct, frozen=True):
    """The resolved field, the run folder, and whether there is ground truth."""

    field: ResolvedField
    run_dir: str
    truth: bool = False


def devices_of(identities: str) -> Path:
    """Return the folder of a run's invitations and devices; it lies with the run's certificates and goes with them."""
    return Path(identities) / "devices"


def run_id(run_dir: str) -> str:
    """Return the identity of a run: a console that is restarted in it has the same one, no other run does.

    Each run makes a folder of its own, and the supervisor hands that folder to every start of a process.
    """
    return hashlib.sha256(str(Path(run_dir).absolute()).encode()).hexdigest()[:16]
