"""Logging in by Digest, as most IP cameras want it: the answer to a challenge. Pure.

WIRE: RFC 7616, and 2617 where a camera names no `qop`.
"""

import hashlib
import re
from dataclasses import dataclass

_LINE = re.compile(rb"^www-authenticate:[^\r\n]*\bdigest[ \t]+([^\r\n]+)", re.IGNORECASE | re.MULTILINE)
_PAIR = re.compile(r'([a-z]+)[ \t]*=[ \t]*(?:"((?:[^"\\]|\\.)*)"|([^\s,]+))', re.IGNORECASE)
_HASHES = {"MD5": hashlib.md5, "SHA-256": hashlib.sha256}


@dataclass(frozen=True, slots=True)
class Challenge:
    """A camera's authentication challenge; algorithm: MD5 or SHA-256; qop: whether it wants that of `auth`."""

    realm: str
    nonce: str
    opaque: str = ""
    algorithm: str = ""
    qop: bool = False


def challenge_of(head: bytes) -> Challenge | None:
    """Return the first challenge in the head of an answer that can be answered, or None."""
    return next((found for line in _LINE.findall(head) if (found := _challenge(line.decode("latin-1")))), None)


def _challenge(text: str) -> Challenge | None:
    values = {name.lower(): quoted or bare for name, quoted, bare in _PAIR.findall(text)}
    algorithm = values.get("algorithm", "").upper()
    words = [word.strip().lower() for word in values.get("qop", "").split(",")]
    usable = algorithm in ("", *_HASHES) and ("auth" in words or not values.get("qop"))
    if not usable or "nonce" not in values:
        return None
    return Challenge(values.get("realm", ""), values["nonce"], values.get("opaque", ""), algorithm, "auth" in words)


def authorization(challenge: Challenge, login: str, path: str, client_nonce: str) -> str:
    """Return the value of the header `Authorization` for GET of a path; login: "user:password"."""
    user, _, password = login.partition(":")
    algorithm, nonce = _HASHES[challenge.algorithm or "MD5"], challenge.nonce

    def digest(*parts: str) -> str:
        return algorithm(":".join(parts).encode()).hexdigest()

    secret, asked = digest(user, challenge.realm, password), digest("GET", path)
    counted = ("00000001", client_nonce, "auth") if challenge.qop else ()
    quoted = {"username": user, "realm": challenge.realm, "nonce": nonce, "uri": path}
    quoted["response"] = digest(secret, nonce, *counted, asked)
    if challenge.opaque:
        quoted["opaque"] = challenge.opaque
    fields = [f'{name}="{value}"' for name, value in quoted.items()]
    if challenge.algorithm:
        fields.append(f"algorithm={challenge.algorithm}")
    if challenge.qop:
        fields += ["qop=auth", "nc=00000001", f'cnonce="{client_nonce}"']
    return "Digest " + ", ".join(fields)
