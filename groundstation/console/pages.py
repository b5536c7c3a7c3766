"""The page's files, read once from the package: other paths do not exist."""

from dataclasses import dataclass
from importlib import resources
from importlib.resources.abc import Traversable

_TYPES = {
    "html": "text/html; charset=utf-8",
    "css": "text/css; charset=utf-8",
    "js": "text/javascript; charset=utf-8",
    "svg": "image/svg+xml",
    "txt": "text/plain; charset=utf-8",
}
_TOKEN, _RUN = b"@@TOKEN@@", b"@@RUN@@"


@dataclass(frozen=True, slots=True)
class StaticFile:
    """Bytes and their media type."""

    content: bytes
    media_type: str


def load_pages(token: str, run: str) -> dict[str, StaticFile]:
    """Return all files by their path on the server; the page holds the token for commands and the run's identity."""
    files = files_of("groundstation.console")
    index = files.pop("/index.html")
    content = index.content.replace(_TOKEN, token.encode()).replace(_RUN, run.encode())
    files["/"] = StaticFile(content, index.media_type)
    return files


def files_of(package: str) -> dict[str, StaticFile]:
    """Return the files in the folder `static` of a package, by their path on the server."""
    return dict(_walk(resources.files(package) / "static", ""))


def _walk(folder: Traversable, path: str) -> list[tuple[str, StaticFile]]:
    found = []
    for entry in sorted(folder.iterdir(), key=lambda entry: entry.name):
        if entry.is_dir():
            found += _walk(entry, f"{path}/{entry.name}")
        elif (kind := _TYPES.get(entry.name.rpartition(".")[2])) is not None:
            found.append((f"{path}/{entry.name}", StaticFile(entry.read_bytes(), kind)))
    return found
