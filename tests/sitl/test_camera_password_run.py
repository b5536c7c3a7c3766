"""A real run on loopback with password-protected cameras, without take-off: no output contains the password."""

import asyncio
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from base64 import b64encode
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from free_port import free_port
from websockets.asyncio.client import connect
from websockets.typing import Origin

from groundstation.bus.roles import Role
from groundstation.bus.topics import TOPICS
from groundstation.recording.reader import attached_field, open_recording, parts
from groundstation.supervisor import runtime_file
from groundstation.supervisor.joining import join

pytestmark = [pytest.mark.sitl, pytest.mark.slow, pytest.mark.timeout(420)]

COMMAND = [sys.executable, "-m", "groundstation"]
SECRET = "s3cr3t-w0rd"


class LockedCamera:
    """Answers 401 to everything, and records the requests."""

    def __init__(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self.requests = b""
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        with suppress(OSError):
            while True:
                connection, _ = self._listener.accept()
                with connection:
                    self._talk(connection)

    def _talk(self, connection: socket.socket) -> None:
        with suppress(OSError):
            while data := connection.recv(4096):
                self.requests += data
                if data.startswith(b"GET"):
                    connection.sendall(b"HTTP/1.0 401 Unauthorized\r\n\r\n")
                    return
                head = b"RTSP/1.0 401 Unauthorized\r\nCSeq: %d\r\n" % (2 if b"CSeq: 2" in data else 1)
                connection.sendall(head + b'WWW-Authenticate: Basic realm="x"\r\n\r\n')

    def close(self) -> None:
        self._listener.close()


@pytest.fixture
def cameras() -> Iterator[list[LockedCamera]]:
    made = [LockedCamera(), LockedCamera()]
    yield made
    for camera in made:
        camera.close()


def all_bytes(run_dir: Path) -> Iterator[tuple[str, bytes]]:
    """Yield every file unchanged, and the unpacked contents of recordings."""
    for path in sorted(run_dir.rglob("*")):
        if path.is_file():
            yield str(path), path.read_bytes()
    for kind in ("state", "raw"):
        for part in parts(run_dir, kind):
            recording = open_recording(part)
            for name, content in recording.attachments.items():
                yield f"{part}/{name}", content
            for raw in recording.raw_records():
                yield f"{part}/{raw.key}", raw.data


def arguments(pid: int) -> bytes:
    with suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    return b""


@pytest.mark.exhaustive
def test_a_run_leaves_no_password_behind(
    tmp_path: Path, cameras: list[LockedCamera], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    login = f"operator:{SECRET}"
    console = free_port()
    field = (Path(__file__).parents[1] / "fixtures" / "field" / "lab.yaml").read_text()
    for old, new in (
        ("http://192.168.1.50:8080/", f"http://{login}@127.0.0.1:{cameras[0].port}/"),
        ("http://192.168.1.51:8080/", f"rtsp://{login}@127.0.0.1:{cameras[1].port}/"),
        ("http://192.168.1.52:8080/", f"http://127.0.0.1:{free_port()}/"),
        ("address: 192.168.1.", "address: 127.99.77."),
        ("enabled: false\n  port: 8765", f"enabled: true\n  port: {console}\nbus:\n  port: {free_port()}"),
    ):
        assert old in field
        field = field.replace(old, new)
    (tmp_path / "lab.yaml").write_text(field)
    (tmp_path / "cameras").symlink_to(Path(__file__).parents[1] / "fixtures" / "field" / "cameras")
    output = tmp_path / "output.txt"
    command = [*COMMAND, "fly", "lab.yaml", "--headless"]
    with output.open("wb") as sink:
        run = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=sink, stderr=sink, cwd=tmp_path)
    told = b""
    try:
        deadline = time.monotonic() + 240
        while b"groundstation takeoff" not in output.read_bytes():
            assert time.monotonic() < deadline and run.poll() is None, output.read_text()
            time.sleep(0.2)
        (record,) = runtime_file.live_records()
        told = b"".join(arguments(process.pid) for process in (record.supervisor, *record.processes))
        runtime = b"".join(path.read_bytes() for path in runtime_file.folder().glob("*.json"))
        on_bus, on_page = heard(record, 3.0), asyncio.run(shown(f"http://127.0.0.1:{console}", 3.0))
        run.send_signal(signal.SIGINT)
        run.wait(60)
    finally:
        if run.poll() is None:
            os.kill(run.pid, signal.SIGTERM)
            run.wait(60)
    (run_dir,) = (tmp_path / "runs").iterdir()
    basic = b64encode(login.encode())
    assert all(b"Basic " + basic in camera.requests for camera in cameras), "the drivers got it"
    assert b"groundstation.process.entry" in told
    subprocess.run([*COMMAND, "export", str(run_dir), "--csv"], capture_output=True, timeout=120, check=True)
    evidence = [("arguments", told), ("runtime file", runtime), ("output", output.read_bytes()), *all_bytes(run_dir)]
    evidence += [("bus", on_bus), ("console", on_page)]
    assert b"vehicle_status" in on_bus and b'"scene"' in on_page
    assert {f"127.0.0.1:{camera.port}" for camera in cameras} <= set(attached_sources(run_dir))
    assert [name for name, content in evidence if SECRET.encode() in content or basic in content] == []
    for verb in (["report", str(run_dir)], ["replay", str(run_dir), "--rerun", "tracker"]):
        again = subprocess.run([*COMMAND, *verb], capture_output=True, text=True, timeout=120, check=False)
        assert "Traceback" not in again.stderr and SECRET not in again.stdout + again.stderr
        assert again.returncode == 0 or verb[0] == "report", again.stdout + again.stderr


def heard(record: runtime_file.RuntimeRecord, seconds: float) -> bytes:
    """Return all messages on the bus for a while."""
    bus = join(record, "view", Role.VIEW)
    everything = bus.subscribe(TOPICS.values(), capacity=100_000)
    time.sleep(seconds)
    samples = everything.drain_samples()
    bus.close()
    return b"\n".join(part for s in samples for part in (s.key.encode(), s.payload, s.attachment))


async def shown(url: str, seconds: float) -> bytes:
    """Return all that the console sends to a page for a while."""
    got: list[bytes] = []
    async with connect(f"{url.replace('http', 'ws')}/ws", origin=Origin(url), max_size=None) as page:
        with suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                async for message in page:
                    got.append(message.encode() if isinstance(message, str) else message)
    return b"\n".join(got)


def attached_sources(run_dir: Path) -> list[str]:
    return attached_field(run_dir).decode().replace("/", '"').split('"')
