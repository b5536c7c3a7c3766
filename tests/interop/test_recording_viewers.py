"""Recordings and live views, read by the programs of Rerun, Foxglove and others."""

import json
import socket
import struct
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from importlib.util import find_spec
from pathlib import Path

import pytest
from click.testing import CliRunner
from free_port import free_port
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.topics import ESTIMATE, IMAGE
from groundstation.cli.main import groundstation
from groundstation.engineering_views.rerun_file import write_rrd
from groundstation.engineering_views.watch import watch
from groundstation.field.resolved import field_from_json
from groundstation.recording.run import open_run
from groundstation.recording.synthetic import SyntheticRun, write_run
from groundstation.recording.timeline import Timeline
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field

pytestmark = [pytest.mark.interop, pytest.mark.slow]  # the viewers' programs are large: make test does without them


@pytest.fixture(scope="module")
def field() -> str:
    return load_field(find_field("lab"), ()).model_dump_json()


@pytest.fixture(scope="module")
def run_dir(field: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    write_run(folder, field.encode(), 3.0)
    return folder


def _rerun(*arguments: object) -> str:
    spec = find_spec("rerun_cli")
    assert spec is not None and spec.origin is not None
    program = Path(spec.origin).with_name("rerun")
    command = [str(program), *(str(one) for one in arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=100, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def test_rerun_opens_our_recordings_with_pictures_frames_and_log(run_dir: Path, tmp_path: Path) -> None:
    for stem, found in (("raw", ("EncodedImage:blob",)), ("state", ("Transform3D:child_frame", "TextLog:text"))):
        _rerun("mcap", "convert", run_dir / f"{stem}.mcap", "-o", tmp_path / f"{stem}.rrd")
        listed = _rerun("rrd", "print", tmp_path / f"{stem}.rrd")
        assert all(name in listed for name in found)


def test_exported_scene_is_whole_and_shows_everything(run_dir: Path, tmp_path: Path) -> None:
    count, unread = write_rrd(open_run(run_dir), tmp_path / "run.rrd")
    assert count > 2000 and unread == []
    assert "verified without error" in _rerun("rrd", "verify", tmp_path / "run.rrd")
    listed = _rerun("rrd", "print", tmp_path / "run.rrd")
    paths = ["/world/room", "/world/fence", "/world/drone_1", "/world/ellipse_95/turtlebot", "/world/links"]
    paths += ["/world/drone_2/camera/picture", "/world/ceiling/picture", "/world/commanded/drone_1", "/log/drone_1"]
    paths += ["/plots/std/turtlebot", "/plots/cost/chosen", "/plots/battery/drone_1", "/world/truth/turtlebot"]
    assert [path for path in paths if f"{path} " not in listed] == []


def test_parquet_columns_are_typed_and_have_units(run_dir: Path, tmp_path: Path) -> None:
    import pyarrow.parquet as pq

    from groundstation.recording.table_files import ParquetFile, write_tables

    counts, _ = write_tables(open_run(run_dir), tmp_path / "tables", ParquetFile)
    table = pq.read_table(tmp_path / "tables" / "observation.parquet")
    assert table.num_rows == counts["observation"] > 100
    assert table.schema.field("position_x_m").metadata == {b"unit": b"m"}
    assert str(table.schema.field("covariance").type).startswith("list<")
    assert table.column("time_s").to_pylist() == sorted(table.column("time_s").to_pylist())


def test_the_copy_with_a_scene_holds_everything_else_too(run_dir: Path, tmp_path: Path) -> None:
    from mcap.reader import make_reader

    from groundstation.engineering_views.foxglove_file import write_with_scene

    count, unread = write_with_scene(open_run(run_dir), tmp_path / "scene.mcap")
    assert count == pytest.approx(30, abs=1) and unread == []
    assert open_run(tmp_path / "scene.mcap").counts() == open_run(run_dir).counts()
    with (tmp_path / "scene.mcap").open("rb") as stream:
        schema, _, message = next(make_reader(stream).iter_messages(topics=["/scene"]))
    assert schema is not None and schema.name == "foxglove.SceneUpdate"
    assert b"drone_1" in message.data and b"room" in message.data


@pytest.mark.parametrize("kind", ["--rrd", "--foxglove-scene"])
def test_an_export_never_touches_what_is_there(kind: str, run_dir: Path, tmp_path: Path) -> None:
    taken = tmp_path / "taken"
    taken.write_text("mine")
    command = ["recording", "export", kind, str(run_dir), "--output", str(taken)]
    result = CliRunner().invoke(groundstation, command, standalone_mode=False)
    assert "exists already" in str(result.exception)
    assert taken.read_text() == "mine"


@pytest.fixture
def flight() -> Iterator[MemoryBus]:
    """Yield a bus on which a synthetic run plays in real time."""
    exchange, over = MemoryExchange(), threading.Event()

    def fly() -> None:
        begin = time.monotonic()
        for stamp_ns, sample in SyntheticRun().samples(0.0, 60.0):
            if over.wait(max(0.0, begin + (stamp_ns / 1e9 - 1.0) - time.monotonic())):
                return
            exchange.deliver(sample)

    thread = threading.Thread(target=fly)
    thread.start()
    yield MemoryBus(exchange, "lab", "view")
    over.set()
    thread.join()


def _timeline() -> Timeline:
    return Timeline(clock.clock_id(), clock.unix_offset_ns())


def _advertised(viewer: ClientConnection) -> dict[str, int]:
    channels: dict[str, int] = {}
    deadline = time.monotonic() + 20.0
    while not {"/tf", "/scene"} <= set(channels) or not any("image" in topic for topic in channels):
        assert time.monotonic() < deadline, sorted(channels)
        message = viewer.recv(timeout=10.0)
        if isinstance(message, str) and json.loads(message)["op"] == "advertise":
            channels |= {one["topic"]: one["id"] for one in json.loads(message)["channels"]}
    return channels


def _viewer(address: str) -> ClientConnection:
    return connect(address, subprotocols=[Subprotocol("foxglove.sdk.v1")], max_size=None, close_timeout=1.0)


def test_foxglove_is_served_on_loopback_beside_a_viewer_that_never_reads(flight: MemoryBus, field: str) -> None:
    from groundstation.engineering_views.foxglove_live import FoxgloveView

    port, over = free_port(), threading.Event()
    view = FoxgloveView("lab", field_from_json(field.encode()), _timeline(), port)
    loop = threading.Thread(target=watch, args=(flight, view, lambda: not over.is_set()))
    loop.start()
    try:
        address = f"ws://127.0.0.1:{port}"
        with _viewer(address) as slow, _viewer(address) as viewer:
            channels = _advertised(viewer)
            wanted = [number for topic, number in channels.items() if "image" in topic or topic in ("/tf", "/scene")]
            wanted += [number for topic, number in channels.items() if f"/{ESTIMATE.name}/" in topic]
            order = {"op": "subscribe", "subscriptions": [{"id": n, "channelId": n} for n in wanted]}
            for client in (slow, viewer):
                client.send(json.dumps(order))
            seen: set[int] = set()
            deadline = time.monotonic() + 20.0
            while seen != set(wanted):
                assert time.monotonic() < deadline
                message = viewer.recv(timeout=10.0)
                if isinstance(message, bytes) and message[0] == 1:
                    seen.add(struct.unpack_from("<I", message, 1)[0])
            assert any(f"/{IMAGE.name}/" in topic for topic in channels)
    finally:
        over.set()
        loop.join(timeout=10.0)
        view.close()
    assert not loop.is_alive()


def test_a_port_that_is_taken_is_named(field: str) -> None:
    from groundstation.engineering_views.foxglove_live import FoxgloveView
    from groundstation.errors import OperatorMistake

    with closing(socket.socket()) as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(OperatorMistake, match="--port"):
            FoxgloveView("lab", field_from_json(field.encode()), _timeline(), taken.getsockname()[1])


def test_rerun_is_served_on_loopback_only_and_ends_with_us(flight: MemoryBus, field: str) -> None:
    from groundstation.engineering_views.rerun_live import RerunServer, RerunView

    port, page_port = free_port(), free_port()
    server = RerunServer(port, page_port)
    view = RerunView("lab", field_from_json(field.encode()), _timeline(), clock.now_ns(), server, None)
    over = time.monotonic() + 4.0
    try:
        watch(flight, view, lambda: time.monotonic() < over)
        assert server.alive
        with closing(socket.create_connection(("127.0.0.1", page_port), timeout=5.0)) as page:
            page.sendall(b"GET / HTTP/1.0\r\nHost: 127.0.0.1\r\n\r\n")
            assert b"200" in page.recv(64)
        listening = _listening(port) | _listening(page_port)
        assert listening == {"0100007F"}
    finally:
        view.close()
    assert not server.alive


def _listening(port: int) -> set[str]:
    """Return the local addresses (hexadecimal, as the kernel shows them) that listen on a TCP port."""
    found = set()
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        for line in Path(table).read_text().splitlines()[1:]:
            address, number = line.split()[1].rsplit(":", 1)
            if int(number, 16) == port and line.split()[3] == "0A":
                found.add(address)
    return found


def test_a_live_view_can_be_saved(flight: MemoryBus, field: str, tmp_path: Path) -> None:
    from groundstation.engineering_views.rerun_live import RerunView

    view = RerunView("lab", field_from_json(field.encode()), _timeline(), clock.now_ns(), None, tmp_path / "live.rrd")
    over = time.monotonic() + 2.0
    watch(flight, view, lambda: time.monotonic() < over)
    view.close()
    listed = _rerun("rrd", "print", tmp_path / "live.rrd")
    assert "/world/drone_1 " in listed and "/world/ceiling/picture " in listed
