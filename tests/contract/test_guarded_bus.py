"""The bus of a run over real TLS: strangers can neither read nor write, and no member can speak as another."""

import json
import socket
import stat
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import pytest
from free_port import free_port

from groundstation.bus import topics, zenoh_bus
from groundstation.bus.access import AccessList
from groundstation.bus.api import Subscription
from groundstation.bus.messages import Command, Event, Severity, VelocitySetpoint, Verb
from groundstation.bus.roles import SHELLS, Identity, Member, Role, shell
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.errors import GroundStationError
from groundstation.supervisor.authority import make_identities

MEMBERS = (
    Member("supervisor", Role.SUPERVISOR, ("supervisor",)),
    Member("tracker", Role.TRACKER, ("tracker",)),
    Member("drone_1", Role.DRIVER, ("drone_1",), ("drone_1",)),
    Member("drone_2", Role.DRIVER, ("drone_2",), ("drone_2",)),
    Member("sim_bridge", Role.SIM_BRIDGE, ("sim_bridge",)),
    *SHELLS,
)
NAMES = ["router", *(member.name for member in MEMBERS)]
Join = Callable[..., ZenohBus]


@pytest.fixture(scope="module")
def endpoint() -> str:
    return f"tls/127.0.0.1:{free_port()}"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, endpoint: str) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("keys") / "lab-1"
    make_identities(folder, ["127.0.0.1"], NAMES)
    router = zenoh_bus.open_router(endpoint, Identity(str(folder), "router", "r"), AccessList("lab", MEMBERS))
    yield folder
    router.close()


@pytest.fixture
def join(endpoint: str, folder: Path) -> Iterator[Join]:
    buses: list[ZenohBus] = []

    def joined(name: str, source: str = "") -> ZenohBus:
        identity = Identity(str(folder), name, "r")
        buses.append(zenoh_bus.open_bus(endpoint, "lab", source or name, 2.0, identity))
        return buses[-1]

    yield joined
    for bus in buses:
        bus.close()


def event(bus: ZenohBus) -> None:
    bus.publish(topics.EVENT, Event(header=bus.header("x"), severity=Severity.INFO, text="x"))


def setpoint(bus: ZenohBus) -> None:
    message = VelocitySetpoint(
        header=bus.header("drone_1"), velocity_m_s=(1.0, 0.0, 0.0), yaw_rate_rad_s=0.0, lifetime_ms=300, epoch=10**15
    )
    bus.publish(topics.SETPOINT, message)


def order(bus: ZenohBus) -> None:
    header = bus.header("team")
    bus.publish(topics.COMMAND, Command(header=header, id="x", verb=Verb.LAND, scope=(), issuer=bus.source))


def heard(say: Callable[[], None], subscription: Subscription, until: Callable[[], None] | None = None) -> int:
    """Return how many messages arrived, publishing until one did, or until a control message did."""
    for _ in range(60):
        say()
        if until is not None:
            until()
        if subscription.wait(0.02):
            break
    time.sleep(0.02)
    return len(subscription.drain_samples())


def test_members_hear_what_each_may_say(join: Join) -> None:
    tracker, driver, cli = join("tracker"), join("drone_1"), join(shell(Role.CLI), "cli_17")
    assert heard(lambda: setpoint(tracker), driver.subscribe([topics.SETPOINT], entity="drone_1"))
    assert heard(lambda: order(cli), driver.subscribe([topics.COMMAND]))
    assert heard(lambda: event(driver), join(shell(Role.VIEW), "view_17").subscribe([topics.EVENT]))


@pytest.mark.parametrize(
    ("name", "source", "say"),
    [
        pytest.param("drone_2", "tracker", setpoint, id="a driver as the tracker"),
        pytest.param("drone_2", "drone_2", setpoint, id="a driver, a setpoint"),
        pytest.param(shell(Role.CLI), "tracker", setpoint, id="a shell as the tracker"),
        pytest.param(shell(Role.CLI), "supervisor", order, id="a shell as the operator"),
        pytest.param(shell(Role.VIEW), "view_1", order, id="a view, an order"),
        pytest.param("tracker", "drone_1", order, id="the tracker as a driver"),
    ],
)
def test_nobody_speaks_as_another(join: Join, name: str, source: str, say: Callable[[ZenohBus], None]) -> None:
    liar, witness = join(name, source), join("supervisor")
    control = witness.subscribe([topics.EVENT], source="drone_1")
    forged = witness.subscribe([topics.SETPOINT, topics.COMMAND])
    member = join("drone_1")
    assert heard(lambda: say(liar), control, lambda: event(member)), "the bus works"
    say(liar)
    assert heard(lambda: None, control, lambda: event(member)), "and what was said after it arrives"
    assert forged.drain_samples() == []


def test_wildcard_put_reaches_nobody(join: Join) -> None:
    tracker, driver = join("tracker"), join("drone_1")
    forged = driver.subscribe([topics.COMMAND, topics.SETPOINT])
    control = driver.subscribe([topics.EVENT], source="tracker")
    for key in ("gs/@v1/lab/*/command/**", "gs/@v1/lab/**", "gs/@v1/*/*/setpoint/tracker"):
        tracker._session.put(key, b"x")
    assert heard(lambda: event(tracker), control)
    assert forged.drain_samples() == []


def test_truth_does_not_reach_what_flies(join: Join) -> None:
    simulator, tracker, view = join("sim_bridge"), join("tracker"), join(shell(Role.VIEW), "view_1")
    secret, seen = tracker.subscribe([topics.TRUTH]), view.subscribe([topics.TRUTH])

    def say() -> None:
        header = simulator.header("drone_1")
        simulator.publish_bytes(topics.TRUTH, header, b"x")

    assert heard(say, seen)
    assert secret.drain_samples() == []


def test_strangers_do_not_get_in(endpoint: str, folder: Path, tmp_path: Path) -> None:
    make_identities(tmp_path / "other", ["127.0.0.1"], ["tracker"])
    forged = tmp_path / "forged"
    make_identities(forged, ["127.0.0.1"], ["tracker"])
    (forged / zenoh_bus.AUTHORITY).write_bytes((folder / zenoh_bus.AUTHORITY).read_bytes())
    plain = endpoint.replace("tls/", "tcp/")
    for address, identity in (
        (plain, None),
        (endpoint, None),
        (endpoint, Identity(str(tmp_path / "other"), "tracker", "r")),
        (endpoint, Identity(str(forged), "tracker", "r")),
    ):
        with pytest.raises(GroundStationError, match="no router answers"):
            zenoh_bus.open_bus(address, "lab", "tracker", 0.0, identity)


def test_keys_are_for_their_owner(folder: Path) -> None:
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert {stat.S_IMODE(path.stat().st_mode) for path in folder.iterdir()} == {0o600}
    assert not any("PRIVATE" in path.read_text() for path in folder.glob("authority*")), "nobody signs later"


def test_half_open_connections_keep_no_member_out(join: Join, endpoint: str) -> None:
    host, _, port = endpoint.removeprefix("tls/").rpartition(":")
    open_ends = [socket.create_connection((host, int(port))) for _ in range(50)]
    try:
        began = time.monotonic()
        join("drone_1")
        assert time.monotonic() - began < 1.5
    finally:
        for one in open_ends:
            one.close()


READER = """
import json, os, sys
import msgspec
from groundstation.bus.access import AccessList
from groundstation.bus.roles import Identity
from groundstation.bus.zenoh_bus import open_router
from groundstation.runtime.router_refusals import RouterRefusals
out = os.fdopen(os.dup(1), "w", 1)
refusals = RouterRefusals()
access = msgspec.json.decode(sys.argv[3], type=AccessList)
router = open_router(sys.argv[1], Identity(sys.argv[2], "router", "r"), access, trace=True)
print("ready", file=out)
for turn, _ in enumerate(sys.stdin):
    print(json.dumps(refusals.take(turn * 20_000_000_000)), file=out)
router.close()
refusals.close()
"""


@pytest.fixture
def told(tmp_path: Path) -> Iterator[tuple[Join, Callable[[], list[str]]]]:
    """Start a guarded router in its own process: how to join it, and its refusals since the last query."""
    endpoint = f"tls/127.0.0.1:{free_port()}"
    make_identities(tmp_path / "keys", ["127.0.0.1"], NAMES)
    access = msgspec.json.encode(AccessList("lab", MEMBERS)).decode()
    command = [sys.executable, "-c", READER, endpoint, str(tmp_path / "keys"), access]
    router = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert router.stdin and router.stdout and router.stdout.readline() == "ready\n"
    buses: list[ZenohBus] = []

    def joined(name: str, source: str = "", patience_s: float = 2.0) -> ZenohBus:
        identity = Identity(str(tmp_path / "keys"), name, "r")
        buses.append(zenoh_bus.open_bus(endpoint, "lab", source or name, patience_s, identity))
        return buses[-1]

    def refused() -> list[str]:
        assert router.stdin and router.stdout
        print("?", file=router.stdin, flush=True)
        texts: list[str] = json.loads(router.stdout.readline())
        return texts

    yield joined, refused
    for bus in buses:
        bus.close()
    router.communicate(timeout=10)


def until_told(refused: Callable[[], list[str]]) -> list[str]:
    for _ in range(100):
        if texts := refused():
            return texts
        time.sleep(0.02)
    return []


def test_a_member_that_publishes_without_the_right_is_named(told: tuple[Join, Callable[[], list[str]]]) -> None:
    join, refused = told
    tracker, driver, liar = join("tracker"), join("drone_1"), join("drone_2", "tracker")
    heard_by = driver.subscribe([topics.SETPOINT], entity="drone_1")
    assert heard(lambda: setpoint(tracker), heard_by)
    assert refused() == [], "who subscribes, and who says what it may, is not refused"
    setpoint(liar)
    (text,) = until_told(refused)
    assert text == "the bus refused messages of drone_2: it may not publish setpoint of drone_1 as tracker"
    join(shell(Role.CLI), "cli_17")._session.put("gs/@v1/lab/**", b"x")  # without a declaration, as an attacker would
    (text,) = until_told(refused)
    assert "messages of cli-shell: it may not publish under a key that is not in the table" in text
    assert refused() == []


def test_a_flood_of_refusals_neither_stalls_the_bus_nor_fills_the_terminal(
    told: tuple[Join, Callable[[], list[str]]],
) -> None:
    join, refused = told
    tracker, driver, liar = join("tracker"), join("drone_1"), join("drone_2", "tracker")
    heard_by = driver.subscribe([topics.SETPOINT], entity="drone_1")
    for _ in range(8000):  # more than the pipe holds
        setpoint(liar)
    assert heard(lambda: setpoint(tracker), heard_by)
    assert len(until_told(refused)) == 1


def test_a_stranger_is_told_once_in_ten_seconds(told: tuple[Join, Callable[[], list[str]]], tmp_path: Path) -> None:
    join, refused = told
    make_identities(tmp_path / "other", ["127.0.0.1"], ["tracker"])
    own = tmp_path / "keys"
    for name in ("tracker.pem", "tracker.key"):
        (own / name).write_bytes((tmp_path / "other" / name).read_bytes())
    with pytest.raises(GroundStationError, match="no router answers"):
        join("tracker", patience_s=0.0)
    (text,) = until_told(refused)
    assert "connections of programs that are not of this run" in text


def test_a_run_whose_certificates_are_gone_says_so_and_not_that_no_router_answers(tmp_path: Path) -> None:
    """As after the last logout of a user whose runtime folder does not stay."""
    with pytest.raises(GroundStationError, match=r"the certificate .* of this run is gone: land"):
        zenoh_bus.open_bus("tls/127.0.0.1:1", "lab", "tracker", 5.0, Identity(str(tmp_path), "tracker", "run-7"))
