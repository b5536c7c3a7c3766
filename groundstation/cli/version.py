"""`groundstation version`: versions of program and libraries, for a bug report."""

import json
import platform
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as version_of
from pathlib import Path

import click

_LIBRARIES = ("eclipse-zenoh", "msgspec", "numpy", "numba", "scipy", "opencv-python-headless", "av", "mcap", "pydantic")


def versions() -> dict[str, str]:
    """Return the versions of this program, Python and the main libraries, without importing them."""
    found = {"skein-groundstation": _installed("skein-groundstation"), "python": platform.python_version()}
    return found | {name: _installed(name) for name in _LIBRARIES}


def _installed(name: str) -> str:
    try:
        return version_of(name)
    except PackageNotFoundError:
        return "not installed"


@click.command(epilog="Example: groundstation version --json")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def version(as_json: bool) -> None:
    """Print the versions of this program and of the libraries that matter."""
    found = versions() | {"location": str(Path(__file__).resolve().parents[2])}
    if as_json:
        click.echo(json.dumps(found))
    else:
        width = max(map(len, found))
        click.echo("\n".join(f"{name:{width}}  {value}" for name, value in found.items()))
