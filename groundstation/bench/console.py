"""Cost and delay of the console: its real process, fed over a real router, with a client of the bench."""

import contextlib
import json
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any

import msgspec
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from groundstation.bench.console_feed import CAMERA, TalkingTeam
from groundstation.bus import clock
from groundstation.bus.api import Bus
from groundstation.bus.messages import Command
from groundstation.bus.topics import COMMAND
from groundstation.bus.zenoh_bus import open_bus, open_router
from groundstation.console.section import enough_hz, run_id
from groundstation.console.server import HOST, claim_port
from groundstation.errors import GroundStationError
from groundstation.field.resolved import ResolvedField
from groundstation.process.child import ChildSpec
from groundstation.process.ports import free_port

_WARM_S = 3.0
_START_S = 30.0
_ACK_EVERY = 4
_SITE = "lab"
_ORDERS, _BETWEEN_ORDERS_S = 60, 0.1


@dataclass
class Viewed:
    """Frames of one viewer with their times of arrival [ns], and the age of each estimate then [ms]."""

    frames: list[tuple[int, str | bytes]] = field(default_factory=list)
    latencies_ms: list[float] = field(default_factory=list)


def measure(seconds: float, drones: int, jpegs: list[bytes], browser: str = "") -> dict[str, Any]:
    """Return the figures; two cameras send the pictures in turn.

    browser: path of a Chromium that shows the page for as long once more, "" for none.
    """
    pictures = {CAMERA: jpegs, "drone_1_camera": jpegs[::-1]}
    names = tuple(f"drone_{number}" for number in range(1, drones + 1))
    with _served(names) as (process, url, endpoint):
        bus = open_bus(endpoint, _SITE, "bench", timeout_s=5.0)
        team = TalkingTeam(bus, names, pictures)
        team.start()
        try:
            with _page_of(url, list(pictures)) as page:
                watch(page, _WARM_S)
                begin_s = cpu_s(process.pid)
                viewed = watch(page, seconds)
                used_s = cpu_s(process.pid) - begin_s
                ordered = order_often(page, bus)
            shown = drawn(browser, url, seconds) if browser else {}
        finally:
            team.over.set()
            team.join(5)
            bus.close()
    if not viewed.latencies_ms:
        raise GroundStationError("the console said nothing of the team: is this machine too busy to start it?")
    return _summary(viewed, used_s, seconds) | ordered | {"peer": echo(viewed, seconds)} | shown


def _summary(viewed: Viewed, used_s: float, seconds: float) -> dict[str, Any]:
    texts = [frame for _, frame in viewed.frames if isinstance(frame, str)]
    late = sorted(viewed.latencies_ms)
    return {
        "cpu_percent_of_core": round(100.0 * used_s / seconds, 2),
        "frames_per_s": round(len(texts) / seconds, 1),
        "pictures_per_s": round((len(viewed.frames) - len(texts)) / seconds, 1),
        "kbyte_per_s": round(sum(len(frame) for _, frame in viewed.frames) / seconds / 1e3, 1),
        "estimate_to_socket_ms": _quantiles(late),
    }


def _quantiles(late_ms: list[float]) -> dict[str, float]:
    ordered = sorted(late_ms)
    return {"median": round(median(ordered), 1), "p99": round(ordered[int(0.99 * len(ordered))], 1)}


@contextlib.contextmanager
def _served(drones: tuple[str, ...]) -> Iterator[tuple["subprocess.Popen[bytes]", str, str]]:
    endpoint, port = f"tcp/{HOST}:{free_port()}", free_port()
    router = open_router(endpoint)
    field = field_of(drones, port)
    section = msgspec.json.encode({"field": field, "run_dir": "", "truth": True}).decode()
    enough = dict(enough_hz(_SITE, field.drones, field.tracked))
    spec = ChildSpec("console", "console", endpoint, _SITE, section=section, at_most_hz=enough)
    command = [sys.executable, "-m", "groundstation.process.entry", "console", "groundstation.console.process:run"]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.DEVNULL)
    try:
        assert process.stdin is not None
        process.stdin.write(msgspec.json.encode(spec))
        process.stdin.close()
        yield process, f"http://{HOST}:{port}/", endpoint
    finally:
        process.terminate()
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(10)
        process.kill()
        process.wait(10)
        router.close()


def field_of(drones: tuple[str, ...], port: int) -> ResolvedField:
    """Return the lab with a number of drones, further ones like its last."""
    from groundstation.settings.files import find_field
    from groundstation.settings.load import load_field
    from groundstation.settings.resolved import resolved_field

    lab = resolved_field(load_field(find_field("lab"), [f"console.port={port}"]))
    *_, like = lab.drones.values()
    return msgspec.structs.replace(lab, drones={name: lab.drones.get(name, like) for name in drones})


@contextlib.contextmanager
def _page_of(url: str, cameras: list[str]) -> Iterator[ClientConnection]:
    deadline_s = time.monotonic() + _START_S
    while True:
        try:
            with urllib.request.urlopen(f"{url}token", timeout=2) as answer:
                token = answer.read().decode()
            break
        except OSError:
            if time.monotonic() > deadline_s:
                raise GroundStationError(f"the console did not answer at {url} within {_START_S:g} s") from None
            time.sleep(0.1)
    origin = Origin(url.rstrip("/"))
    with connect(f"{url.replace('http', 'ws')}ws", origin=origin, max_size=None, compression=None) as page:
        page.send(json.dumps({"type": "hello", "token": token, "client": "bench"}))
        page.send(json.dumps({"type": "watch", "cameras": cameras}))
        yield page


def watch(page: ClientConnection, seconds: float) -> Viewed:
    """Receive for some seconds, answering as the page does."""
    viewed, deadline_s = Viewed(), time.monotonic() + seconds
    while (left_s := deadline_s - time.monotonic()) > 0.0:
        try:
            frame = page.recv(timeout=left_s)
        except TimeoutError:
            break
        now_ns = clock.now_ns()
        viewed.frames.append((now_ns, frame))
        if isinstance(frame, bytes):
            continue
        message = json.loads(frame)
        if message.get("seq", 1) % _ACK_EVERY == 0:
            page.send(json.dumps({"type": "seen", "seq": message["seq"]}))
        if message["type"] == "delta" and message["s"].get("estimate"):
            viewed.latencies_ms.append(now_ns / 1e6 - message["s"]["estimate"]["at"])
    return viewed


def order_often(page: ClientConnection, bus: Bus) -> dict[str, Any]:
    """Return the delays of the page's orders until they arrive at another member of the bus [ms]."""
    commands, arrivals_ns = bus.subscribe([COMMAND], capacity=256), list[int]()
    commands.on_arrival = lambda: arrivals_ns.append(clock.now_ns())
    known, late_ms = set[str](), list[float]()
    for number in range(_ORDERS):
        sent_ns = clock.now_ns()
        order = {"type": "order", "verb": "HOLD", "drones": [], "run": run_id(""), "ref": f"bench-{number}"}
        page.send(json.dumps({**order, "age_ms": 0.0, "at_ms": sent_ns / 1e6}))
        watch(page, _BETWEEN_ORDERS_S)
        # Nobody acknowledges, so earlier orders are repeated meanwhile.
        for at_ns, received in zip(arrivals_ns, commands.drain(), strict=False):
            if isinstance(received.message, Command) and received.message.id not in known:
                known.add(received.message.id)
                late_ms.append((at_ns - sent_ns) / 1e6)
        arrivals_ns.clear()
    if len(late_ms) < _ORDERS // 2:
        raise GroundStationError(f"only {len(late_ms)} of {_ORDERS} orders came to the bus")
    return {"order_to_bus_ms": _quantiles(late_ms)}


def echo(viewed: Viewed, seconds: float) -> dict[str, Any]:
    """Return the cost of a bare echo of the same frames at the same times; it also receives them, as ours does not."""
    listener = claim_port(free_port())
    port = listener.getsockname()[1]
    command = [sys.executable, "-m", "groundstation.bench.console_peer", str(listener.fileno())]
    process = subprocess.Popen(command, pass_fds=[listener.fileno()])
    try:
        with connect(f"ws://{HOST}:{port}/ws", max_size=None, compression=None, open_timeout=_START_S) as page:
            page.send("ready")
            page.recv(timeout=_START_S)
            begin_s, began_ns, first_ns = cpu_s(process.pid), clock.now_ns(), viewed.frames[0][0]
            for at_ns, frame in viewed.frames:
                time.sleep(max(0.0, (at_ns - first_ns - (clock.now_ns() - began_ns)) / 1e9))
                page.send(frame)
                page.recv(timeout=_START_S)
            used_s = cpu_s(process.pid) - begin_s
    finally:
        process.kill()
        process.wait(10)
        listener.close()
    return {"name": "bare starlette echo of the same frames", "cpu_percent_of_core": round(100.0 * used_s / seconds, 2)}


def drawn(browser: str, url: str, seconds: float) -> dict[str, Any]:
    """Return the ages of estimates when the page has drawn them, by its own clock; {} without playwright."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        return {}
    with sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=browser, args=["--no-sandbox", "--disable-gpu"])
        page = chromium.new_page(viewport={"width": 1440, "height": 900})
        page.goto(url)
        page.wait_for_timeout(1e3 * (_WARM_S + min(seconds, 10.0)))  # the page keeps its last 200 drawings
        state = page.evaluate("() => window.__console.state")
        chromium.close()
    late = sorted(state["latencies"])
    if not late:
        raise GroundStationError("the page drew nothing")
    return {"estimate_to_drawn_ms": _quantiles(late), "drawing_ms": round(state["drawMs"], 2)}


def cpu_s(pid: int) -> float:
    """Return the CPU time of all of a process's threads so far [s]."""
    total_ns = 0
    for task in Path(f"/proc/{pid}/task").iterdir():
        with contextlib.suppress(OSError):  # a thread that has just ended
            total_ns += int((task / "schedstat").read_text().split()[0])
    return total_ns / 1e9
