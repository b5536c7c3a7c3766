"""What the server makes of pages behind slow links."""

import json

import pytest
from console_site import Site, land, run

from groundstation.bus import clock
from groundstation.bus import messages as m


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
