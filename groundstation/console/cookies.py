"""The cookie of a request."""

from collections.abc import Mapping
from typing import Any


def cookie_of(scope: Mapping[str, Any], name: str) -> str:
    """Return a cookie of a request, "" if it has none of that name.

    Programs on other ports of a host add theirs, of which any may be odd: they must not hide ours, as they do from the
    standard library.
    """
    header = b";".join(value for key, value in scope["headers"] if key == b"cookie").decode("latin-1")
    pairs = (each.partition("=") for each in header.split(";"))
    return next((value.strip() for key, _, value in pairs if key.strip() == name), "")


def port_of(scope: Mapping[str, Any]) -> int:
    """Return the port of a request, for the name of a cookie: those of one host are sent to all of its ports."""
    return int((scope.get("server") or ("", 0))[1] or 0)
