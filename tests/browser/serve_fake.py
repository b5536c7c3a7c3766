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


def many_drones(names: tuple[str, ...]) -> list[str]:
    """Return the settings that put so many drones into the lab."""
    told = []
    for place, name in enumerate(names):
        address, pad = f"192.168.1.{11 + place}", [place % 4 - 1.5, 0.6 - 1.2 * (place // 4)]
        film, marker = f"{{source: 'ardrone://{address}'}}", f"{{code: {6 + place}}}"
        told.append(f"{name}: {{type: ardrone_2, address: {address}, marker: {marker}, camera: {film}, pad_m: {pad}}}")
    heights = [[round(2.6 - 1.6 * level / count, 2) for level in range(count)] for count in range(1, len(names) + 1)]
    return [f"drones={{{', '.join(told)}}}", f"planner.level_heights_m={heights}"]


def field_json(port: int, name: str = "lab", sets: list[str] | None = None) -> dict[str, Any]:
    field = load_field(ROOT / "config" / f"{name}.yaml", [f"console.port={port}", *(sets or [])])
    return dict(field.model_dump(mode="json"))


def start_console(
    endpoint: str,
    port: int,
    truth: bool = True,
    loud: bool = False,
    field: str = "lab",
    run: str = "run-1",
    sets: list[str] | None = None,
) -> "subprocess.Popen[bytes]":
    section = {"field": field_json(port, field, sets), "run_dir": run, "truth": truth}
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
