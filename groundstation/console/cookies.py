"""The cookie of a request."""

from collections.abc import Mapping
from contextlib import suppress
from http.cookies import CookieError, SimpleCookie
from typing import Any


def cookie_of(scope: Mapping[str, Any], name: str) -> str:
    """Return a cookie of a request, "" if it has none of that name."""
    cookies = SimpleCookie()
    with suppress(CookieError):
        cookies.load(b"; ".join(value for key, value in scope["headers"] if key == b"cookie").decode("latin-1"))
    return cookies[name].value if name in cookies else ""
