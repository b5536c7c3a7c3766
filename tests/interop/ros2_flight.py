"""A flight seen by a foreign ROS 2 client through `view --ros2`, beside two nodes that talk to each other.

Run in a network namespace of its own, as root there, since the port of ROS 2's router may be taken outside: `unshare
--user --map-root-user --net python ros2_flight.py PYTHON FOLDER`; PYTHON: interpreter of the foreign programs. Prints a
line of JSON: the client's topics and decoded messages, and the number of messages between the nodes before, during and
after.
"""

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "sitl"))

from sitl_run import COMMAND, SitlRun

_NODES = Path(__file__).with_name("ros2_nodes.py")
_START_S, _TRACK_S, _SPAN_S, _WATCH_S, _LEAST = 30.0, 90.0, 2.0, 90.0, 16
_ORDER_S = 4.0  # between orders, each of which starts an interpreter that a slow machine needs for its drones


class Stage:
    """Processes with an output file each, all ended at the end."""

    def __init__(self, python: str, folder: Path, stack: ExitStack) -> None:
        self._python, self._folder, self._stack = python, folder, stack

    def node(self, *arguments: str) -> "subprocess.Popen[bytes]":
        return self.start(arguments[0], [self._python, str(_NODES), *arguments])

    def start(self, name: str, command: list[str]) -> "subprocess.Popen[bytes]":
        with (self._folder / f"{name}.txt").open("wb") as sink:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=sink, stderr=subprocess.STDOUT)
        self._stack.callback(_end, process)
        return process

    def lines(self, name: str) -> list[str]:
        return (self._folder / f"{name}.txt").read_text().splitlines()

    def until(self, name: str, count: int = 1) -> None:
        deadline_s = time.monotonic() + _START_S
        while len(self.lines(name)) < count:
            assert time.monotonic() < deadline_s, f"{name} said only {self.lines(name)}"
            time.sleep(0.1)

    def heard(self) -> int:
        """Return the number of messages that the listener receives in a span of time."""
        before = len(self.lines("listener"))
        time.sleep(_SPAN_S)
        return len(self.lines("listener")) - before


def _end(process: "subprocess.Popen[bytes]") -> None:
    for number in (signal.SIGINT, signal.SIGKILL):
        if process.poll() is None:
            process.send_signal(number)
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                continue


def _watched(stage: Stage) -> dict[str, Any]:
    """Return the client's result; each command makes an event, which an earlier subscriber sees on /rosout."""
    watcher = stage.node("watcher", str(_WATCH_S), str(_LEAST))
    end_s, turn = time.monotonic() + _WATCH_S, 0
    while watcher.poll() is None and time.monotonic() < end_s:
        subprocess.run([*COMMAND, ("hold", "resume")[turn % 2]], check=False, capture_output=True)
        turn += 1
        time.sleep(_ORDER_S)
    watcher.wait(30)
    found: dict[str, Any] = json.loads(stage.lines("watcher")[-1])
    return found


def main(python: str, folder: Path) -> None:
    """Print one line of JSON."""
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    os.environ["XDG_RUNTIME_DIR"] = str(folder)
    with ExitStack() as stack:
        stage = Stage(python, folder, stack)
        for name, lines in (("router", 1), ("talker", 0), ("listener", 10)):
            stage.node(name)
            stage.until(name, lines)
        # Flight quality is not judged here, so a busy machine skips the pre-flight checks.
        run = SitlRun(folder, "sitl", "lab", "--anyway", "--duration", "240")
        stack.callback(run.close)
        run.until(lambda: all(run.mode(name) == "TRACK" for name in run.record.drones), _TRACK_S, "all track")
        run.until(lambda: any(run.run_dir.glob("state*.mcap")), _START_S, "a recording, which has the field")
        told: dict[str, Any] = {"before": stage.heard()}
        view = stage.start("view", [*COMMAND, "view", "--ros2"])
        stage.until("view")
        told |= _watched(stage) | {"during": stage.heard()}
        _end(view)
        told |= {"after": stage.heard(), "view": stage.lines("view"), "code": view.returncode}
    print(json.dumps(told))


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
