"""Fixtures for browser tests: a whole SITL run of emulated drones and its console."""

import json
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from seen_page import eventually
from serve_fake import field_json

from groundstation.supervisor import runtime_file

FEW_PICTURES = Path(__file__).parents[1] / "fixtures" / "few_pictures.yaml"
NETWORK = "127.0.0.2"
"""Where the run's console also serves invited devices."""


def answers(url: str) -> bool:
    """Return whether a console serves at this address."""
    with suppress(OSError), urllib.request.urlopen(f"{url}token", timeout=2):
        return True
    return False


@pytest.fixture(scope="module")
def kernels() -> None:
    """Compile the tracker's kernels before the run: on a busy machine that takes longer than the run waits."""
    script = (
        "import sys; from groundstation.process import numba_cache; numba_cache.activate();"
        "from groundstation.field.resolved import field_from_json; from groundstation.runtime.warm_up import warm_up;"
        "warm_up(field_from_json(sys.stdin.buffer.read()))"
    )
    field = json.dumps(field_json(8765)).encode()
    subprocess.run([sys.executable, "-c", script], input=field, timeout=280, check=True)


@pytest.fixture
def live(
    kernels: None, free_port: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[runtime_file.RuntimeRecord]:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    arguments = ["sitl", "lab", "--headless", "--duration", "120", "--output", str(tmp_path)]
    arguments += ["--set", f"console.port={free_port}", "--set", f"console.listen={NETWORK}"]
    arguments += ["--scenario", str(FEW_PICTURES)]
    process = subprocess.Popen([sys.executable, "-m", "groundstation", *arguments], stdout=subprocess.DEVNULL)
    try:
        yield eventually(lambda: next(iter(runtime_file.live_records()), None), 60.0, "a run")
    finally:
        process.send_signal(signal.SIGINT)
        with suppress(subprocess.TimeoutExpired):
            process.wait(60)
        process.kill()
        process.wait(10)


@pytest.fixture
def served(live: runtime_file.RuntimeRecord, free_port: int) -> str:
    url = f"http://127.0.0.1:{free_port}/"
    eventually(lambda: answers(url), 30.0, "the run's console answers")  # a refused page reports that on its console
    return url
