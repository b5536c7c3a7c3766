"""Third-party programs in environments of their own (`make interop`), and emulated drones in a separate process."""

import itertools
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NoReturn

import pytest

ROOT = Path(__file__).parents[2]
HERE = Path(__file__).parent
INTEROP = ROOT / ".interop"
_addresses = itertools.count(1)


class Hangar:
    """Emulated drones run by `python -m sim_bridge.standalone`; kind: of MAVLink vehicle, "" for AR.Drones."""

    def __init__(self, count: int, *options: str, kind: str = "") -> None:
        pid = os.getpid()
        net = f"127.{60 + pid % 60}.{pid // 60 % 250}"
        self.addresses = [f"{net}.{next(_addresses)}" for _ in range(count)]
        options = tuple(o for o in options if o != "--video") + (() if "--video" in options else ("--no-video",))
        command = [
            sys.executable,
            "-m",
            "sim_bridge.standalone",
            *(f"{kind}@{address}" if kind else address for address in self.addresses),
            "--truth",
            "--seconds",
            "170",
            *options,
        ]
        self._output = tempfile.TemporaryFile("w+")  # noqa: SIM115  # a pipe would be full before anybody reads
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, cwd=ROOT, stdout=self._output, stderr=pipe, text=True)
        assert self._process.stderr is not None
        line = self._process.stderr.readline()
        assert line.startswith("serving"), line + self._process.stderr.read()

    def stop(self) -> list[dict[str, Any]]:
        """Stop the drones and return their true states, one dict by address each 0.1 s."""
        if self._process.poll() is None:
            self._process.terminate()
        errors = self._process.communicate(timeout=20)[1]
        assert self._process.returncode == 0, errors
        self._output.seek(0)
        return [json.loads(line)["drones"] for line in self._output if line.endswith("}\n")]

    def close(self) -> None:
        self.stop()
        self._output.close()


@pytest.fixture
def hangar() -> Iterator[Any]:
    opened: list[Hangar] = []

    def open_hangar(count: int, *options: str, kind: str = "") -> Hangar:
        opened.append(Hangar(count, *options, kind=kind))
        return opened[-1]

    yield open_hangar
    for each in opened:
        each.close()


def interpreter_of(package: str, absent: Callable[[str], NoReturn]) -> Path:
    """Return the Python of a package's own environment."""
    python = INTEROP / package / "bin" / "python"
    if not python.exists():
        absent(f"PyPI {package} is not installed: run `make interop`")
    return python


@pytest.fixture
def interpreter(absent: Callable[[str], NoReturn]) -> Callable[[str], Path]:
    return lambda package: interpreter_of(package, absent)


class Programs:
    """Starts clients and collects each one's line of JSON."""

    def __init__(self, absent: Callable[[str], NoReturn]) -> None:
        self._absent = absent
        self._running: list[subprocess.Popen[str]] = []

    def node(self, script: str, *arguments: object, package: str = "ar-drone") -> subprocess.Popen[str]:
        modules = INTEROP / "node" / "node_modules"
        if shutil.which("node") is None:
            self._absent("node is not installed: run `make interop`")
        if not (modules / package).is_dir():
            self._absent(f"npm {package} is not installed: run `make interop`")
        binaries = INTEROP / "bin"
        path = f"{binaries}{os.pathsep}{os.environ['PATH']}"
        environment = {**os.environ, "NODE_PATH": str(modules), "NODE_NO_WARNINGS": "1", "PATH": path}
        return self._start(["node", str(HERE / script), *map(str, arguments)], environment)

    def pyardrone(self, script: str, *arguments: object) -> subprocess.Popen[str]:
        return self.python("pyardrone", script, *arguments)

    def python(self, package: str, script: str, *arguments: object) -> subprocess.Popen[str]:
        python = interpreter_of(package, self._absent)
        return self._start([str(python), str(HERE / script), *map(str, arguments)], dict(os.environ))

    def _start(self, command: list[str], environment: dict[str, str]) -> subprocess.Popen[str]:
        pipe = subprocess.PIPE
        self._running.append(subprocess.Popen(command, env=environment, stdout=pipe, stderr=pipe, text=True))
        return self._running[-1]

    @staticmethod
    def result(process: subprocess.Popen[str]) -> dict[str, Any]:
        output, errors = process.communicate(timeout=100)
        assert process.returncode == 0, output + errors
        result: dict[str, Any] = json.loads(output.strip().splitlines()[-1])
        assert not result.get("late"), result
        return result

    def close(self) -> None:
        for process in self._running:
            if process.poll() is None:
                process.kill()
                process.communicate()


@pytest.fixture
def programs(absent: Callable[[str], NoReturn]) -> Iterator[Programs]:
    made = Programs(absent)
    yield made
    made.close()
