"""The runtime file: where `groundstation land` and friends find a run's router and processes.

Lives in $XDG_RUNTIME_DIR, or /tmp/skein-<uid>, as SITE-PID.json, readable by its owner only, beside SITE-PID, the
folder of the run's certificates. A pid counts only with its start time, so a file left by a crash never points at
another process.
"""

import os
import shutil
import stat
from contextlib import suppress
from pathlib import Path

import msgspec

from groundstation.bus.roles import Identity, Role, certificate_name, shell
from groundstation.errors import GroundStationError
from groundstation.process.stat_file import stat_of

# Not tempfile.gettempdir(): with another TMPDIR, or a full /tmp, another shell would look elsewhere than the run did.
_SHARED = Path("/tmp")
# A desktop's terminal, a cron job and `sudo -u` of one user have different $XDG_RUNTIME_DIR.
_SESSIONS, _SERVICE = Path("/run/user"), Path("/run/skein")


class ProcessRecord(msgspec.Struct, frozen=True):
    """One process of a run; start_time in clock ticks since boot, from the kernel."""

    name: str
    role: str
    pid: int
    start_time: int

    @property
    def alive(self) -> bool:
        """Return whether this very process (not another that got its pid) still runs."""
        return self.pid > 0 and start_time(self.pid) == self.start_time


class RuntimeRecord(msgspec.Struct, frozen=True):
    """A run as recorded for other shells; real: its real drones.

    host: name of this host at the site, if the run is on another host; run_dir is then the run's name.
    """

    site: str
    field: str
    endpoint: str
    run_dir: str
    heartbeat: str
    drones: tuple[str, ...]
    supervisor: ProcessRecord
    processes: tuple[ProcessRecord, ...]
    identities: str = ""
    """Folder of the run's certificates; "" where the bus asks for none."""
    real: tuple[str, ...] = ()
    host: str = ""

    @property
    def name(self) -> str:
        """The name by which `--run` chooses this run."""
        return f"{self.site}-{self.supervisor.pid}" if not self.host else self.site

    @property
    def alive(self) -> bool:
        """Return whether any process of it still runs (drivers outlive a killed supervisor until they have landed)."""
        return any(process.alive for process in (self.supervisor, *self.processes))

    def identity(self, role: Role) -> Identity | None:
        """Return the identity for joining the bus from another shell."""
        name = certificate_name(self.host) if self.host else shell(role)
        return Identity(self.identities, name, Path(self.run_dir).name) if self.identities else None

    @property
    def has_truth(self) -> bool:
        """Return whether it has a simulator, which publishes true states."""
        return any(process.role == "sim_bridge" for process in self.processes)

    @property
    def simulated(self) -> bool:
        """Return whether all of its drones are emulated."""
        return self.has_truth and not self.real


class _AnyRecord(msgspec.Struct, frozen=True):
    supervisor: ProcessRecord


def start_time(pid: int) -> int | None:
    """Return when a process started [clock ticks since boot], or None if there is none or it is a zombie."""
    fields = stat_of(pid)
    return None if fields is None or fields[0] in "ZX" else int(fields[19])


def wanted_folder() -> Path:
    """Return where this shell's runs have their files, if it can be used."""
    given = os.environ.get("XDG_RUNTIME_DIR", "")
    return Path(given) / "skein" if given and os.access(given, os.W_OK) else _shared()


def folder() -> Path:
    """Return the folder of runtime files, made if needed; raises GroundStationError if it is someone else's."""
    path = wanted_folder()
    try:
        path.mkdir(mode=0o700, exist_ok=True)
        ours = _is_ours(path)
    except OSError as error:
        raise GroundStationError(f"cannot use {path} for the runtime file: {error.strerror}") from error
    if not ours:
        raise GroundStationError(f"{path} is not a folder of yours: remove it, or set XDG_RUNTIME_DIR")
    return path


def _shared() -> Path:
    return _SHARED / f"skein-{os.getuid()}"


def _is_ours(path: Path) -> bool:
    """Return whether nobody else can have put records there; raises OSError.

    /tmp is shared: a folder planted by another user could point our stop commands at processes of their own.
    """
    status = path.lstat()
    return stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid()


def folders_beside() -> list[Path]:
    """Return the other folders in which runs of this user record themselves, as far as there are any."""
    found = []
    for path in (_SESSIONS / str(os.getuid()) / "skein", _SERVICE / "skein", _shared()):
        with suppress(OSError):
            if path != wanted_folder() and _is_ours(path):
                found.append(path)
    return found


def write(record: RuntimeRecord) -> Path:
    """Write a record atomically; returns its path. Raises OSError."""
    try:
        path = folder() / f"{record.name}.json"
    except GroundStationError as error:  # the folder is gone, at a logout e.g.
        raise OSError(str(error)) from error
    draft = path.with_suffix(".draft")
    draft.write_bytes(msgspec.json.encode(record))
    draft.chmod(0o600)
    draft.replace(path)
    return path


def live_records() -> list[RuntimeRecord]:
    """Return the runs that still have a process, and remove files of dead ones that can be read."""
    with suppress(OSError):  # a folder that is missing, or another user's, must not keep a stop from other places
        if _is_ours(wanted_folder()):
            return _live_records(wanted_folder())
    return []


def records_beside() -> list[RuntimeRecord]:
    """Return the runs of this user whose shells had another XDG_RUNTIME_DIR, as `live_records` does."""
    return [record for place in folders_beside() for record in _live_records(place)]


def _live_records(place: Path) -> list[RuntimeRecord]:
    records = []
    for path in sorted(place.glob("*.json")):
        try:
            content = path.read_bytes()
            record = msgspec.json.decode(content, type=RuntimeRecord)
        except OSError:
            continue
        except msgspec.DecodeError:
            if not _is_of_a_live_run(content):
                path.unlink(missing_ok=True)
            continue
        if record.alive:
            records.append(record)
        else:
            _remove(record, place)
    _remove_unrecorded_identities(place)
    return records


def _remove_unrecorded_identities(place: Path) -> None:
    """Remove the certificates of runs that died before they were recorded."""
    for path in place.glob("*-*"):
        pid = path.name.rpartition("-")[2]
        unrecorded = pid.isdecimal() and path.is_dir() and not (place / f"{path.name}.json").exists()
        if unrecorded and start_time(int(pid)) is None:
            shutil.rmtree(path, ignore_errors=True)


def _is_of_a_live_run(content: bytes) -> bool:
    """Return whether a record of another version, which this one cannot read, has a live supervisor."""
    with suppress(msgspec.DecodeError):
        return msgspec.json.decode(content, type=_AnyRecord).supervisor.alive
    return False


def identities_of(site: str, pid: int) -> Path:
    """Return the folder for the certificates of a run."""
    return folder() / f"{site}-{pid}"


def remove(record: RuntimeRecord) -> None:
    """Remove a record, and the certificates and heartbeat block that a killed supervisor could not remove."""
    try:
        place = folder()
    except GroundStationError:  # it is gone, at a logout e.g.
        place = None
    _remove(record, place)


def _remove(record: RuntimeRecord, place: Path | None) -> None:
    if place is not None:
        with suppress(OSError):
            (place / f"{record.name}.json").unlink(missing_ok=True)
        if record.identities:
            shutil.rmtree(place / record.name, ignore_errors=True)
    block = Path(record.heartbeat)
    if block.name.startswith("skein-"):
        with suppress(OSError):
            block.unlink(missing_ok=True)
