"""The server on a real socket: who gets in, what gets out, and what a bad or slow viewer costs."""

import asyncio
import contextlib
import json
import socket
import warnings
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.console import app
from groundstation.console.board import Board
from groundstation.console.gate import refusal
from groundstation.console.pages import load_pages
from groundstation.console.protocol import MAX_BYTES, decode
from groundstation.console.scene import bare_scene
from groundstation.console.server import ConsoleServer, claim_port
from groundstation.console.viewer import WINDOW, Viewer
from groundstation.errors import MessageError
from groundstation.monitor.state import Cast

Test = Callable[["Site"], Awaitable[None]]


class Site:
    def __init__(self) -> None:
        exchange = MemoryExchange()
        self.bus = MemoryBus(exchange, "lab", "console")
        self.drone = MemoryBus(exchange, "lab", "drone_1")
        self.commands = self.drone.subscribe([t.COMMAND])
        cast = Cast("lab", {"drone_1": 0.15}, "turtlebot")
        self.server = ConsoleServer(self.bus, cast, bare_scene("lab", ("drone_1",), True), {}, claim_port(38765))
        self.port = int(self.server.url.rsplit(":", 1)[1].strip("/"))
        self.over = False

    async def request(self, raw_path: str, method: str = "GET", **headers: str) -> tuple[int, str, bytes]:
        """Speak HTTP by hand: a library would tidy the path up before it is sent."""
        reader, writer = await asyncio.open_connection("127.0.0.1", self.port)
        lines = [f"{method} {raw_path} HTTP/1.1", f"Host: {headers.pop('host', f'127.0.0.1:{self.port}')}"]
        lines += [f"{name.replace('_', '-')}: {value}" for name, value in headers.items()]
        writer.write(("\r\n".join([*lines, "Connection: close"]) + "\r\n\r\n").encode())
        answer = await asyncio.wait_for(reader.read(), 5)
        writer.close()
        head, _, body = answer.partition(b"\r\n\r\n")
        return int(head.split()[1]), head.decode().lower(), body

    async def token(self) -> str:
        return (await self.request("/token"))[2].decode()

    def connect(self, origin: str | None = "", **options: Any) -> connect:
        chosen = f"http://127.0.0.1:{self.port}" if origin == "" else origin
        return connect(f"ws://127.0.0.1:{self.port}/ws", origin=chosen, max_size=None, **options)  # type: ignore[arg-type]

    async def closed(self, page: ClientConnection) -> tuple[int, str]:
        """Return code and reason with which the server closes; telemetry on the way is passed over."""
        with pytest.raises(ConnectionClosed):
            async with asyncio.timeout(5):
                while True:
                    await page.recv()
        return page.close_code or 0, page.close_reason or ""


def run(test: Test) -> None:
    async def main() -> None:
        site = Site()
        serving = asyncio.create_task(site.server.serve(lambda _turns, _late: not site.over))
        try:
            await asyncio.sleep(0.05)
            await asyncio.wait_for(test(site), 20)
        finally:
            site.over = True
            await serving

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        asyncio.run(main())


async def until(condition: Callable[[], Any]) -> Any:
    async with asyncio.timeout(5):
        while not (value := condition()):
            await asyncio.sleep(0.02)
    return value


def test_pages_and_their_headers() -> None:
    async def test(site: Site) -> None:
        status, head, body = await site.request("/")
        assert status == 200 and b"@@TOKEN@@" not in body and (await site.token()).encode() in body
        for name in ("content-security-policy: default-src 'none'", "x-frame-options: deny", "cache-control: no-store"):
            assert name in head
        assert "unsafe" not in head
        for path in ("/style.css", "/js/main.js", "/vendor/uPlot.min.js", "/vendor/uPlot.LICENSE.txt"):
            assert (await site.request(path))[0] == 200, path

    run(test)


def test_paths_lead_nowhere_else() -> None:
    async def test(site: Site) -> None:
        paths = ["/../server.py", "/js/../../server.py", "/%2e%2e/server.py", "/js/..%2f..%2fserver.py", "//etc/passwd"]
        paths += [
            "/index.html",
            "/static/index.html",
            "/js/",
            "/js",
            "/\\..\\server.py",
            "/js/main.js%00",
            "/" + "a" * 3000,
        ]
        for path in paths:
            assert (await site.request(path))[0] in (400, 404), path

    run(test)


def test_other_sites_get_nothing() -> None:
    async def test(site: Site) -> None:
        assert (await site.request("/", host="evil.example"))[0] == 403
        assert (await site.request("/token", sec_fetch_site="cross-site"))[0] == 403
        assert (await site.request("/", method="POST"))[0] == 403
        assert (await site.request("/", host=f"localhost:{site.port}"))[0] == 200
        for origin in (
            "http://evil.example",
            "null",
            f"https://127.0.0.1:{site.port}",
            f"http://127.0.0.1:{site.port + 1}",
            None,
        ):
            with pytest.raises(InvalidStatus) as refused:
                async with site.connect(origin=origin):
                    pass
            assert refused.value.response.status_code == 403

    run(test)


@pytest.mark.parametrize("host", ["", "127.0.0.1.evil.example", "[", "evil.example:8765", "0.0.0.0", "169.254.1.1"])
def test_hosts_that_are_not_loopback(host: str) -> None:
    assert refusal({"type": "http", "method": "GET", "headers": [(b"host", host.encode())]})


def test_a_viewer_gets_a_seed_and_then_what_changes() -> None:
    async def test(site: Site) -> None:
        async with site.connect() as page:
            seed = json.loads(await page.recv())
            assert seed["type"] == "seed" and seed["scene"]["site"] == "lab"
            status = m.VehicleStatus(
                header=site.drone.header("drone_1"), flight_state=m.FlightState.FLYING, mode="TRACK", battery=0.5
            )
            site.drone.publish(t.VEHICLE_STATUS, status)
            numbers = [seed["seq"]]
            for _ in range(WINDOW):
                delta = json.loads(await page.recv())
                numbers.append(delta["seq"])
                if "vehicles" in delta["s"] and delta["s"]["vehicles"]:
                    break
            assert delta["s"]["vehicles"]["drone_1"]["mode"] == "TRACK"
            assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))

    run(test)


def test_an_order_reaches_the_bus_with_the_token_only() -> None:
    async def test(site: Site) -> None:
        token = await site.token()
        order = {"type": "order", "verb": "LAND", "drones": [], "at_ms": 0}
        async with site.connect() as page:
            await page.send(json.dumps({"type": "hello", "token": "guess", "client": "abcd"}))
            await page.send(json.dumps(order))
            await until(lambda: site.server.sessions.refused["untrusted"])
            assert site.commands.drain() == []
            await page.send(json.dumps({"type": "hello", "token": token, "client": "abcd"}))
            await page.send(json.dumps(order))
            (received,) = await until(site.commands.drain)
            assert received.message.verb is m.Verb.LAND

    run(test)


@pytest.mark.parametrize(
    ("message", "reason"),
    [
        ("", "malformed"),
        ("[]", "malformed"),
        ('{"type":"order"}', "malformed"),
        ('{"type":"hello","token":"a","client":"abcd","more":1}', "malformed"),
        ('{"type":"place","x_m":1e9,"y_m":0}', "malformed"),
        ('{"type":"drive","speed_m_s":NaN,"turn_rad_s":0}', "malformed"),
        ('{"type":"order","verb":"EXPLODE","drones":[],"at_ms":0}', "malformed"),
        ("[" * 4000, "malformed"),
        (" " * (MAX_BYTES + 1), "too_long"),
        (b"\x00\x01", "binary"),
    ],
)
def test_nonsense_is_counted_and_shown_out(message: str | bytes, reason: str) -> None:
    async def test(site: Site) -> None:
        async with site.connect() as good, site.connect() as page:
            await page.send(message)
            assert await site.closed(page) == (1008, f"message refused: {reason}")
            assert site.server.app.refused == {reason: 1}
            await good.recv()  # the others do not notice
        await until(lambda: not site.server.sessions.viewers)

    run(test)


@settings(max_examples=50, deadline=None)
@given(st.text(max_size=200) | st.recursive(st.none() | st.text(max_size=9) | st.floats(), st.lists).map(json.dumps))
def test_decoding_never_raises_anything_else(text: str) -> None:
    with pytest.raises(MessageError):
        decode(text)


def test_a_flood_is_shown_out() -> None:
    async def test(site: Site) -> None:
        async with site.connect() as page:
            with contextlib.suppress(ConnectionClosed):
                for _ in range(300):
                    await page.send('{"type":"seen","seq":1}')
            assert (await site.closed(page))[1] == "message refused: too_fast"
            assert site.server.app.refused["too_fast"] == 1

    run(test)


def test_there_is_room_for_so_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(app, "MAX_VIEWERS", 5)

    async def test(site: Site) -> None:
        pages = [await site.connect() for _ in range(5)]
        await until(lambda: len(site.server.sessions.viewers) == 5)
        async with site.connect() as one_more:
            assert await site.closed(one_more) == (1013, "5 viewers are connected already")
        # The operator whose page comes back finds a place, and nobody who only says he is.
        hello = {"type": "hello", "token": await site.token(), "client": "abcd"}
        await pages[0].send(json.dumps(hello))
        await pages[0].send(json.dumps({"type": "takeover"}))
        await until(lambda: site.server.sessions.helm.client == "abcd")
        for claim in (hello | {"client": "efgh"}, hello | {"token": "guess"}, {"type": "takeover"}):
            async with site.connect() as pretender:
                await pretender.send(json.dumps(claim))
                assert (await site.closed(pretender))[0] == 1013
        async with site.connect() as again:
            await again.send(json.dumps(hello))
            assert json.loads(await again.recv())["type"] in ("welcome", "seed")
            assert len(site.server.sessions.viewers) == 6
        for page in pages:
            await page.close()
        await until(lambda: not site.server.sessions.viewers)
        async with site.connect() as page:
            assert json.loads(await page.recv())["type"] == "seed"

    run(test)


def test_a_hundred_connections_leave_the_operator_his_page() -> None:
    async def test(site: Site) -> None:
        token = await site.token()
        async with site.connect() as page:
            await page.send(json.dumps({"type": "hello", "token": token, "client": "abcd"}))
            silent = [await site.connect() for _ in range(app.MAX_VIEWERS - 1)]
            async with site.connect() as one_more:
                assert (await site.closed(one_more))[0] == 1013
            await page.send(json.dumps({"type": "order", "verb": "LAND", "drones": [], "at_ms": 0}))
            (received,) = await until(site.commands.drain)
            assert received.message.verb is m.Verb.LAND
            for other in silent:
                other.transport.abort()
        await until(lambda: not site.server.sessions.viewers)

    run(test)


FRAME = st.builds(
    lambda first, mask, size, body: bytes((first, mask | size)) + body,
    st.integers(0, 255),
    st.sampled_from((0, 0x80)),
    st.integers(0, 127),
    st.binary(max_size=40),
)


@pytest.mark.fuzz
@settings(max_examples=8, deadline=None)
@given(st.lists(st.lists(FRAME, min_size=1, max_size=6), min_size=8, max_size=8))
def test_no_bytes_on_the_wire_disturb_the_others(attempts: list[list[bytes]]) -> None:
    async def test(site: Site) -> None:
        origin = f"http://127.0.0.1:{site.port}"
        shake = (
            f"GET /ws HTTP/1.1\r\nHost: 127.0.0.1:{site.port}\r\nOrigin: {origin}\r\nUpgrade: websocket\r\n"
            "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
        )
        async with site.connect() as good:
            for frames in attempts:
                reader, writer = await asyncio.open_connection("127.0.0.1", site.port)
                writer.write(shake.encode())
                assert b"101" in await reader.readline()
                writer.write(b"".join(frames))
                writer.write_eof()
                with contextlib.suppress(ConnectionError):
                    await asyncio.wait_for(reader.read(), 5)
                writer.close()
            await until(lambda: len(site.server.sessions.viewers) == 1)
            before = site.server.board.turn
            await until(lambda: site.server.board.turn > before)
            await good.recv()
        assert site.commands.drain() == []

    run(test)


def test_a_viewer_that_does_not_answer_gets_a_window_full_and_then_the_newest() -> None:
    async def test() -> None:
        board, sent = Board(), []

        async def keep(frame: str | bytes) -> None:
            sent.append(frame)

        board.begin()
        viewer = Viewer(1, board, keep, keep)
        viewer.watched = frozenset({"ceiling"})
        task = asyncio.create_task(viewer.run(lambda seq: json.dumps({"seq": seq})))
        for value in range(40):
            board.begin()
            board.put("a", value)
            viewer.notice()
            viewer.show("ceiling", b"%d" % value)
            await asyncio.sleep(0)
            await asyncio.sleep(0)
        texts = [json.loads(frame) for frame in sent if isinstance(frame, str)]
        assert texts[-1]["seq"] == WINDOW
        viewer.say("urgent")
        await asyncio.sleep(0.01)
        assert sent[-1] == "urgent"  # answers are never held back
        viewer.saw(WINDOW)
        await asyncio.sleep(0.01)
        newest = json.loads(next(frame for frame in reversed(sent) if isinstance(frame, str) and frame != "urgent"))
        assert newest["s"] == {"a": 39} and sent[-1] == b"39"
        assert viewer.skipped > 0
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    asyncio.run(test())


def test_a_port_in_use_is_no_obstacle() -> None:
    first = claim_port(38801)
    second = claim_port(first.getsockname()[1])
    try:
        assert first.getsockname() != second.getsockname()
        assert {listener.getsockname()[0] for listener in (first, second)} == {"127.0.0.1"}
        assert first.getsockopt(socket.SOL_SOCKET, socket.SO_ACCEPTCONN)
    finally:
        first.close()
        second.close()


def test_nothing_is_loaded_from_elsewhere() -> None:
    """The page works without any network but loopback: no address of anything else is in its files."""
    for path, file in load_pages("x").items():
        text = file.content.decode()
        if path.startswith("/vendor/"):
            assert "http" not in text.split("*/", 1)[-1] or path.endswith(".txt"), path
            continue
        for word in ("https://", "http://", "//cdn"):
            assert word not in text.replace("http://www.w3.org/2000/svg", ""), (path, word)
        assert "innerHTML" not in text and "eval(" not in text, path
