"""The settings that the console gets at its start."""

import hashlib
from collections.abc import Iterable, Mapping
from pathlib import Path

import msgspec

from groundstation.bus.thinning import rates_by_key
from groundstation.bus.topics import SETPOINT, TRUTH
from groundstation.field.resolved import ResolvedField

# Slightly more than the ten a second that are shown, or one would be missing now and then.
_MOTION_HZ = 12.5


class ConsoleSection(msgspec.Struct, frozen=True):
    """The resolved field, the run folder, and whether there is ground truth."""

    field: ResolvedField
    run_dir: str
    truth: bool = False


def devices_of(identities: str) -> Path:
    """Return the folder of a run's invitations and devices; it is beside the certificates and removed with them."""
    return Path(identities) / "devices"


def enough_hz(site: str, drones: Iterable[str], targets: Iterable[str]) -> Mapping[str, float]:
    """Return the sufficient rates of samples [Hz], by the keys of faster ones."""
    drones = tuple(drones)
    return rates_by_key(site, ((SETPOINT, drones, _MOTION_HZ), (TRUTH, (*drones, *targets), _MOTION_HZ)))


def run_id(run_dir: str) -> str:
    """Return the identity of a run: a restarted console of the run has the same one, no other run does.

    Each run makes a folder of its own, and the supervisor hands that folder to every start of a process.
    """
    return hashlib.sha256(str(Path(run_dir).absolute()).encode()).hexdigest()[:16]
