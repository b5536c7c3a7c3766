"""Networks of simulated runs, and messages about a port in use."""

import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from groundstation.bus.zenoh_bus import open_router
from groundstation.errors import GroundStationError
from groundstation.process import ports
from groundstation.supervisor import network, runtime_file
from groundstation.supervisor.runtime_file import ProcessRecord, RuntimeRecord

OWN = Path("/proc/self/comm").read_text().strip() + rf" \(pid {os.getpid()}\)"


@pytest.fixture(autouse=True)
def runtime(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


@pytest.fixture(params=["0.0.0.0", "::"])
def wildcard(request: pytest.FixtureRequest) -> Iterator[int]:
    """A port with a listener on all addresses, as web servers and Zenoh's routers have."""
    both = request.param == "::"
    family = socket.AF_INET6 if both else socket.AF_INET
    with socket.create_server((request.param, 0), family=family, dualstack_ipv6=both) as server:
        yield server.getsockname()[1]


def test_networks_never_meet_and_the_lock_follows_a_child(tmp_path: Path) -> None:
    first = network.claim(tmp_path, 4717)
    second = network.claim(tmp_path, 4717)
    assert first.prefix != second.prefix
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE, pass_fds=(first.lock,)) as child:
        first.release()
        third = network.claim(tmp_path, 4717)
        assert third.prefix != first.prefix, "an emulator that still lands keeps its addresses"
        child.communicate(b"\n")
    again = network.claim(tmp_path, 4717)
    assert again.prefix == first.prefix
    for held in (second, third, again):
        held.release()


def test_listener_on_all_addresses_moves_a_simulated_run_to_other_ports(
    tmp_path: Path, wildcard: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(network, "_STREAM_PORT", wildcard)
    net = network.claim(tmp_path, wildcard)
    try:
        assert wildcard < net.bus_port < wildcard + 20
        assert wildcard < net.stream_port < wildcard + 20
        open_router(net.endpoint.replace("tls/", "tcp/")).close()
        with socket.create_server(net.stream(0)):
            pass
    finally:
        net.release()


def test_listeners_on_all_ports_are_named(tmp_path: Path, wildcard: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(network, "_PORTS_TRIED", 1)
    with pytest.raises(GroundStationError, match=rf"port {wildcard} on 127[.\d]+ is taken by {OWN}"):
        network.claim(tmp_path, wildcard)
    network.claim(tmp_path, 4717).release()


def test_network_where_a_run_of_another_folder_listens_is_left_alone(tmp_path: Path) -> None:
    free = network.claim(tmp_path, 4717)
    free.release()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as emulator:
        emulator.bind((free.drone_address(0), 0))
        other = network.claim(tmp_path, 4717)
        assert other.prefix != free.prefix
        other.release()


def test_real_flight_says_who_holds_its_port(wildcard: int) -> None:
    with pytest.raises(GroundStationError, match=rf"^port {wildcard} on 127.0.0.1 is taken by {OWN}: .*bus.port"):
        network.require_free(f"tcp/127.0.0.1:{wildcard}")


def test_port_is_free_again_when_its_holder_has_gone() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    network.require_free(f"tcp/127.0.0.1:{port}")


def test_another_ground_station_is_named_by_its_run(wildcard: int) -> None:
    started = runtime_file.start_time(os.getpid()) or 0
    own = ProcessRecord("router", "router", os.getpid(), started)
    runtime_file.write(RuntimeRecord("lab", "lab.yaml", "tcp/127.0.0.1:1", "runs/x", "", ("drone_1",), own, (own,)))
    with pytest.raises(GroundStationError, match=f"taken by the ground station lab-{os.getpid()}, field lab.yaml"):
        network.require_free(f"tcp/127.0.0.1:{wildcard}")


def test_process_that_may_not_be_looked_at_is_another_users(
    wildcard: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "net").mkdir()
    for table in ("tcp", "tcp6"):
        (tmp_path / "net" / table).write_text(Path("/proc/net", table).read_text())
    (tmp_path / "4711").mkdir()  # its descriptors cannot be listed
    monkeypatch.setattr(ports, "_PROC", tmp_path)
    assert str(ports.holder_of("127.0.0.1", wildcard)) == "another user's process"


def test_holder_of_a_datagram_port_is_found() -> None:
    command = (
        "import socket; s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM); s.bind(('', 0));"
        "print(s.getsockname()[1], flush=True); input()"
    )
    with subprocess.Popen([sys.executable, "-c", command], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        port = json.loads(other.stdout.readline())
        assert ports.holder_of("127.64.1.11", port, socket.SOCK_DGRAM).pid == other.pid
        other.communicate(b"\n")


def test_a_port_that_a_simulator_of_firmware_would_have_is_named_before_anything_starts() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        with pytest.raises(GroundStationError, match=rf"pose of drone_2: .*127.0.0.1:{port} .UDP.*pid {os.getpid()}"):
            network.require_free_udp("the true pose of drone_2", "127.0.0.1", port)
    network.require_free_udp("the true pose of drone_2", "127.0.0.1", port)
    with pytest.raises(GroundStationError, match="Cannot assign requested address"):
        network.require_free_udp("the true pose of drone_2", "192.0.2.1", port)
