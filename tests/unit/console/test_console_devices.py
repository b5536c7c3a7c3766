"""Tablets and phones on the network: one invitation each, TLS, rights by role."""

import asyncio
import contextlib
import json
import os
import shutil
import ssl
import stat
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from console_site import Site, land, run, until
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import InvalidStatus
from websockets.typing import Origin

from groundstation.bus import messages as m
from groundstation.console.devices import DeviceRole, Devices
from groundstation.console.network import Network
from groundstation.console.server import claim_port

ADDRESS = "127.0.0.1"
LAX = ssl.create_default_context()
LAX.check_hostname, LAX.verify_mode = False, ssl.CERT_NONE  # as a person does who compares the fingerprint


class Tablet:
    """A device without an earlier visit."""

    def __init__(self, port: int) -> None:
        self.site, self.cookie = f"https://{ADDRESS}:{port}", ""
        self._port = port

    async def get(self, path: str, host: str = "") -> tuple[int, str, bytes]:
        reader, writer = await asyncio.open_connection(ADDRESS, self._port, ssl=LAX)
        host = host or f"{ADDRESS}:{self._port}"
        cookie = f"Cookie: {self.cookie}\r\n" if self.cookie else ""
        writer.write(f"GET {path} HTTP/1.1\r\nHost: {host}\r\n{cookie}Connection: close\r\n\r\n".encode("latin-1"))
        head, _, body = (await asyncio.wait_for(reader.read(), 5)).partition(b"\r\n\r\n")
        writer.close()
        return int(head.split()[1]), head.decode(), body

    async def enter(self, invitation: str) -> int:
        status, head, _ = await self.get(invitation.removeprefix(self.site))
        for line in head.splitlines():
            if line.lower().startswith("set-cookie: "):
                self.cookie = line.partition(": ")[2].partition(";")[0]
        return status

    def page(self, origin: str = "") -> connect:
        return connect(
            f"wss://{ADDRESS}:{self._port}/ws",
            origin=Origin(origin or self.site),
            ssl=LAX,
            max_size=None,
            additional_headers={"Cookie": self.cookie},
        )


Visit = Callable[[Site, Devices, Tablet], Awaitable[None]]


def visited(tmp_path: Path, visit: Visit) -> None:
    devices = Devices(tmp_path / "devices")
    network = Network.over(claim_port(38785, ADDRESS), devices)
    port = network.listener.getsockname()[1]

    async def test(site: Site) -> None:
        await visit(site, devices, Tablet(port))

    run(test, network)


def test_an_invitation_lets_one_device_in_once(tmp_path: Path) -> None:
    async def visit(site: Site, devices: Devices, tablet: Tablet) -> None:
        assert (await tablet.get("/"))[0] == (await tablet.get("/token"))[0] == 403
        invitation = devices.invite(DeviceRole.STOP)
        assert await tablet.enter(invitation) == 303
        status, head, body = await tablet.get("/")
        assert status == 200 and b"<title>" in body and "wss://" in head
        thief = Tablet(tablet._port)
        assert await thief.enter(invitation) == 403 and not thief.cookie
        assert (await tablet.get("/", host="evil.example:443"))[0] == 403
        with pytest.raises(InvalidStatus):
            async with tablet.page(origin="https://evil.example"):
                pass
        assert site.server.refused["device"] == 3 and site.server.refused["other_site"] == 2

    visited(tmp_path, visit)


@pytest.mark.parametrize("role", DeviceRole)
def test_a_device_may_what_its_role_says(tmp_path: Path, role: DeviceRole) -> None:
    async def visit(site: Site, devices: Devices, tablet: Tablet) -> None:
        await tablet.enter(devices.invite(role))
        token = (await tablet.get("/token"))[2].decode()
        async with tablet.page() as page:
            await page.send(json.dumps({"type": "hello", "token": token, "client": "abcd"}))
            for said in (land(verb="TAKEOFF", ref="start"), '{"type":"takeover"}', land(ref="stop")):
                await page.send(said)
            told, heard = "", []
            async with asyncio.timeout(5):
                while "welcome" not in told or (role is DeviceRole.WATCH and told.count("may watch only") < 3):
                    message = await page.recv()
                    told += message if isinstance(message, str) else ""
            if role is not DeviceRole.WATCH:
                heard = await until(site.commands.drain)
            await asyncio.sleep(0.1)
            heard += site.commands.drain()
        verbs = {received.message.verb for received in heard}
        refused, operator = site.server.sessions.refused["role"], site.server.sessions.operator_lock.client
        assert f'"role":"{role}"' in told
        assert (m.Verb.LAND in verbs) is (role is not DeviceRole.WATCH)
        assert operator == ("abcd" if role is DeviceRole.COMMAND else "")
        assert refused == {DeviceRole.WATCH: 3, DeviceRole.STOP: 2, DeviceRole.COMMAND: 0}[role]

    visited(tmp_path, visit)


@pytest.mark.parametrize("role", [DeviceRole.COMMAND, DeviceRole.WATCH])
def test_a_device_that_is_invited_anew_may_what_the_new_invitation_says(tmp_path: Path, role: DeviceRole) -> None:
    async def visit(site: Site, devices: Devices, tablet: Tablet) -> None:
        await tablet.enter(devices.invite(DeviceRole.STOP))
        former, invitation = tablet.cookie, devices.invite(role)
        assert await tablet.enter(invitation) == 303
        async with tablet.page() as page:
            await page.send(json.dumps({"type": "hello", "token": "guess", "client": "abcd"}))
            async with asyncio.timeout(5):
                while f'"role":"{role}"' not in str(await page.recv()):
                    pass
        assert await tablet.enter(invitation) == 200, "it is used up, and the device stays known"
        assert tablet.cookie != former
        tablet.cookie = former
        assert (await tablet.get("/"))[0] == 403

    visited(tmp_path, visit)


async def greeted(page: ClientConnection, token: str) -> None:
    await page.send(json.dumps({"type": "hello", "token": token, "client": "abcd"}))
    async with asyncio.timeout(5):
        while '"welcome"' not in str(await page.recv()):
            pass


@pytest.mark.parametrize("anew", [True, False])
def test_a_page_that_is_open_loses_its_rights_with_its_device(tmp_path: Path, anew: bool) -> None:
    async def visit(site: Site, devices: Devices, tablet: Tablet) -> None:
        await tablet.enter(devices.invite(DeviceRole.COMMAND))
        token, lock = (await tablet.get("/token"))[2].decode(), site.server.sessions.operator_lock
        async with tablet.page() as page:
            await greeted(page, token)
            await page.send('{"type":"takeover"}')
            await until(lambda: lock.client == "abcd")
            if anew:
                await tablet.enter(devices.invite(DeviceRole.WATCH))
            else:
                assert devices.uninvite() == 1
            await page.send(land())
            assert await site.closed(page) == (1008, "message refused: uninvited")
        assert site.commands.drain() == []
        if not anew:
            assert (await tablet.get("/"))[0] == 403
            return
        async with tablet.page() as page:
            await greeted(page, token)
            assert lock.client == "", "another page need not take over from one that may only watch"

    visited(tmp_path, visit)


def test_no_page_loses_its_stop_with_the_folder_of_a_dead_supervisor(tmp_path: Path) -> None:
    async def visit(site: Site, devices: Devices, tablet: Tablet) -> None:
        await tablet.enter(devices.invite(DeviceRole.STOP))
        async with tablet.page() as page:
            await greeted(page, (await tablet.get("/token"))[2].decode())
            shutil.rmtree(tmp_path / "devices")
            await page.send(land())
            assert {received.message.verb for received in await until(site.commands.drain)} == {m.Verb.LAND}

    visited(tmp_path, visit)


def test_an_invitation_that_was_withdrawn_lets_nobody_in(tmp_path: Path) -> None:
    devices = Devices(tmp_path / "devices")
    devices.open(ADDRESS, 1)
    code = devices.invite(DeviceRole.COMMAND).partition("?")[2].encode()
    assert devices.uninvite() == 1 and devices.uninvite() == 0
    assert devices.welcome(asked(code)) == b"" and devices.url


@pytest.mark.parametrize("odd", ['theme={"a": 1, "b": [2]}', "na me=x", "flag", "=", 'quoted="a; b', "caf\xe9=\xe9"])
def test_odd_cookies_of_other_programs_on_the_host_hide_no_device(tmp_path: Path, odd: str) -> None:
    async def visit(site: Site, devices: Devices, tablet: Tablet) -> None:
        await tablet.enter(devices.invite(DeviceRole.WATCH))
        name, _, token = tablet.cookie.partition("=")
        assert name == f"__Host-skein-{tablet._port}", "another console of the host has its own"
        for cookie in (f"{odd}; {name}={token}", f"{name}={token}; {odd}"):
            tablet.cookie = cookie
            assert (await tablet.get("/"))[0] == 200
        for cookie in (f"x{name}={token}", f"{name}x={token}", f"a={name}={token}", f"{name}="):
            tablet.cookie = cookie
            assert (await tablet.get("/"))[0] == 403

    visited(tmp_path, visit)


def test_one_address_of_the_network_has_so_many_connections_at_most(tmp_path: Path) -> None:
    async def visit(site: Site, devices: Devices, tablet: Tablet) -> None:
        await tablet.enter(devices.invite(DeviceRole.WATCH))
        site.server.peers._most = 3
        async with tablet.page(), tablet.page(), tablet.page():
            with pytest.raises((OSError, IndexError)):  # ended before an answer
                await tablet.get("/")
            assert site.server.refused["crowd"] >= 1
            assert (await site.request("/"))[0] == 200, "the operator's own page comes by loopback"
        await until(lambda: all(one.is_closing() for ones in site.server.peers._open.values() for one in ones))
        assert (await tablet.get("/"))[0] == 200

    visited(tmp_path, visit)


def test_a_console_that_is_restarted_knows_its_devices_and_shows_the_same_certificate(tmp_path: Path) -> None:
    folder, tablets, prints = tmp_path, [], []

    async def first(site: Site, devices: Devices, tablet: Tablet) -> None:
        await tablet.enter(devices.invite(DeviceRole.WATCH))
        tablets.append(tablet)
        prints.append(devices.fingerprint)

    async def second(site: Site, devices: Devices, tablet: Tablet) -> None:
        tablet.cookie = tablets[0].cookie
        assert (await tablet.get("/"))[0] == 200
        assert devices.fingerprint == prints[0]

    visited(folder, first)
    visited(folder, second)


def test_silent_strangers_are_shown_out_before_they_speak_tls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("groundstation.console.network.PATIENCE_S", 0.3)

    async def visit(site: Site, devices: Devices, tablet: Tablet) -> None:
        silent = [await asyncio.open_connection(ADDRESS, tablet._port) for _ in range(200)]
        assert (await tablet.get("/"))[0] == 403
        async with asyncio.timeout(5):
            for reader, writer in silent:
                with contextlib.suppress(ConnectionError):
                    assert await reader.read() == b""
                writer.close()

    visited(tmp_path, visit)


def asked(query: bytes) -> dict[str, Any]:
    return {"query_string": query, "headers": [], "server": (ADDRESS, 1)}


def test_an_old_invitation_is_none_and_all_is_for_its_owner(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    devices = Devices(tmp_path / "devices")
    devices.open(ADDRESS, 1)
    code = devices.invite(DeviceRole.COMMAND).partition("?")[2].encode()
    kept = list((tmp_path / "devices").iterdir())
    assert {stat.S_IMODE(path.stat().st_mode) for path in kept} == {0o600}
    assert stat.S_IMODE((tmp_path / "devices").stat().st_mode) == 0o700
    assert not any(code.removeprefix(b"code=") in path.read_bytes() + os.fsencode(path) for path in kept)
    monkeypatch.setattr("groundstation.console.devices.time.time", lambda: max(p.stat().st_mtime for p in kept) + 601)
    assert devices.welcome(asked(code)) == b""
    assert devices.welcome(asked(b"code=../../url")) == devices.welcome(asked(b"")) == b""


@pytest.mark.parametrize(("later_s", "let_in"), [(500.0, True), (-500.0, True), (601.0, False), (-3600.0, False)])
def test_a_clock_that_was_set_keeps_no_invitation_alive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, later_s: float, let_in: bool
) -> None:
    devices = Devices(tmp_path / "devices")
    devices.open(ADDRESS, 1)
    code = devices.invite(DeviceRole.COMMAND).partition("?")[2].encode()
    then_s = time.time()
    monkeypatch.setattr("groundstation.console.devices.time.time", lambda: then_s + later_s)
    assert bool(devices.welcome(asked(code))) == let_in
