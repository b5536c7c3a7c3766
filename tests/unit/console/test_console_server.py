"""The server on a real socket: access, output, and the cost of a bad or slow viewer."""

import asyncio
import json
import socket
from pathlib import Path

import pytest
from console_site import RUN, Site, land, run, until
from websockets.exceptions import ConnectionClosed, InvalidStatus

from groundstation.bus import clock
from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.memory_bus import MemoryBus
from groundstation.console import server
from groundstation.console.access import refusal
from groundstation.console.pages import load_pages
from groundstation.console.run_end import read_end
from groundstation.console.server import claim_port
from groundstation.console.viewer import WINDOW
from groundstation.report import run_facts


def test_pages_and_their_headers() -> None:
    async def test(site: Site) -> None:
        status, head, body = await site.request("/")
        assert status == 200 and b"@@" not in body and (await site.token()).encode() in body and RUN.encode() in body
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


def test_where_a_target_may_be_that_is_searched_for_reaches_the_page() -> None:
    site = Site()
    tracker, now_ns = MemoryBus(site.exchange, "lab", "tracker"), clock.now_ns()
    cells = m.SearchMap(header=tracker.header("turtlebot"), first_m=(0.0, 0.0), cell_m=0.2, columns=2, chances=(0, 255))
    search = m.TargetSearch("turtlebot", "SEARCH", 2.0, (0.4, 0.0), 0.1, None, "searched for 2 s")
    tracker.publish(t.SEARCH_MAP, cells)
    tracker.publish(t.ESTIMATE, m.Estimate(header=tracker.header("team"), entities=(), epoch=1, searches=(search,)))
    for turn in range(10):
        site.server.turn(now_ns + turn * 50_000_000)
    site.server._listener.close()
    assert json.loads(site.server.board.since(-1))["search_maps"]["turtlebot"]["chances"] == [0, 255]


def test_viewers_hear_how_the_run_ended_before_they_are_cut_off() -> None:
    async def test(site: Site) -> None:
        async with site.connect() as page:
            await page.recv()
            end = m.Event(header=site.drone.header(m.RUN), severity=m.Severity.INFO, text="run ended: all is well")
            site.drone.publish(t.EVENT, end)
            site.over = True  # at the same moment: the event is still on its way
            heard = []
            with pytest.raises(ConnectionClosed):
                async with asyncio.timeout(5):
                    while True:
                        heard.append(json.loads(await page.recv()))
            at_ms = end.header.stamp_ns / 1e6
            ended = {"text": "run ended: all is well", "severity": "INFO", "at": at_ms, "closed": False, "down": False}
            assert heard[-1]["s"]["ended"] == ended

    run(test)


def test_what_is_said_about_a_run_does_not_end_it() -> None:
    """As after Ctrl-Z in its terminal: pages called the run over, and no order could be given any more."""

    async def test(site: Site) -> None:
        async with site.connect() as page:
            await page.recv()
            said = m.Event(header=site.drone.header(m.RUN), severity=m.Severity.INFO, text="Ctrl-Z does nothing here")
            site.drone.publish(t.EVENT, said)
            sections: dict[str, object] = {}
            while "events" not in sections:
                sections |= json.loads(await page.recv())["s"]
            sections |= json.loads(await page.recv())["s"]
            assert "ended" not in sections

    run(test)


@pytest.mark.parametrize("keeps", [True, False])
def test_the_result_is_shown_until_the_page_keeps_it_or_it_took_too_long(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, keeps: bool
) -> None:
    monkeypatch.setattr(server, "_KEEPING_S", 20.0 if keeps else 0.3)
    run_facts.write(tmp_path, run_facts.RunFacts(command="groundstation fly lab.yaml"))
    (tmp_path / "report.json").write_text('{"verdict": "failed", "reasons": ["too late"], "figures": 1}')
    (tmp_path / "report.html").write_text("<p>the report</p>")

    async def test(site: Site) -> None:
        async with site.connect() as page:
            await page.recv()
            assert (await site.request("/report.html"))[0] == 404, "it is not judged yet"
            end = m.Event(header=site.drone.header(m.RUN), severity=m.Severity.INFO, text="run ended: all is well")
            site.drone.publish(t.EVENT, end)
            site.over, site.end = True, read_end(tmp_path)
            while "result" not in (frame := json.loads(await page.recv()))["s"]:
                pass
            result = frame["s"]["result"]
            assert (result["verdict"], result["reasons"]) == ("failed", ["too late"])
            assert (result["command"], result["folder"]) == ("groundstation fly lab.yaml", str(tmp_path))
            assert (await site.request(result["report"]))[2] == b"<p>the report</p>"
            if keeps:
                await page.send(json.dumps({"type": "kept"}))
            assert (await site.closed(page))[0] == 1012  # the server goes

    run(test)


def test_a_folder_that_says_nothing_has_no_end(tmp_path: Path) -> None:
    assert read_end(tmp_path / "none") is None
    (tmp_path / "report.json").write_text("torn")
    assert read_end(tmp_path) is None
    run_facts.write(tmp_path, run_facts.RunFacts(command="groundstation demo"))
    unjudged = read_end(tmp_path)
    assert unjudged is not None and (unjudged.verdict, unjudged.section()["report"]) == ("", "")


def test_an_order_reaches_the_bus_with_the_token_only() -> None:
    async def test(site: Site) -> None:
        token = await site.token()
        async with site.connect() as page:
            await page.send(json.dumps({"type": "hello", "token": "guess", "client": "abcd"}))
            await page.send(land())
            await until(lambda: site.server.sessions.refused["untrusted"])
            assert site.commands.drain() == []
            await page.send(json.dumps({"type": "hello", "token": token, "client": "abcd"}))
            await page.send(land())
            (received,) = await until(site.commands.drain)
            assert received.message.verb is m.Verb.LAND

    run(test)


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
    """The page works without any network but loopback: its files contain no other address."""
    for path, file in load_pages("x", "y").items():
        text = file.content.decode()
        if path.startswith("/vendor/"):
            assert "http" not in text.split("*/", 1)[-1] or path.endswith(".txt"), path
            continue
        for word in ("https://", "http://", "//cdn"):
            assert word not in text.replace("http://www.w3.org/2000/svg", ""), (path, word)
        assert "innerHTML" not in text and "eval(" not in text, path
