"""Who is let in: pages of this server in a browser on this host, and nobody that another site sent."""

from collections.abc import Awaitable, Callable, Mapping
from typing import Any
from urllib.parse import urlsplit

_LOOPBACK_NAMES = frozenset({"127.0.0.1", "localhost", "::1"})
_SAFE_METHODS = frozenset({"GET", "HEAD"})
Asgi = Callable[[Any, Any, Any], Awaitable[None]]


def refusal(scope: Mapping[str, Any]) -> str:
    """Return "" for a request that may come in, else the reason."""
    headers = {name: value.decode("latin-1") for name, value in scope["headers"]}
    host = headers.get(b"host", "")
    # A foreign name that resolves to this host (DNS rebinding) would make a foreign page "same origin".
    if _hostname(f"http://{host}") not in _LOOPBACK_NAMES:
        return "the Host header names no loopback address"
    if scope["type"] == "websocket":
        # Browsers let any page open a WebSocket to anywhere, and always say which page it was.
        return "" if headers.get(b"origin", "") == f"http://{host}" else "the Origin is not this page"
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
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
        f"connect-src 'self' ws://{host}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
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


class Gate:
    """ASGI middleware that answers 403 to everything `refusal` has a reason for; counts them in `refused`."""

    def __init__(self, app: Asgi) -> None:
        self._app = app
        self.refused = 0

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Let a request in, or not."""
        if scope["type"] not in ("http", "websocket"):
            return
        reason = refusal(scope)
        if reason:
            self.refused += 1
            await _answer_403(scope, receive, send, reason)
            return
        host = dict(scope["headers"])[b"host"].decode("latin-1")

        async def send_with_headers(message: Any) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message["headers"], *security_headers(host)]
            await send(message)

        await self._app(scope, receive, send_with_headers)


async def _answer_403(scope: Any, receive: Any, send: Any, reason: str) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": reason})
        return
    headers = [(b"content-type", b"text/plain"), (b"x-content-type-options", b"nosniff")]
    await send({"type": "http.response.start", "status": 403, "headers": headers})
    await send({"type": "http.response.body", "body": reason.encode()})
