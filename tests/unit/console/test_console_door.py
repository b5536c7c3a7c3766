"""Access to the console: programs of our own user, others with the code; and the cost of silent connections."""

import asyncio
import os
import socket
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest
from console_site import Site, run
from websockets.exceptions import InvalidStatus

from groundstation.console import access, half_open
from groundstation.process import ports

STRANGER = 54321


@pytest.fixture(autouse=True)
def runtime(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


@pytest.fixture
def stranger(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(access, "user_of", lambda _client, _server: STRANGER)
    yield


def code_of(site: Site) -> str:
    path = site.server._code.path
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    return path.read_text().strip()


def test_the_kernel_knows_who_is_at_the_other_end() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server, socket.create_connection(server.getsockname()) as client:
        assert ports.user_of(client.getsockname(), server.getsockname()) == os.getuid()
        client.shutdown(socket.SHUT_WR)
        assert ports.user_of(client.getsockname(), server.getsockname()) is None, "a closed one would pass for root's"


@pytest.mark.usefixtures("stranger")
def test_another_user_gets_no_page_no_token_and_no_connection() -> None:
    async def test(site: Site) -> None:
        for path in ("/", "/token", "/?code=guess", "/token?code="):
            status, _, body = await site.request(path)
            assert status == 403 and b"another user of this machine" in body
        assert (await site.request("/", cookie="skein_1=x; broken"))[0] == 403
        with pytest.raises(InvalidStatus):
            async with site.connect():
                pass

    run(test)


@pytest.mark.parametrize(("sender", "told"), [(STRANGER, "other_user"), (None, "left")])
def test_who_has_left_is_refused_and_not_called_another_user(
    sender: int | None, told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(access, "user_of", lambda _client, _server: sender)

    async def test(site: Site) -> None:
        assert (await site.request("/"))[0] == 403
        refused = site.server.refused
        assert {kind: refused.get(kind, 0) for kind in ("other_user", "left")} == {"other_user": 0, "left": 0} | {
            told: 1
        }

    run(test)


@pytest.mark.usefixtures("stranger")
def test_another_user_comes_in_with_the_code() -> None:
    async def test(site: Site) -> None:
        status, head, _ = await site.request(f"/?code={code_of(site)}")
        assert status == 303 and "httponly; samesite=strict" in head
        cookie = f"skein_{site.port}={code_of(site)}"
        for other in ("", 'theme={"a": 1}; '):
            assert (await site.request("/token", cookie=f"{other}{cookie}"))[0] == 200
        async with site.connect(additional_headers={"Cookie": cookie}) as page:
            await page.recv()

    run(test)


def test_the_code_goes_with_the_console() -> None:
    path: list[Path] = []

    async def test(site: Site) -> None:
        code_of(site)
        path.append(site.server._code.path)

    run(test)
    assert not path[0].exists()


def test_450_silent_connections_keep_nobody_out() -> None:
    async def test(site: Site) -> None:
        silent = [await asyncio.open_connection("127.0.0.1", site.port) for _ in range(450)]
        for number, (_, writer) in enumerate(silent):
            if number % 2:
                writer.write(b"GET / HTTP/1.1\r\nHost: ")
        assert (await site.request("/"))[0] == 200
        async with site.connect() as page:
            await page.recv()
        assert site.server.half_open.ended >= 450 - half_open.MOST
        for _, writer in silent:
            writer.close()

    run(test)


def test_a_request_has_its_time_from_the_first_byte_on() -> None:
    async def test(site: Site) -> None:
        site.server.half_open._patience_s = 0.1
        reader, writer = await asyncio.open_connection("127.0.0.1", site.port)
        with pytest.raises(ConnectionError):
            for _ in range(100):
                writer.write(b"G")
                await writer.drain()
                await asyncio.sleep(0.01)
            await reader.readexactly(1)
        async with site.connect() as page:
            await asyncio.sleep(0.3)
            await page.recv()

    run(test)
