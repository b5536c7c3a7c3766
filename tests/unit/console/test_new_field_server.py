"""The new-field form is served until the field is written: its files, its drawing, its end."""

import asyncio
import json
import socket
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Origin

from groundstation.console.new_field.server import FormServer

FORM = {
    "number": 1,
    "order": "draw",
    "room": [8, 6, 4.5, "http://192.168.1.50:8080/video.mjpg"],
    "drones": [["ardrone", "192.168.1.11", "ardrone://192.168.1.11"]],
    "target": ["turtlebot_2", 0.4],
}


@pytest.fixture(autouse=True)
def runtime(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


def answered(url: str) -> tuple[int, bytes]:
    try:
        with urllib.request.urlopen(url, timeout=5) as response:
            return response.status, response.read()
    except urllib.error.HTTPError as error:
        return error.code, error.read()


async def said(server: FormServer, *frames: Any) -> list[dict[str, Any]]:
    """Return the form's replies, one for each frame, until it closes."""
    told = []
    async with connect(f"{server.url.replace('http', 'ws')}ws", origin=Origin(server.url.rstrip("/"))) as form:
        for frame in frames:
            await form.send(json.dumps(frame))
            try:
                told.append(json.loads(await form.recv()))
            except ConnectionClosed:
                break
    return told


def test_it_serves_its_page_and_ends_when_the_file_is_written(tmp_path: Path) -> None:
    path = tmp_path / "hall" / "hall.yaml"

    async def run() -> bool:
        server = FormServer(path, socket.create_server(("127.0.0.1", 0)))
        serving = asyncio.create_task(server.serve())
        status, page = await asyncio.to_thread(answered, server.url)
        assert status == 200 and b"<form" in page
        assert (await asyncio.to_thread(answered, f"{server.url}offers.js"))[0] == 200
        assert (await asyncio.to_thread(answered, f"{server.url}nothing.js"))[0] == 404
        assert await said(server, ["no", "form"]) == []
        (drawn,) = await said(server, FORM)
        assert "<svg" in drawn["svg"] and not path.exists() and not serving.done()
        (written,) = await said(server, FORM | {"order": "write"})
        assert written["written"]
        return await asyncio.wait_for(serving, 10)

    assert asyncio.run(run()) is True
    assert "site: hall" in path.read_text()
