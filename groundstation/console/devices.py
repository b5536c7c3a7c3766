"""Tablets and phones in the network: each is admitted by a one-time code, with the rights of its role.

The data are in a folder that only the owner of the run can read, and are removed with the run: an invitation is a file
named after the digest of its code, a device one named after the digest of its cookie. So a restarted console knows its
devices, and another shell can invite without the console.
"""

import hashlib
import secrets
import time
from collections.abc import Mapping
from contextlib import suppress
from enum import StrEnum
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs

from cryptography import x509
from cryptography.hazmat.primitives import hashes

from groundstation.console.cookies import cookie_of, port_of
from groundstation.supervisor.authority import Authority, write_private

_INVITATION_LIVES_S = 600.0
_INVITED, _KNOWN, _URL = "invited-", "device-", "url"


class DeviceRole(StrEnum):
    """Rights of a device."""

    WATCH = "watch"
    """Look."""
    STOP = "stop"
    """Look and stop."""
    COMMAND = "command"
    """All that the operator's own page may."""


class Devices:
    """The invitations and devices of one console. folder: made if needed, readable by its owner only."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(mode=0o700, exist_ok=True)

    def open(self, address: str, port: int) -> tuple[Path, Path]:
        """Note the console's address; returns the files of its certificate and key, made at its first start."""
        certificate, key = self._folder / "console.pem", self._folder / "console.key"
        if not key.exists():
            made = Authority.make("console").member("console", [address])
            for path, content in zip((certificate, key), made, strict=True):
                write_private(path, content)
        (self._folder / _URL).unlink(missing_ok=True)
        write_private(self._folder / _URL, f"https://{address}:{port}/".encode())
        return certificate, key

    @property
    def url(self) -> str:
        """The console's address for devices; "" while it has none."""
        with suppress(OSError):
            return (self._folder / _URL).read_text()
        return ""

    @property
    def fingerprint(self) -> str:
        """SHA-256 of the console's certificate, which a browser shows as well."""
        certificate = x509.load_pem_x509_certificate((self._folder / "console.pem").read_bytes())
        return certificate.fingerprint(hashes.SHA256()).hex(":").upper()

    def invite(self, role: DeviceRole) -> str:
        """Return an address that admits one device, within 10 minutes."""
        code = secrets.token_urlsafe(12)
        write_private(self._folder / f"{_INVITED}{_digest(code)}", role.encode())
        return f"{self.url}?code={code}"

    def welcome(self, scope: Mapping[str, Any]) -> bytes:
        """Return the cookie for a request with a fresh code, which is thereby used up; else b"".

        It replaces the rights that the device had.
        """
        query = parse_qs(scope["query_string"].decode("latin-1"))
        path = self._folder / f"{_INVITED}{_digest(query.get('code', [''])[0])}"
        try:
            # In both directions: a clock that was set back must not keep an invitation alive.
            fresh = abs(time.time() - path.stat().st_mtime) < _INVITATION_LIVES_S
            role = path.read_bytes()
            path.unlink()  # if two show it at once, one finds it gone
        except OSError:
            return b""
        if not fresh:
            return b""
        token = secrets.token_urlsafe(24)
        write_private(self._folder / f"{_KNOWN}{_digest(token)}", role)
        self._entry(scope).unlink(missing_ok=True)
        return f"{_cookie_name(scope)}={token}; Secure; HttpOnly; SameSite=Strict; Path=/".encode()

    def role_of(self, scope: Mapping[str, Any]) -> DeviceRole | None:
        """Return the role of the device that sent a request, None if unknown."""
        with suppress(OSError, ValueError):
            return DeviceRole(self._entry(scope).read_text())
        return None

    def knows(self, scope: Mapping[str, Any]) -> bool:
        """Return whether a device that was let in has its rights still, neither invited anew nor uninvited since.

        A folder that went with a dead supervisor withdraws nothing: stops of a console that lives on are wanted then.
        """
        return self._entry(scope).exists() or not self._folder.exists()

    def uninvite(self) -> int:
        """Withdraw the rights of all devices, and all invitations; returns how many there were."""
        entries = [path for kind in (_INVITED, _KNOWN) for path in self._folder.glob(f"{kind}*")]
        for path in entries:
            path.unlink(missing_ok=True)
        return len(entries)

    def _entry(self, scope: Mapping[str, Any]) -> Path:
        return self._folder / f"{_KNOWN}{_digest(cookie_of(scope, _cookie_name(scope)))}"


def _cookie_name(scope: Mapping[str, Any]) -> str:
    return f"__Host-skein-{port_of(scope)}"


def _digest(secret: str) -> str:
    return hashlib.sha256(secret.encode()).hexdigest()
