"""What the server makes of pages behind slow links."""

import asyncio
import json
import time
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from console_site import Site, land, run

from groundstation.bus import clock
from groundstation.bus import messages as m
from groundstation.console.snapshot import Snapshot
from groundstation.console.viewer import WINDOW, PageConnection
from groundstation.time_units import NS_PER_MS


def test_a_page_learns_when_its_messages_arrived() -> None:
    async def test(site: Site) -> None:
        async with site.connect() as page:
            before = clock.now_ns() / 1e6
            hello = {"type": "hello", "token": await site.token(), "client": "abcd", "sent_ms": 1234.5678901234567}
            await page.send(json.dumps(hello))
            while (told := json.loads(await page.recv()))["type"] != "welcome":
                pass
            sent_ms, met_ms = told["answer"]
            assert sent_ms == hello["sent_ms"] and before <= met_ms <= clock.now_ns() / 1e6
            await page.send(json.dumps({"type": "seen", "seq": 1, "sent_ms": 2000}))
            while "answer" not in (told := json.loads(await page.recv())):
                pass
            assert told["answer"][0] == 2000 and met_ms <= told["answer"][1] <= told["now"]
            assert "answer" not in json.loads(await page.recv()), "it is told once"

    run(test)


@pytest.mark.parametrize(
    ("late_ms", "unsure_ms", "age_ms", "good"),
    [
        (6000, 6000, 0, True),  # what the page sees is 6 s late: its stop is fresh for all that it knows
        (6000, 500, 0, False),
        (6000, 6000, 5100, False),  # the page has kept it for too long
        (11_200, 6000, 0, False),
    ],
)
def test_a_stop_is_not_refused_because_news_reach_its_page_late(
    late_ms: float, unsure_ms: float, age_ms: float, good: bool
) -> None:
    async def test(site: Site) -> None:
        async with site.connect() as page:
            await page.send(json.dumps({"type": "hello", "token": await site.token(), "client": "abcd"}))
            at_ms = clock.now_ns() / 1e6 - late_ms
            for verb in ("LAND", "TAKEOFF"):
                await page.send(land(verb=verb, at_ms=at_ms, unsure_ms=unsure_ms, age_ms=age_ms))
            notices: list[str] = []
            while not any("TAKEOFF came too late" in text for text in notices):
                told = json.loads(await page.recv())
                notices += [told["text"]] if told["type"] == "notice" else []
            heard = [item.message.verb for item in site.commands.drain() if isinstance(item.message, m.Command)]
            assert heard == ([m.Verb.LAND] if good else []), "a start is not given the benefit of the doubt"

    run(test)


class Link:
    """A page behind a link of so many bytes a second, with the buffer that a kernel has; it answers each frame."""

    def __init__(self, bytes_per_s: float, buffer: int = 200_000) -> None:
        self.board = Snapshot()
        self.board.begin()
        self.viewer = PageConnection(1, self.board, self._send, self._send, time.monotonic_ns)
        self.answers = True
        self.frames: list[Any] = []
        self.ages_ms: list[float] = []
        self.pictures: list[bytes] = []
        self._rate, self._buffer, self._waiting = bytes_per_s, buffer, 0
        self._queue: asyncio.Queue[str | bytes] = asyncio.Queue()

    async def _send(self, message: str | bytes) -> None:
        self._waiting += len(message)
        self._queue.put_nowait(message)
        while self._waiting > self._buffer:
            await asyncio.sleep(0.005)

    async def _carry(self) -> None:
        while True:
            message = await self._queue.get()
            await asyncio.sleep(len(message) / self._rate)
            self._waiting -= len(message)
            if isinstance(message, bytes):
                self.pictures.append(message)
                continue
            frame = json.loads(message)
            self.frames.append(frame)
            if "now" in frame:
                self.ages_ms.append(time.monotonic_ns() / NS_PER_MS - frame["now"])
            if self.answers and "seq" in frame:
                self.viewer.saw(frame["seq"])

    async def during(self, act: Callable[[], Awaitable[None]]) -> None:
        """Carry what is sent while something is done."""
        tasks = [asyncio.create_task(self._carry())]
        tasks.append(asyncio.create_task(self.viewer.run(lambda seq: json.dumps({"seq": seq}))))
        await act()
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def turn(self, value: str, period_s: float = 0.05) -> None:
        """Let one turn of the server pass."""
        self.board.begin()
        self.board.put("a", value)
        self.viewer.notice()
        await asyncio.sleep(period_s)


@pytest.mark.parametrize(("bytes_per_s", "oldest_ms", "pictures"), [(100_000, 900, 2), (10_000_000, 200, 40)])
def test_figures_and_answers_do_not_wait_for_pictures(bytes_per_s: float, oldest_ms: float, pictures: int) -> None:
    """Whenever one was sent, others wait already."""
    link, cameras = Link(bytes_per_s), ("a", "b", "c", "d")

    async def flight() -> None:
        link.viewer.watched = frozenset(cameras)
        for turn in range(80):
            for camera in cameras:
                link.viewer.show(camera, bytes(40_000))
            await link.turn(f"{turn}" + "x" * 1000)
        link.viewer.say('"urgent"')
        await asyncio.sleep(0.9)
        assert "urgent" in link.frames

    asyncio.run(link.during(flight))
    assert max(link.ages_ms) < oldest_ms
    assert len(link.pictures) >= pictures


def test_a_viewer_that_does_not_answer_gets_a_window_full_and_then_the_newest() -> None:
    link = Link(1e9)
    link.answers = False

    async def flight() -> None:
        for value in range(40):
            await link.turn(f"{value}", 0.0)
        await asyncio.sleep(0.1)
        assert link.frames[-1]["seq"] == WINDOW
        link.viewer.say('"urgent"')
        await asyncio.sleep(0.05)
        assert link.frames[-1] == "urgent", "answers are never held back"
        link.viewer.saw(WINDOW)
        await asyncio.sleep(0.05)
        assert link.frames[-1]["s"] == {"a": "39"} and link.viewer.skipped > 0

    asyncio.run(link.during(flight))


def test_a_viewer_that_does_not_answer_gets_one_picture_and_then_the_newest() -> None:
    link = Link(1e9)
    link.answers = False

    async def flight() -> None:
        link.viewer.watched = frozenset({"ceiling"})
        for value in range(40):
            link.viewer.show("ceiling", b"%d" % value)
            await link.turn(f"{value}", 0.0)
        await asyncio.sleep(0.1)
        assert len(link.pictures) == 1
        link.viewer.saw(link.frames[-1]["seq"])
        await asyncio.sleep(0.05)
        assert link.pictures[1:] == [b"39"]

    asyncio.run(link.during(flight))
