"""Access control: same-origin pages of this host's own user, of a user with the code, of invited devices."""

import hmac
import os
from collections import Counter
from collections.abc import Awaitable, Callable, Mapping
from typing import Any
from urllib.parse import parse_qs, urlsplit

from groundstation.console.cookies import cookie_of, port_of
from groundstation.console.devices import DeviceRole, Devices
from groundstation.process.ports import user_of
from groundstation.report.page import inline

_LOOPBACK_NAMES = frozenset({"127.0.0.1", "localhost", "::1"})
_SAFE_METHODS = frozenset({"GET", "HEAD"})
ROLE, KEEPS_ROLE = "skein.role", "skein.keeps_role"
# Pages keep the report of their run, and show it under the policy of the console.
_SCRIPTS = f"'self' {inline.source_of(inline.script())}"
_STYLES = f"'self' {inline.source_of(inline.style())}"
Asgi = Callable[[Any, Any, Any], Awaitable[None]]


def refusal(scope: Mapping[str, Any], names: frozenset[str] = _LOOPBACK_NAMES) -> str:
    """Return "" for a permitted request, else the reason; names: the names of this server."""
    headers = {name: value.decode("latin-1") for name, value in scope["headers"]}
    host = headers.get(b"host", "")
    # A foreign name that resolves to this host (DNS rebinding) would make a foreign page "same origin".
    if _hostname(f"http://{host}") not in names:
        return "the Host header names no address of this server"
    if scope["type"] == "websocket":
        # Browsers let any page open a WebSocket to anywhere, and always send the origin of that page.
        page = f"{scope['scheme'].replace('ws', 'http')}://{host}"
        return "" if headers.get(b"origin", "") == page else "the Origin is not this page"
    if scope["method"] not in _SAFE_METHODS:
        return "only GET"
    return "another site's request" if headers.get(b"sec-fetch-site", "none") == "cross-site" else ""


def _hostname(url: str) -> str:
    try:
        return urlsplit(url).hostname or ""
    except ValueError:
        return ""


def security_headers(host: str) -> list[tuple[bytes, bytes]]:
    """Return the headers of every answer: nothing from elsewhere, no framing, no guessing of types, no copies kept."""
    policy = (
        f"default-src 'none'; script-src {_SCRIPTS}; style-src {_STYLES}; img-src 'self' blob: data:; "
        f"connect-src 'self' ws://{host} wss://{host}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
    return [
        (b"content-security-policy", policy.encode("latin-1")),
        (b"x-content-type-options", b"nosniff"),
        (b"x-frame-options", b"DENY"),
        (b"referrer-policy", b"no-referrer"),
        (b"cross-origin-resource-policy", b"same-origin"),
        (b"cross-origin-opener-policy", b"same-origin"),
        (b"cache-control", b"no-store"),
    ]


class Door:
    """Access check: programs of this server's user are admitted; those of other users must show a code.

    code: shown by others, once as `/?code=`, then as a cookie; code_file: where its owner finds it.
    """

    names = _LOOPBACK_NAMES

    def __init__(self, code: str, code_file: str = "") -> None:
        self._code, self._file = code, code_file

    def admits(self, scope: Mapping[str, Any]) -> DeviceRole | None:
        """Return full rights for a request from our own user, or with the code; None for others."""
        shown = cookie_of(scope, self._cookie_name(scope)).encode()
        known = self._user(scope) in (os.getuid(), 0) or hmac.compare_digest(shown, self._code.encode())
        return DeviceRole.COMMAND if known else None

    def welcome(self, scope: Mapping[str, Any]) -> bytes:
        """Return the cookie that replaces the code from then on, if the request's address has the code; else b""."""
        query = parse_qs(scope["query_string"].decode("latin-1"))
        if not hmac.compare_digest(query.get("code", [""])[0].encode(), self._code.encode()):
            return b""
        return f"{self._cookie_name(scope)}={self._code}; HttpOnly; SameSite=Strict; Path=/".encode()

    def keeps_role(self, scope: Mapping[str, Any]) -> bool:
        """Return True: users of this machine are admitted for as long as they stay."""
        return True

    @property
    def reason(self) -> str:
        """Return the message for a refused user."""
        place = f" It is in {self._file}." if self._file else ""
        return f"another user of this machine runs this console; ask for its code and open /?code=CODE.{place}"

    def is_other_user(self, scope: Mapping[str, Any]) -> bool:
        """Return whether a request is known to be another user's: its sender has not closed it meanwhile."""
        return self._user(scope) not in (None, os.getuid(), 0)

    def _user(self, scope: Mapping[str, Any]) -> int | None:
        client, server = scope.get("client"), scope.get("server")
        if client is None or server is None:
            return None
        return user_of((client[0], client[1]), (server[0], server[1]))

    @staticmethod
    def _cookie_name(scope: Mapping[str, Any]) -> str:
        return f"skein_{port_of(scope)}"


class DeviceDoor:
    """Admits invited devices, by a code and then by a cookie; address: where they connect."""

    def __init__(self, devices: Devices, address: str) -> None:
        self._devices, self.names = devices, frozenset({address})

    def admits(self, scope: Mapping[str, Any]) -> DeviceRole | None:
        """Return the role of the device that sent a request, None if it is not admitted."""
        return self._devices.role_of(scope)

    def welcome(self, scope: Mapping[str, Any]) -> bytes:
        """Return the cookie for a request with a valid code, else b""."""
        return self._devices.welcome(scope)

    def is_other_user(self, scope: Mapping[str, Any]) -> bool:
        """Return True: a device is none of ours before it is admitted."""
        return True

    def keeps_role(self, scope: Mapping[str, Any]) -> bool:
        """Return whether a device has the role still with which it was admitted."""
        return self._devices.knows(scope)

    @property
    def reason(self) -> str:
        """Return the message for a refused device."""
        return "this console lets invited devices in: groundstation console --invite stop"


class Gate:
    """ASGI middleware that answers 403 to requests that are not permitted.

    refused: counts of "other_site" (`refusal` has a reason), "other_user" (the door does not admit them) and "left"
    (nor those, whose senders had left).
    """

    def __init__(self, app: Asgi, door: Door | DeviceDoor) -> None:
        self._app, self._door = app, door
        self.refused: Counter[str] = Counter()

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            return
        kind, reason = "other_site", refusal(scope, self._door.names)
        # Before who is asked whether it is known: a device is invited anew to do more, or less.
        if not reason and scope["type"] == "http" and (cookie := self._door.welcome(scope)):
            await _answer(send, 303, [(b"location", b"/"), (b"set-cookie", cookie)], b"")
            return
        role = None if reason else self._door.admits(scope)
        if not reason and role is None:
            kind, reason = "other_user" if self._door.is_other_user(scope) else "left", self._door.reason
        if reason:
            self.refused[kind] += 1
            await _answer_403(scope, receive, send, reason)
            return
        host = dict(scope["headers"])[b"host"].decode("latin-1")

        async def send_with_headers(message: Any) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message["headers"], *security_headers(host)]
            await send(message)

        rights = {ROLE: role, KEEPS_ROLE: lambda: self._door.keeps_role(scope)}
        await self._app(scope | rights, receive, send_with_headers)


async def _answer_403(scope: Any, receive: Any, send: Any, reason: str) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": reason})
        return
    headers = [(b"content-type", b"text/plain"), (b"x-content-type-options", b"nosniff")]
    await _answer(send, 403, headers, reason.encode())


async def _answer(send: Any, status: int, headers: list[tuple[bytes, bytes]], body: bytes) -> None:
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
