"""Nonsense, floods and crowds: the cost of a bad viewer to the others."""

import asyncio
import contextlib
import json

import pytest
from console_site import Site, land, run, until
from hypothesis import given, settings
from hypothesis import strategies as st
from websockets.exceptions import ConnectionClosed

from groundstation.bus import messages as m
from groundstation.console import app
from groundstation.console.protocol import MAX_BYTES, decode
from groundstation.errors import MessageError


@pytest.mark.parametrize(
    ("message", "reason"),
    [
        ("", "malformed"),
        ("[]", "malformed"),
        ('{"type":"order"}', "malformed"),
        ('{"type":"hello","token":"a","client":"abcd","more":1}', "malformed"),
        ('{"type":"hello","token":"a","client":"elsewhere: console_2"}', "malformed"),
        ('{"type":"place","x_m":1e9,"y_m":0}', "malformed"),
        ('{"type":"drive","speed_m_s":NaN,"turn_rad_s":0}', "malformed"),
        (land().replace("LAND", "EXPLODE"), "malformed"),
        (land(age_ms=-1), "malformed"),
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
        # The operator whose page returns gets a place; a client that only claims to be the operator does not.
        hello = {"type": "hello", "token": await site.token(), "client": "abcd"}
        await pages[0].send(json.dumps(hello))
        await pages[0].send(json.dumps({"type": "takeover"}))
        await until(lambda: site.server.sessions.operator_lock.client == "abcd")
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
            await page.send(land())
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
