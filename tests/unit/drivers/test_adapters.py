"""Sockets bound to one network adapter: on loopback's own, and refused where there is none."""

import json
import socket
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from drivers.ardrone.conversation import Conversation
from drivers.ardrone.link import ArDroneLink
from drivers.ardrone.network_setup import own_hardware_address
from drivers.ardrone.queries import read_dump, read_version
from drivers.ardrone.settings import ArDroneDriverSettings
from drivers.camera.source_address import behind_adapter, parse_source
from drivers.camera.sources.tcp import Line
from drivers.datagrams import DatagramLog
from drivers.mavlink.failsafe_transport import MavlinkFailsafe
from drivers.mavlink.links.udp import UdpLink
from drivers.mavlink.settings import LinkSettings
from drivers.tello.driver import Tello
from drivers.tello.settings import TelloDriverSettings
from groundstation.adapters import (
    bind_to_adapter,
    connected,
    drops_strangers,
    how_to_reach,
    send_to_all,
    split_zone,
    with_zone,
)
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.errors import DriverError
from groundstation.supervisor.failsafe_sender import FailsafeSender
from groundstation.supervisor.process_spec import FailsafeDatagrams

GONE = "wlan97"
REFUSED = r"interface wlan97: there is no such network adapter here, only .*lo.*; plugged in\? see: ip link"


def bus() -> MemoryBus:
    return MemoryBus(MemoryExchange(), "lab", "drone_1")


def ardrone(interface: str) -> ArDroneLink:
    settings = ArDroneDriverSettings(name="drone_1", address="127.0.0.1", interface=interface)
    return ArDroneLink(settings, DatagramLog(bus(), "drone_1", enabled=False))


def tello(interface: str) -> Tello:
    return Tello(TelloDriverSettings(name="drone_1", address="127.0.0.1", interface=interface, pad_m=(0, 0)), bus())


def mavlink(interface: str) -> UdpLink:
    return UdpLink(LinkSettings(target=f"udpout:{with_zone('127.0.0.1', interface)}:14550"))


def mavlink_failsafe(interface: str) -> MavlinkFailsafe:
    return MavlinkFailsafe(json.dumps({"serial": "", "key_file": "", "interface": interface}), 2)


def conversation(interface: str) -> Conversation:
    return Conversation(with_zone("127.0.0.1", interface))


@pytest.mark.parametrize("open_one", [ardrone, tello, mavlink, mavlink_failsafe, conversation])
def test_vehicle_links_use_their_network_adapter_or_report_its_absence(
    open_one: Callable[[str], ArDroneLink], monkeypatch: pytest.MonkeyPatch
) -> None:
    chosen: list[str] = []
    honest = socket.socket.setsockopt

    def watched(one: socket.socket, level: int, option: int, value: Any) -> None:
        if option == socket.SO_BINDTODEVICE:
            chosen.append(bytes(value).decode())
        honest(one, level, option, value)

    monkeypatch.setattr(socket.socket, "setsockopt", watched, raising=False)
    open_one("").close()
    assert chosen == []
    open_one("lo").close()
    assert set(chosen) == {"lo"}
    with pytest.raises(DriverError, match=REFUSED):
        open_one(GONE)


def test_the_guardian_says_before_a_flight_that_it_could_not_speak() -> None:
    def words(interface: str) -> FailsafeDatagrams:
        return FailsafeDatagrams("127.0.0.1", 5556, b"hover", b"land", interface=interface)

    with closing(FailsafeSender()) as sender:
        assert sender.prepare("drone_1", words("lo")) == ""
        assert "interface wlan97: there is no such network adapter" in sender.prepare("drone_2", words(GONE))


def test_a_user_without_the_right_is_told_which() -> None:
    class Refusing(socket.socket):
        def setsockopt(self, *_: object) -> None:
            raise PermissionError(1, "Operation not permitted")

    one = Refusing(socket.AF_INET, socket.SOCK_DGRAM)
    with pytest.raises(DriverError, match=r"interface wlan1: this user may not .* Linux before 5.7 .* CAP_NET_RAW"):
        bind_to_adapter(one, "wlan1")
    assert one.fileno() == -1, "nobody else would close it"


def test_connections_go_through_the_adapter_too() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        host, port = server.getsockname()
        place = (str(host), int(port))
        with connected(place, 1.0, "lo") as stream, server.accept()[0] as other:
            other.sendall(b"there")
            assert stream.recv(16) == b"there"
        with Line(host, port, "lo").open() as stream:
            assert stream.getsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, 16).startswith(b"lo")
        assert Line(host, port, "lo").name == f"127.0.0.1%lo:{port}"
        with pytest.raises(DriverError, match=REFUSED), Line(host, port, GONE).open():
            pass
    with pytest.raises(OSError, match="refused"):
        connected(place, 1.0, "lo")


def test_questions_to_an_adapter_that_is_gone_stay_without_answer() -> None:
    assert read_version(f"127.0.0.1%{GONE}", 5551) == ""
    assert read_dump(f"127.0.0.1%{GONE}", 5559, lambda: None) == b""
    with pytest.raises(DriverError, match=REFUSED):
        own_hardware_address(f"127.0.0.1%{GONE}")


@pytest.mark.parametrize(("text", "parts"), [("10.0.0.1%wlan1", ("10.0.0.1", "wlan1")), ("10.0.0.1", ("10.0.0.1", ""))])
def test_an_address_names_its_adapter_as_in_ipv6(text: str, parts: tuple[str, str]) -> None:
    assert split_zone(text) == parts and with_zone(*parts) == text


def test_a_camera_source_names_its_adapter_too() -> None:
    source = parse_source("http://me:p%40ss@10.0.0.1%wlan1:8080/a.mjpg?x=1")
    assert (source.host, source.port, source.interface, source.login) == ("10.0.0.1", 8080, "wlan1", "me:p@ss")
    assert behind_adapter("ardrone://10.0.0.1", "wlan1") == "ardrone://10.0.0.1%wlan1"
    whole = "http://me:p%40ss@10.0.0.1:8080/a.mjpg?x=1"
    assert behind_adapter(whole, "wlan1") == "http://me:p%40ss@10.0.0.1%wlan1:8080/a.mjpg?x=1"
    with pytest.raises(ValueError, match=r"cannot be behind an adapter \(%wlan1\)"):
        parse_source("rtsp://10.0.0.1%wlan1/stream")


@pytest.mark.parametrize(
    ("everywhere", "here", "drops"), [("0", "0", False), ("1", "0", True), ("0", "1", True), ("2", "1", False)]
)
def test_strict_filters_of_the_kernel_are_known(tmp_path: Path, everywhere: str, here: str, drops: bool) -> None:
    for name, value in (("all", everywhere), ("wlan1", here)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "rp_filter").write_text(f"{value}\n")
    assert drops_strangers("wlan1", tmp_path) is drops
    assert not drops_strangers("wlan2", tmp_path) or everywhere == "1"


@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("10.0.0.11", "this computer is in its network: ping 10.0.0.11"),
        ("udpout:10.0.0.11:14550", "this computer is in its network: ping 10.0.0.11"),
        ("udpout:10.0.0.11%wlan1:14550", "this computer is in its network: ping -I wlan1 10.0.0.11"),
        ("udpin:0.0.0.0:14550", "calls port 14550 of this computer"),
        ("serial:/dev/ttyUSB0:921600", "this one at /dev/ttyUSB0, 921600 baud"),
    ],
)
def test_the_remedy_for_a_silent_vehicle_can_be_carried_out(address: str, words: str) -> None:
    assert words in how_to_reach(address)


def test_one_address_that_fails_does_not_silence_those_after_it() -> None:
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as ear:
        ear.bind(("127.0.0.1", 0))
        ear.settimeout(2.0)
        with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as transport, pytest.raises(OSError):
            send_to_all(transport, [b"land"], [("127.0.0.1", 0), ear.getsockname()])
        assert ear.recv(10) == b"land"
