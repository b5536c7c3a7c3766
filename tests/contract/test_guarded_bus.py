"""The bus of a run over real TLS: strangers hear and move nothing, and nobody speaks as another."""

import os
import socket
import stat
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest

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
    with closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tls/127.0.0.1:{probe.getsockname()[1]}"


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
    """Return how many came, after saying it until something did, or until a control message did."""
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


def test_refused_strangers_are_counted() -> None:
    code = (
        "import os, time\n"
        "from groundstation.runtime.refused_strangers import RefusedStrangers\n"
        "strangers = RefusedStrangers()\n"
        "for _ in range(3): os.write(1, b'WARN acc-0 zenoh_link_tls::unicast: eof\\n')\n"
        "os.write(1, b'another line\\n')\n"
        "deadline = time.monotonic() + 5\n"
        "total = 0\n"
        "while total < 3 and time.monotonic() < deadline: total += strangers.take(total * 20_000_000_000)\n"
        "assert strangers.take(0) == 0\n"
        "strangers.close()\n"
        "print(total)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=30, env=os.environ)
    assert done.stdout == "3\n", done.stderr
