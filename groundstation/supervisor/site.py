"""A site across runs: its authority, kept on the ground station's host, and the other hosts that it has admitted.

Kept in $XDG_CONFIG_HOME/skein, else ~/.config/skein: sites/SITE on the ground station's host, joined/SITE elsewhere.
"""

import ipaddress
import os
import re
import shutil
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import msgspec

from groundstation.bus.api import Subscription
from groundstation.bus.door import why_closed
from groundstation.bus.messages import Lease
from groundstation.bus.roles import Identity, Member, Role, certificate_name
from groundstation.bus.topics import LEASE, VEHICLE_STATUS
from groundstation.bus.zenoh_bus import AUTHORITY, CERTIFICATE, KEY, open_bus
from groundstation.errors import GroundStationError, OperatorMistake
from groundstation.supervisor.authority import Authority, key_pem, make_identities, write_private
from groundstation.supervisor.joining import admissions, settings_folder
from groundstation.supervisor.runtime_file import ProcessRecord, RuntimeRecord

_HOSTS = "hosts.json"
_SITE = re.compile(r"[a-z][a-z0-9_]{0,47}")
_HOST = re.compile(r"[a-z][a-z0-9_]{0,15}")
_SILENT = "no answer, and a run there may be flying: stop it there, or mend the link"
_NO_OPERATOR = "a run there may be flying, but its operator is not heard: stop it there"
_CONNECT_S, _LEASE_S, _STATUS_S = 1.0, 1.5, 0.5


class Admission(msgspec.Struct, frozen=True):
    """The data that a host needs to take part in a site's runs; secret."""

    site: str
    host: str
    endpoint: str
    authority: str
    certificate: str
    key: str


def folder(kind: str, site: str) -> Path:
    """Return the folder for the files of a site; kind: "sites" or "joined"."""
    return settings_folder() / kind / site


def found(site: str) -> Path:
    """Make the authority of a site, which only its owner can read; returns its folder."""
    _require_name(site)
    place = folder("sites", site)
    if place.exists():
        raise OperatorMistake(f"{site} has an authority already: {place} (remove it, and all hosts have to join anew)")
    authority = Authority.make(f"site {site}")
    place.mkdir(parents=True, mode=0o700)
    write_private(place / AUTHORITY, authority.pem)
    write_private(place / f"authority{KEY}", key_pem(authority.key))
    write_private(place / _HOSTS, b"[]")
    return place


def _require_name(site: str) -> None:
    if not _SITE.fullmatch(site):
        raise OperatorMistake(f"{site!r}: a site is called as in its field: a-z first, then a-z, 0-9, _, 48 at most")


def _require_address(endpoint: str) -> None:
    address = endpoint.partition("/")[2].rpartition(":")[0]
    try:
        if ipaddress.IPv4Address(address).is_unspecified:
            raise ValueError
    except ValueError:
        text = f"{address}: must be the ground station's IPv4 address, as in bus.listen, such as 192.168.1.10"
        raise OperatorMistake(text) from None


def authority_of(site: str) -> Authority:
    """Return the authority of a site; raises OperatorMistake if there is none."""
    place = folder("sites", site)
    try:
        return Authority.load((place / AUTHORITY).read_bytes(), (place / f"authority{KEY}").read_bytes())
    except (OSError, ValueError) as error:
        raise OperatorMistake(
            f"{site} has no authority that can be read ({error}): groundstation site init {site}"
        ) from error


def certify(run: Path, site: str, address: str, listen: str, names: Iterable[str]) -> None:
    """Make the certificates of a run in its folder; if it listens for other hosts, the site's authority signs them."""
    above = authority_of(site) if listen else None
    make_identities(run, [address, listen] if listen else [address], names, above)


def _names(site: str) -> list[str]:
    try:
        return msgspec.json.decode((folder("sites", site) / _HOSTS).read_bytes(), type=list[str])
    except (OSError, msgspec.DecodeError):
        return []


def hosts(site: str) -> tuple[Member, ...]:
    """Return the hosts that a site has admitted: each may order as the operator's shells may, by its own name."""
    return tuple(_member(host) for host in _names(site))


def _member(host: str) -> Member:
    return Member(certificate_name(host), Role.CLI, (f"cli_{host}_$*", f"deadman_{host}_$*"))


def admit(site: str, host: str, endpoint: str, file: Path) -> None:
    """Write a new host's admission, valid from the next run on. Raises OperatorMistake."""
    _require_name(site)
    if not _HOST.fullmatch(host):
        raise OperatorMistake(f"{host}: a host is called by small letters, digits and _, 16 at most")
    authority, names = authority_of(site), _names(site)
    if host in names:
        raise OperatorMistake(f"{host} was admitted before: groundstation site expel {site} {host}, or another name")
    _require_address(endpoint)
    certificate, key = authority.member(_member(host).name)
    admission = Admission(site, host, endpoint, authority.pem.decode(), certificate.decode(), key.decode())
    try:
        write_private(file, msgspec.json.encode(admission))
    except OSError as error:
        raise OperatorMistake(f"cannot write {file}: {error.strerror}") from error
    _write_names(site, [*names, host])


def expel(site: str, host: str) -> None:
    """Withdraw a host's admission from the next run on."""
    names = _names(site)
    if host not in names:
        raise OperatorMistake(f"{site} has admitted {', '.join(names) or 'nobody'}")
    _write_names(site, [name for name in names if name != host])


def _write_names(site: str, names: list[str]) -> None:
    draft = folder("sites", site) / f"{_HOSTS}.draft"
    draft.unlink(missing_ok=True)
    write_private(draft, msgspec.json.encode(names))
    draft.replace(folder("sites", site) / _HOSTS)


def join(file: Path) -> Admission:
    """Make this host a member of the site that admitted it; raises OperatorMistake if the file is invalid."""
    try:
        admission = msgspec.json.decode(file.read_bytes(), type=Admission)
    except (OSError, msgspec.DecodeError) as error:
        raise OperatorMistake(f"{file} is no admission (groundstation site admit writes it): {error}") from error
    if not _HOST.fullmatch(admission.host) or not _SITE.fullmatch(admission.site):
        raise OperatorMistake(f"{file} is no admission: its site or host has a name that cannot be")
    place, name = folder("joined", admission.site), _member(admission.host).name
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True, mode=0o700)
    write_private(place / AUTHORITY, admission.authority.encode())
    write_private(place / f"{name}{CERTIFICATE}", admission.certificate.encode())
    write_private(place / f"{name}{KEY}", admission.key.encode())
    write_private(place / "admission.json", msgspec.json.encode(msgspec.structs.replace(admission, key="")))
    return admission


def membership(site: str | None) -> tuple[Admission, Identity]:
    """Return this host's admission and identity; raises OperatorMistake unless it has joined exactly one site."""
    paths = sorted(folder("joined", "").glob(f"{site or '*'}/admission.json"))
    if len(paths) != 1:
        known = ", ".join(path.parent.name for path in paths) or "none"
        raise OperatorMistake(f"this host must have joined the site it serves (groundstation site join): {known}")
    admission = msgspec.json.decode(paths[0].read_bytes(), type=Admission)
    return admission, Identity(str(paths[0].parent), certificate_name(admission.host), "")


def runs() -> Iterator[RuntimeRecord]:
    """Yield the runs on other hosts that this one may join now; each takes up to 3 s to find."""
    for path in admissions():
        admission = msgspec.json.decode(path.read_bytes(), type=Admission)
        record = _found(admission, str(path.parent))
        if record is not None:
            yield record


def why_not_found() -> Iterator[str]:
    """Yield what keeps this host from runs that may be flying at the joined sites, where `runs` found none."""
    for path in admissions():
        admission = msgspec.json.decode(path.read_bytes(), type=Admission)
        identity = Identity(str(path.parent), certificate_name(admission.host), "")
        if why := why_closed(admission.endpoint, identity, _SILENT, _NO_OPERATOR):
            yield f"{admission.site} at {admission.endpoint.rpartition('/')[2]}: {why}"


def _found(admission: Admission, place: str) -> RuntimeRecord | None:
    name = _member(admission.host).name
    source = f"cli_{admission.host}_{os.getpid()}"
    try:
        bus = open_bus(admission.endpoint, admission.site, source, _CONNECT_S, Identity(place, name, ""))
    except GroundStationError:
        return None
    try:
        leases, statuses = bus.subscribe([LEASE]), bus.subscribe([VEHICLE_STATUS])
        leases.wait(_LEASE_S)
        time.sleep(_STATUS_S)
        run = _run_of(leases)
        drones = tuple(sorted({received.header.entity for received in statuses.drain()}))
    finally:
        bus.close()
    if not run:
        return None
    nobody = ProcessRecord("supervisor", "supervisor", 0, 0)
    return RuntimeRecord(
        admission.site, "", admission.endpoint, run, "", drones, nobody, (), identities=place, host=admission.host
    )


def _run_of(leases: Subscription) -> str:
    said = [received.message for received in leases.drain()]
    return next((lease.run for lease in reversed(said) if isinstance(lease, Lease)), "")
