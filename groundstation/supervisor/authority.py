"""The certificates of a run: an authority that signs each member once and is then forgotten.

Nobody, not even the owner of the run, can make another member later. The certificates hold for as long as anybody
cares: a clock that is set right during a flight must not part a driver from its run.
"""

import os
import shutil
from collections.abc import Iterable
from datetime import UTC, datetime
from ipaddress import ip_address
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric.ec import SECP256R1, EllipticCurvePrivateKey, generate_private_key
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from cryptography.x509.oid import NameOID

from groundstation.bus.zenoh_bus import AUTHORITY, CERTIFICATE, KEY
from groundstation.errors import GroundStationError

_BEGINS, _ENDS = datetime(2000, 1, 1, tzinfo=UTC), datetime(2100, 1, 1, tzinfo=UTC)


def make_identities(folder: Path, address: str, names: Iterable[str]) -> None:
    """Make a folder that only its owner can read, with an authority and a certificate and key for each name.

    address: where the router listens; its certificate is good for that address only, as all of them are. Raises
    GroundStationError when the folder cannot be made.
    """
    authority = generate_private_key(SECP256R1())
    try:
        shutil.rmtree(folder, ignore_errors=True)  # of a dead process with the same number
        folder.mkdir(mode=0o700)
        _write(folder / AUTHORITY, _certificate("run", authority, authority, address))
        for name in names:
            key = generate_private_key(SECP256R1())
            _write(folder / f"{name}{CERTIFICATE}", _certificate(name, key, authority, address))
            _write(folder / f"{name}{KEY}", key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()))
    except OSError as error:
        raise GroundStationError(f"cannot write the run's certificates to {folder}: {error.strerror}") from error


def _write(path: Path, content: bytes) -> None:
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    with os.fdopen(descriptor, "wb") as file:
        file.write(content)


def _certificate(name: str, key: EllipticCurvePrivateKey, authority: EllipticCurvePrivateKey, address: str) -> bytes:
    own = key is authority
    builder = (
        x509.CertificateBuilder()
        .subject_name(_called(name))
        .issuer_name(_called("run"))
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(_BEGINS)
        .not_valid_after(_ENDS)
        .add_extension(x509.BasicConstraints(ca=own, path_length=0 if own else None), critical=True)
    )
    if not own:
        host = x509.IPAddress(ip_address(address))
        builder = builder.add_extension(x509.SubjectAlternativeName([host]), critical=False)
    return builder.sign(authority, hashes.SHA256()).public_bytes(Encoding.PEM)


def _called(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
