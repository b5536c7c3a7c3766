"""Cost of showing a flight to ROS 2: the real `view --ros2` between the router of a made-up run and a second one."""

import contextlib
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec

from groundstation.bench.console import cpu_s, field_of
from groundstation.bus.zenoh_bus import open_router
from groundstation.console.server import HOST
from groundstation.errors import GroundStationError
from groundstation.process.ports import free_port
from groundstation.recording.synthetic import DRONES, SITE, SyntheticRun, write_run
from groundstation.supervisor import runtime_file
from groundstation.supervisor.runtime_file import ProcessRecord, RuntimeRecord
from groundstation.time_units import NS_PER_S

_START_S, _WARM_S = 30.0, 2.0
_TOPICS, _LONGEST_S = 20, 900.0
_TURNS = 10_000_000


def measure(seconds: float) -> dict[str, Any]:
    """Return the figures of a view of a made-up run of two drones with the topics, rates and sizes of the demo's."""
    heard: Counter[str] = Counter()
    with _shown(heard) as (process, router), _talking(router):
        _until(lambda: len(heard) >= _TOPICS, process)
        time.sleep(_WARM_S)
        begin_s, before = cpu_s(process.pid), heard.total()
        time.sleep(seconds)
        used_s, count = cpu_s(process.pid) - begin_s, heard.total() - before
    return {
        "cpu_percent_of_core": round(100.0 * used_s / seconds, 2),
        "messages_per_s": round(count / seconds, 1),
        "us_per_message": round(1e6 * used_s / count, 1),
        "topics": len(heard),
        "python_loop_s": python_loop_s(),
    }


@contextlib.contextmanager
def _talking(router: Any) -> Iterator[None]:
    """Play the made-up run in real time."""
    over = threading.Event()
    player = threading.Thread(target=_play, args=(router, over), daemon=True)
    player.start()
    try:
        yield
    finally:
        over.set()
        player.join(5)


def _play(router: Any, over: threading.Event) -> None:
    began_s = time.monotonic()
    for at_ns, sample in SyntheticRun().samples(0.0, _LONGEST_S):
        late_s = time.monotonic() - began_s - at_ns / NS_PER_S
        if over.wait(-late_s) if late_s < 0.0 else over.is_set():
            break
        router.put(sample.key, sample.payload, attachment=sample.attachment or None)


def python_loop_s() -> float:
    """Return the time of 10 million turns of an empty loop [s]: a measure of this machine's speed and load."""
    begin_s = time.process_time()
    for _ in range(_TURNS):
        pass
    return round(time.process_time() - begin_s, 2)


@contextlib.contextmanager
def _shown(heard: Counter[str]) -> Iterator[tuple["subprocess.Popen[str]", Any]]:
    """Start a view of a run that has a router only; heard: the messages that reach the ROS 2 side, by their key."""
    ours, theirs = (f"tcp/{HOST}:{free_port()}" for _ in range(2))
    with contextlib.ExitStack() as stack:
        router, ros = open_router(ours), open_router(theirs)
        stack.callback(router.close)
        stack.callback(ros.close)
        ros.declare_subscriber("0/**", lambda sample: heard.update([str(sample.key_expr)]))
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        name = _noted(folder, ours)
        command = [sys.executable, "-m", "groundstation", "view", "--ros2", "--run", name, "--router", theirs]
        yield stack.enter_context(_process(command, {**os.environ, "XDG_RUNTIME_DIR": str(folder)})), router


def _noted(folder: Path, endpoint: str) -> str:
    """Write the runtime file and the recording of a run that this process plays, by which a view finds it."""
    field = field_of(DRONES, free_port())
    write_run(folder / "run", msgspec.json.encode(field), 0.1)
    here = ProcessRecord("supervisor", "supervisor", os.getpid(), runtime_file.start_time(os.getpid()) or 0)
    record = RuntimeRecord(SITE, "lab", endpoint, str(folder / "run"), "", DRONES, here, ())
    (folder / "skein").mkdir(mode=0o700)
    (folder / "skein" / f"{record.name}.json").write_bytes(msgspec.json.encode(record))
    return record.name


@contextlib.contextmanager
def _process(command: list[str], environment: dict[str, str]) -> Iterator["subprocess.Popen[str]"]:
    pipe = subprocess.PIPE
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=pipe, text=True)
    try:
        yield process
    finally:
        process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.communicate(timeout=10)
        process.kill()
        process.wait(10)


def _until(true: Callable[[], bool], process: "subprocess.Popen[str]") -> None:
    deadline_s = time.monotonic() + _START_S
    while not true():
        if process.poll() is not None:
            raise GroundStationError(f"the view has ended: {process.communicate()[1].strip()[-500:]}")
        if time.monotonic() > deadline_s:
            raise GroundStationError(f"the view showed nothing within {_START_S:g} s")
        time.sleep(0.1)
