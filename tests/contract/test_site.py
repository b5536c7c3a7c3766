"""A site over real TLS: admitted hosts give commands in its runs, others cannot, and none has further rights."""

import os
import shutil
import socket
import stat
import threading
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest
from free_port import free_port

from groundstation.bus import topics, zenoh_bus
from groundstation.bus.access import AccessList
from groundstation.bus.door import why_closed
from groundstation.bus.messages import (
    CameraStatus,
    Command,
    FlightState,
    HostReport,
    Lease,
    VehicleStatus,
    VelocitySetpoint,
    Verb,
)
from groundstation.bus.roles import Identity, Member, Role
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.cli import stop
from groundstation.cli.exits import UnreachableError
from groundstation.cli.stop import choose_run
from groundstation.errors import GroundStationError, OperatorMistake
from groundstation.supervisor import authority, runtime_file, site
from groundstation.supervisor.authority import make_identities
from groundstation.supervisor.joining import join
from groundstation.supervisor.runtime_file import ProcessRecord, RuntimeRecord

MEMBERS = (
    Member("supervisor", Role.SUPERVISOR, ("supervisor",)),
    Member("drone_1", Role.DRIVER, ("drone_1",), ("drone_1",)),
)
HOSTED = (
    Member("host-laptop", Role.HOST, ("laptop",), ("laptop",)),
    Member("host-laptop", Role.CAMERA, ("ceiling",), ("ceiling",)),
)
HERE, ELSEWHERE = "127.0.0.1", "127.0.0.9"


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setattr(runtime_file, "folders_beside", list)
    site.found("lab")
    return tmp_path


@pytest.fixture
def port() -> int:
    return free_port(HERE)


def admit(home: Path, host: str, port: int) -> None:
    site.admit("lab", host, f"tls/{ELSEWHERE}:{port}", home / f"{host}.admission")
    site.join(home / f"{host}.admission")


class Run:
    """A run whose router also listens for other hosts, with an operator and a driver that publish."""

    def __init__(self, folder: Path, port: int) -> None:
        make_identities(folder, [HERE, ELSEWHERE], ["router", *(m.name for m in MEMBERS)], site.authority_of("lab"))
        access = AccessList("lab", (*MEMBERS, *site.hosts("lab"), *HOSTED))
        here, self.elsewhere = f"tls/{HERE}:{port}", f"tls/{ELSEWHERE}:{port}"
        self.router = zenoh_bus.open_router(here, Identity(str(folder), "router", "r"), access, (self.elsewhere,))
        self.operator, self.driver = (self._join(folder, here, member.name) for member in MEMBERS)
        self.commands = self.driver.subscribe([topics.COMMAND])
        self.setpoints = self.driver.subscribe([topics.SETPOINT])
        self._over, self.still = threading.Event(), threading.Event()
        self._speaking = threading.Thread(target=self._speak)
        self._speaking.start()

    def _join(self, folder: Path, endpoint: str, name: str) -> ZenohBus:
        return zenoh_bus.open_bus(endpoint, "lab", name, 2.0, Identity(str(folder), name, "run-7"))

    def _speak(self) -> None:
        while not self._over.wait(0.05):
            if self.still.is_set():
                continue
            lease = Lease(header=self.operator.header("team"), holder="operator", expires_ns=10**18, run="run-7")
            self.operator.publish(topics.LEASE, lease)
            header = self.driver.header("drone_1")
            self.driver.publish(
                topics.VEHICLE_STATUS, VehicleStatus(header=header, flight_state=FlightState.LANDED, mode="LANDED")
            )

    def close(self) -> None:
        self._over.set()
        self._speaking.join()
        for one in (self.operator, self.driver, self.router):
            one.close()


@pytest.fixture
def run(home: Path, port: int) -> Iterator[Run]:
    admit(home, "laptop", port)
    made = Run(home / "keys", port)
    yield made
    made.close()


def test_an_admitted_host_finds_the_run_and_stops_it_under_its_own_name(run: Run) -> None:
    (record,) = site.runs()
    assert (record.run_dir, record.drones, record.host) == ("run-7", ("drone_1",), "laptop")
    bus = join(record, "cli", Role.CLI)
    command = Command(header=bus.header("team"), id="x", verb=Verb.LAND, scope=(), issuer=bus.source, run=bus.run)
    for _ in range(50):
        bus.publish(topics.COMMAND, command)
        if run.commands.wait(0.05):
            break
    received = run.commands.drain()[0]
    assert received.key.source.startswith("cli_laptop_")
    assert isinstance(received.message, Command) and received.message.run == "run-7"
    for source in ("tracker", "supervisor", "cli_other_1"):
        liar = zenoh_bus.open_bus(record.endpoint, "lab", source, 2.0, record.identity(Role.CLI))
        header = liar.header("drone_1")
        liar.publish(
            topics.SETPOINT,
            VelocitySetpoint(header=header, velocity_m_s=(1, 0, 0), yaw_rate_rad_s=0, lifetime_ms=300, epoch=1),
        )
        liar.publish(topics.COMMAND, command)
        liar.close()
    time.sleep(0.2)
    assert run.setpoints.drain_samples() == []
    assert {r.key.source for r in run.commands.drain()} <= {bus.source}
    bus.close()


def say_everything(bus: ZenohBus, entity: str) -> None:
    header = bus.header(entity)
    bus.publish(topics.HOST_REPORT, HostReport(header=header, sent_ns=1))
    seen = CameraStatus(header=header, connected=True, fps=1.0, age_ms=1.0, frames=1, skipped=0, detections=0)
    bus.publish(topics.CAMERA_STATUS, seen)
    bus.publish(topics.VEHICLE_STATUS, VehicleStatus(header=header, flight_state=FlightState.LANDED, mode="FALSE"))
    moves = VelocitySetpoint(header=header, velocity_m_s=(1, 0, 0), yaw_rate_rad_s=0, lifetime_ms=300, epoch=1)
    bus.publish(topics.SETPOINT, moves)


def test_a_host_speaks_as_itself_and_as_the_devices_that_the_field_gives_it(run: Run) -> None:
    place = Identity(str(site.folder("joined", "lab")), "host-laptop", "run-7")
    heard = run.operator.subscribe([topics.HOST_REPORT, topics.CAMERA_STATUS, topics.VEHICLE_STATUS, topics.SETPOINT])
    for source, entity in (("laptop", "laptop"), ("ceiling", "ceiling"), ("ceiling", "west"), ("drone_1", "drone_1")):
        bus = zenoh_bus.open_bus(run.elsewhere, "lab", source, 2.0, place)
        for _ in range(2):  # the first may come before the router has announced its subscribers
            say_everything(bus, entity)
            time.sleep(0.04)
        bus.close()
    got = [one for one in heard.drain() if getattr(one.message, "mode", "") != "LANDED"]
    assert {(one.key.topic.name, one.key.entity, one.key.source) for one in got} == {
        ("host_report", "laptop", "laptop"),
        ("camera_status", "ceiling", "ceiling"),
    }


def test_commands_of_hosts_not_admitted_before_the_run_are_not_delivered(home: Path, run: Run, port: int) -> None:
    admit(home, "late", port)
    late = Identity(str(site.folder("joined", "lab")), "host-late", "run-7")
    bus = zenoh_bus.open_bus(f"tls/{ELSEWHERE}:{port}", "lab", "cli_late_1", 2.0, late)
    heard = bus.subscribe([topics.LEASE])
    command = Command(header=bus.header("team"), id="x", verb=Verb.LAND, scope=(), issuer=bus.source, run="run-7")
    for _ in range(10):
        bus.publish(topics.COMMAND, command)
        time.sleep(0.02)
    assert heard.drain_samples() == [] and run.commands.drain_samples() == []
    bus.close()
    site.expel("lab", "laptop")
    assert [member.name for member in site.hosts("lab")] == ["host-late"]


def test_a_host_cannot_pass_for_the_router(home: Path, run: Run, port: int) -> None:
    """Its certificate has no address and is valid for clients only."""
    place = site.folder("joined", "lab")
    endpoint = f"tls/{ELSEWHERE}:{free_port(ELSEWHERE)}"
    router = zenoh_bus.open_router(endpoint, Identity(str(place), "host-laptop", "r"), AccessList("lab", ()))
    with pytest.raises(GroundStationError, match="no router answers"):
        zenoh_bus.open_bus(endpoint, "lab", "drone_1", 0.0, Identity(str(home / "keys"), "drone_1", "r"))
    router.close()


def identity_of(host: str) -> Identity:
    return Identity(str(site.folder("joined", "lab")), f"host-{host}", "")


def test_admitted_hosts_and_absent_routers_give_no_reason_of_refusal(home: Path, run: Run, port: int) -> None:
    assert why_closed(run.elsewhere, identity_of("laptop")) == ""
    assert why_closed(f"tls/{ELSEWHERE}:1", identity_of("laptop")) == ""
    assert why_closed(run.elsewhere, identity_of("laptop"), "silent", "let in") == "let in"
    assert why_closed(f"tls/{ELSEWHERE}:1", identity_of("laptop"), "silent", "let in") == ""


def test_a_run_whose_link_is_down_is_never_said_not_to_exist(home: Path) -> None:
    with socket.create_server((ELSEWHERE, 0)) as mute:  # it takes connections, and says nothing, as a link that is cut
        port = mute.getsockname()[1]
        admit(home, "laptop", port)
        assert why_closed(f"tls/{ELSEWHERE}:{port}", identity_of("laptop")) == ""
        lost = f"^lab at {ELSEWHERE}:{port}: no answer, and a run there may be flying: stop it there, or mend the link$"
        with pytest.raises(UnreachableError, match=lost):
            choose_run(None, stops=True)
    with pytest.raises(UnreachableError, match=r"^no ground station is running"):
        choose_run(None, stops=True)


def test_a_stop_that_met_only_a_rehearsal_says_whom_it_did_not_reach(
    home: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    simulator = ProcessRecord("sim_bridge", "sim_bridge", os.getpid(), runtime_file.start_time(os.getpid()) or 0)
    runtime_file.write(RuntimeRecord("demo", "", "tcp/127.0.0.1:9", "r", "", ("drone_1",), simulator, (simulator,)))
    monkeypatch.setattr(stop, "_order", lambda *_: 0)
    with socket.create_server((ELSEWHERE, 0)) as mute:
        admit(home, "laptop", mute.getsockname()[1])
        assert stop.order(Verb.LAND, (), None, as_json=True) == 0
        assert "lab at" in capfd.readouterr().err
        for verb, run in ((Verb.LAND, f"demo-{os.getpid()}"), (Verb.TAKEOFF, None)):
            assert stop.order(verb, (), run, as_json=True) == 0
            assert capfd.readouterr().err == "", "who names a run, or starts one, means that one"


def test_a_run_whose_operator_is_not_heard_is_named(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(site, "_LEASE_S", 0.0)
    monkeypatch.setattr(site, "_STATUS_S", 0.0)
    run.still.set()
    with pytest.raises(UnreachableError, match="may be flying, but its operator is not heard"):
        choose_run(None, stops=True)


def test_a_run_of_an_authority_made_anew_is_named_with_the_remedy(home: Path, port: int) -> None:
    admit(home, "laptop", port)
    shutil.rmtree(site.folder("sites", "lab"))
    site.found("lab")
    run = Run(home / "keys", port)
    try:
        assert "admit and join this host again" in why_closed(run.elsewhere, identity_of("laptop"))
        assert [reason.split(": ")[0] for reason in site.why_not_found()] == [f"lab at {run.elsewhere[4:]}"]
        with pytest.raises(UnreachableError, match=r"^lab at 127.*its authority was made anew"):
            choose_run(None)
        # Conversely, a host that trusts any router is not admitted either.
        shutil.copy(home / "keys" / "authority.pem", site.folder("joined", "lab") / "authority.pem")
        assert "refuses the certificate of this host" in why_closed(run.elsewhere, identity_of("laptop"))
    finally:
        run.close()


def test_a_run_that_is_certified_for_another_address_is_named(home: Path, run: Run, port: int) -> None:
    relay = "127.0.0.8"  # an address of the same computer that bus.listen does not name
    router = zenoh_bus.open_router(
        f"tls/{relay}:{port}", Identity(str(home / "keys"), "router", "r"), AccessList("lab", ())
    )
    assert "certified for other addresses than 127.0.0.8" in why_closed(f"tls/{relay}:{port}", identity_of("laptop"))
    router.close()


def test_a_host_whose_date_is_wrong_is_told_so(home: Path, port: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(authority, "_ENDS", datetime(2001, 1, 1, tzinfo=UTC))
    shutil.rmtree(site.folder("sites", "lab"))
    site.found("lab")
    admit(home, "laptop", port)
    run_keys = home / "keys"
    make_identities(run_keys, [ELSEWHERE], ["router"], site.authority_of("lab"))
    endpoint = f"tls/{ELSEWHERE}:{port}"
    router = zenoh_bus.open_router(endpoint, Identity(str(run_keys), "router", "r"), AccessList("lab", ()))
    assert "set its date" in why_closed(endpoint, identity_of("laptop"))
    router.close()


def test_keys_are_for_their_owner_and_mistakes_are_named(home: Path, port: int) -> None:
    admit(home, "laptop", port)
    kept = [path for path in (home / "config").rglob("*") if path.is_file()] + [home / "laptop.admission"]
    assert {stat.S_IMODE(path.stat().st_mode) for path in kept} == {0o600}
    assert {stat.S_IMODE(site.folder(kind, "lab").stat().st_mode) for kind in ("sites", "joined")} == {0o700}
    for wrong, words in (
        (lambda: site.found("lab"), "has an authority already"),
        (lambda: site.admit("lab", "laptop", "x", home / "x"), "admitted before"),
        (lambda: site.admit("lab", "../x", "x", home / "x"), "small letters"),
        (lambda: site.admit("hall", "laptop", "x", home / "x"), "site init hall"),
        (lambda: site.expel("lab", "tablet"), "has admitted laptop"),
        (lambda: site.join(Path("/dev/null")), "is no admission"),
    ):
        with pytest.raises(OperatorMistake, match=words):
            wrong()


@pytest.mark.parametrize("name", ["", "../../esc", "/tmp/esc", "a b", "Lab", "x" * 49])
def test_a_site_is_called_as_in_a_field(home: Path, name: str) -> None:
    with pytest.raises(OperatorMistake, match="a site is called as in its field"):
        site.found(name)


@pytest.mark.parametrize("address", ["not an address", "192.168.1.999", "0.0.0.0", ""])
def test_nobody_is_admitted_to_an_address_that_is_none(home: Path, tmp_path: Path, address: str) -> None:
    site.found("other")
    with pytest.raises(OperatorMistake, match="must be the ground station's IPv4 address"):
        site.admit("other", "laptop", f"tls/{address}:4717", tmp_path / "laptop.admission")


def test_without_a_run_nothing_is_found(home: Path, port: int) -> None:
    assert list(site.runs()) == []
    admit(home, "laptop", port)
    assert list(site.runs()) == []
