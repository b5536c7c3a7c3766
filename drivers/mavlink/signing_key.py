"""The key of a signed link, from its file."""

import stat
from pathlib import Path

from groundstation.errors import DriverError


def read_key(path: str) -> bytes:
    """Return the 32 bytes of a key file, raw or as 64 hex digits; raises DriverError without naming the key."""
    try:
        mode = Path(path).stat().st_mode
        raw = Path(path).read_bytes()
    except OSError as error:
        raise DriverError(f"signing key {path}: {error.strerror}") from error
    if mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise DriverError(f"signing key {path}: others can read it (chmod 600 {path})")
    try:
        key = raw if len(raw) == 32 else bytes.fromhex(raw.decode("ascii").strip())
    except ValueError:
        key = b""
    if len(key) != 32:
        raise DriverError(f"signing key {path}: must hold 32 bytes, raw or as 64 hex digits")
    return key
