"""A console server on a real socket, with one drone that receives its commands."""

import asyncio
import json
import warnings
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from groundstation.bus import clock
from groundstation.bus import topics as t
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.console.network import Network
from groundstation.console.room import bare_scene
from groundstation.console.run_end import RunEnd
from groundstation.console.server import ConsoleServer, claim_port
from groundstation.monitor.state import Cast

RUN = "run-1"
Test = Callable[["Site"], Awaitable[None]]


def land(**other: Any) -> str:
    """Return a page's message that commands all drones to land now."""
    order = {"type": "order", "verb": "LAND", "drones": [], "run": RUN, "at_ms": clock.now_ns() / 1e6, "age_ms": 0}
    return json.dumps(order | other)


class Site:
    def __init__(self, network: Network | None = None) -> None:
        self.exchange = exchange = MemoryExchange()
        self.bus = MemoryBus(exchange, "lab", "console")
        self.drone = MemoryBus(exchange, "lab", "drone_1")
        self.commands = self.drone.subscribe([t.COMMAND])
        cast = Cast("lab", {"drone_1": 0.15}, ("turtlebot",))
        scene = bare_scene("lab", ("drone_1",), True)
        self.server = ConsoleServer(self.bus, cast, scene, None, claim_port(38765), RUN, network=network)
        self.port = int(self.server.url.rsplit(":", 1)[1].strip("/"))
        self.over = False
        self.end: RunEnd | None = None

    async def request(self, raw_path: str, method: str = "GET", **headers: str) -> tuple[int, str, bytes]:
        """Send HTTP by hand: a library would normalise the path first."""
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
        """Return code and reason with which the server closes; earlier telemetry is skipped."""
        with pytest.raises(ConnectionClosed):
            async with asyncio.timeout(5):
                while True:
                    await page.recv()
        return page.close_code or 0, page.close_reason or ""


def run(test: Test, network: Network | None = None) -> None:
    async def main() -> None:
        site = Site(network)
        serving = asyncio.create_task(site.server.serve(lambda _turns, _late: not site.over, lambda: site.end))
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
