"""Write the lists that make installs: each pin of constraints.txt with the hashes of all files of its release.

`pin_hashes.py`, after a change of a pin or of what is needed; needs uv. requirements/run.txt is the product and what
builds it, requirements/EXTRA.txt what an extra adds, tests/interop/*.txt clients of others. No list has an address.
"""

import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[1]
EXTRAS = ("test", "test-slow", "check", "docs")
OLDEST_PYTHON = "3.11"
_PIN = re.compile(r"^\S+==\S+.*(?:\n    --hash=.*)*\n", re.M)


def resolved(*arguments: str, text: str = "") -> list[str]:
    """Return the pins, with their hashes, that uv resolves requirements to, for every platform."""
    options = ("--quiet", "--universal", "--generate-hashes", "--no-header", "--no-annotate")
    command = ["uv", "pip", "compile", *options, "--python-version", OLDEST_PYTHON, *arguments]
    done = subprocess.run(command, cwd=ROOT, input=text, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"uv cannot resolve {' '.join(arguments)}:\n{done.stderr}")
    return _PIN.findall(done.stdout)


def write(path: Path, heading: Sequence[str], pins: Sequence[str]) -> None:
    """Write a list, its heading first."""
    path.parent.mkdir(exist_ok=True)
    path.write_text("".join([*heading, *pins]), encoding="utf-8")


def main() -> None:
    """Write all lists."""
    if shutil.which("uv") is None:
        raise SystemExit("uv is missing: pipx install uv")
    builders = "\n".join(
        tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["build-system"]["requires"]
    )
    pinned = ("--constraint", "constraints.txt")
    run = resolved("pyproject.toml", "-", *pinned, text=builders)
    made = ["# Made by .ci/pin_hashes.py from constraints.txt.\n"]
    write(ROOT / "requirements" / "run.txt", made, run)
    for extra in EXTRAS:
        added = [pin for pin in resolved("pyproject.toml", "--extra", extra, *pinned) if pin not in run]
        write(ROOT / "requirements" / f"{extra}.txt", made, added)
    for path in sorted((ROOT / "tests" / "interop").glob("*.txt")):
        lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
        write(path, [line for line in lines if line.startswith("#")], resolved("--no-deps", str(path)))


if __name__ == "__main__":
    sys.exit(main())
