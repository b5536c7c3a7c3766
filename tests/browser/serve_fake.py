"""Starts the console process as the supervisor does.

By hand, to work on the page: `python tests/browser/serve_fake.py [PORT]`, then open the address it prints.
"""

import subprocess
import sys
from pathlib import Path
from typing import Any

import msgspec
from fake_flight import FakeFlight

from groundstation.process.child import ChildSpec
from groundstation.settings.load import load_field

ROOT = Path(__file__).parents[2]


def field_json(port: int, name: str = "lab") -> dict[str, Any]:
    field = load_field(ROOT / "config" / f"{name}.yaml", [f"console.port={port}"])
    return dict(field.model_dump(mode="json"))


def start_console(
    endpoint: str, port: int, truth: bool = True, loud: bool = False, field: str = "lab", run: str = "run-1"
) -> "subprocess.Popen[bytes]":
    section = {"field": field_json(port, field), "run_dir": run, "truth": truth}
    spec = ChildSpec("console", "console", endpoint, "lab", section=msgspec.json.encode(section).decode())
    process = subprocess.Popen(
        [sys.executable, "-m", "groundstation.process.entry", "console", "groundstation.console.process:run"],
        stdin=subprocess.PIPE,
        stderr=None if loud else subprocess.DEVNULL,
    )
    assert process.stdin is not None
    process.stdin.write(msgspec.json.encode(spec))
    process.stdin.close()
    return process


if __name__ == "__main__":
    fake = FakeFlight()
    fake.start()
    served = start_console(fake.endpoint, int(sys.argv[1]) if len(sys.argv) > 1 else 8765, loud=True)
    try:
        served.wait()
    except KeyboardInterrupt:
        served.terminate()
    finally:
        fake.stop()
