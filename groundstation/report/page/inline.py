"""Style and script of reports, always the same, so that the console can permit just these two by their hashes."""

import base64
import hashlib
from importlib.resources import files

_HERE = files("groundstation.report.page")
_VENDOR = files("groundstation.console") / "static" / "vendor"


def style() -> str:
    """Return the content of a report's style element."""
    return (_VENDOR / "uPlot.min.css").read_text("utf-8") + (_HERE / "page.css").read_text("utf-8")


def script() -> str:
    """Return the content of a report's script element."""
    return (_VENDOR / "uPlot.min.js").read_text("utf-8") + (_HERE / "page.js").read_text("utf-8")


def source_of(content: str) -> str:
    """Return the source expression that permits an inline element of this content in a content security policy."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()}'"
