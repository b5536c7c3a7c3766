"""Certificates: an authority signs each member of a run once and is then discarded; a site's authority is kept.

Afterwards nobody, not even the owner of the run, can make another member. The certificates practically never expire:
correcting a clock during a flight must not separate a driver from its run.
"""

import os
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from ipaddress import ip_address
from pathlib import Path
from typing import Self

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric.ec import SECP256R1, EllipticCurvePrivateKey, generate_private_key
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    load_pem_private_key,
)
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from groundstation.bus.zenoh_bus import AUTHORITY, CERTIFICATE, KEY
from groundstation.errors import GroundStationError

_BEGINS, _ENDS = datetime(2000, 1, 1, tzinfo=UTC), datetime(2100, 1, 1, tzinfo=UTC)


@dataclass(frozen=True, slots=True)
class Authority:
    """A key that signs, and the certificate by which others know it; above: the authority that signed it."""

    key: EllipticCurvePrivateKey
    certificate: x509.Certificate
    above: "Authority | None" = None

    @classmethod
    def make(cls, name: str, above: "Authority | None" = None) -> Self:
        """Return a new authority, signed by the one above or, without one, by itself."""
        key = generate_private_key(SECP256R1())
        issuer, signer = (above.certificate.subject, above.key) if above else (_called(name), key)
        constraints = x509.BasicConstraints(ca=True, path_length=0 if above else 1)
        builder = _certificate(name, key, issuer).add_extension(constraints, critical=True)
        return cls(key, builder.sign(signer, hashes.SHA256()), above)

    @classmethod
    def load(cls, certificate: bytes, key: bytes) -> Self:
        """Return the authority that was kept in PEM; raises ValueError if invalid."""
        loaded = load_pem_private_key(key, None)
        if not isinstance(loaded, EllipticCurvePrivateKey):
            raise ValueError("the key is of another kind")
        return cls(loaded, x509.load_pem_x509_certificate(certificate))

    @property
    def pem(self) -> bytes:
        """Its certificate."""
        return self.certificate.public_bytes(Encoding.PEM)

    @property
    def trusted_pem(self) -> bytes:
        """Return its certificate and that of the authority above: a router admits members of both."""
        return self.pem + (self.above.pem if self.above else b"")

    def member(self, name: str, addresses: Sequence[str] = ()) -> tuple[bytes, bytes]:
        """Return certificate and key of a member in PEM; one without addresses cannot pass for a router."""
        key = generate_private_key(SECP256R1())
        usages = [ExtendedKeyUsageOID.CLIENT_AUTH] + ([ExtendedKeyUsageOID.SERVER_AUTH] if addresses else [])
        builder = (
            _certificate(name, key, self.certificate.subject)
            .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
            .add_extension(x509.ExtendedKeyUsage(usages), critical=False)
        )
        if addresses:
            hosts = [x509.IPAddress(ip_address(address)) for address in addresses]
            builder = builder.add_extension(x509.SubjectAlternativeName(hosts), critical=False)
        signed = builder.sign(self.key, hashes.SHA256()).public_bytes(Encoding.PEM)
        return signed + (self.pem if self.above else b""), key_pem(key)


def make_identities(
    folder: Path, addresses: Sequence[str], names: Iterable[str], site: Authority | None = None
) -> None:
    """Make a folder that only its owner can read, with an authority and a certificate and key for each name.

    addresses: where the router listens; the certificates are good for those only. site: authority whose hosts the
    router admits too, and which vouches for it to them. Raises GroundStationError when the folder cannot be made.
    """
    authority = Authority.make("run", site)
    try:
        shutil.rmtree(folder, ignore_errors=True)  # left by a dead process with the same number
        folder.mkdir(mode=0o700)
        write_private(folder / AUTHORITY, authority.trusted_pem)
        for name in names:
            certificate, key = authority.member(name, addresses)
            write_private(folder / f"{name}{CERTIFICATE}", certificate)
            write_private(folder / f"{name}{KEY}", key)
    except OSError as error:
        raise GroundStationError(f"cannot write the run's certificates to {folder}: {error.strerror}") from error


def write_private(path: Path, content: bytes) -> None:
    """Write a new file that only its owner can read."""
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    with os.fdopen(descriptor, "wb") as file:
        file.write(content)


def key_pem(key: EllipticCurvePrivateKey) -> bytes:
    """Return a private key in PEM, without a password."""
    return key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())


def _certificate(name: str, key: EllipticCurvePrivateKey, issuer: x509.Name) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(_called(name))
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(_BEGINS)
        .not_valid_after(_ENDS)
    )


def _called(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
