"""Attacks on a flying run: none moves or stops a drone, and each leaves an event that names the refusal.

The rest of the table in SECURITY.md is tested beside the part under attack: MAVLink in
tests/contract/mavlink_links/test_mavlink_takeover.py, pages in tests/browser, passwords in test_camera_password_run.py.
"""

import json
import os
import pwd
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from free_port import free_port
from sitl_run import SitlRun

from groundstation.bus import clock, topics, zenoh_bus
from groundstation.bus.messages import Command, Header, Lease, VelocitySetpoint, Verb
from groundstation.bus.roles import Identity, Role, shell
from groundstation.supervisor.authority import make_identities
from groundstation.supervisor.runtime_file import identities_of

pytestmark = [pytest.mark.sitl, pytest.mark.slow, pytest.mark.timeout(300)]
STRANGER = Path(__file__).parent / "stranger.py"
ENVIRONMENT = {"PATH": os.environ["PATH"]}


def attack(*arguments: object, limit_s: float = 60.0) -> dict[str, object]:
    """Let the stranger attack; returns its results."""
    command = [sys.executable, str(STRANGER), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=limit_s, env=ENVIRONMENT, check=True)
    got: dict[str, object] = json.loads(done.stdout.splitlines()[-1])
    return got


class Neighbour:
    """Another router on this machine, with its nodes."""

    def __init__(self, folder: Path) -> None:
        self._stop = folder / "stop"
        self.port = free_port()
        command = [sys.executable, str(STRANGER), "neighbour", str(self.port), "lab", str(self._stop)]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=ENVIRONMENT)
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == "listening\n"

    def end(self) -> dict[str, int]:
        """Return the number of messages exchanged by its nodes, and of the run's messages that they received."""
        self._stop.touch()
        got: dict[str, int] = json.loads(self._process.communicate(timeout=30)[0])
        return got

    def close(self) -> None:
        with self._process:  # closes its pipe as well, in case only some of these tests run and none has ended it
            if self._process.poll() is None:
                self._process.kill()


@pytest.fixture(scope="module")
def neighbour(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Neighbour]:
    made = Neighbour(tmp_path_factory.mktemp("neighbour"))
    yield made
    made.close()


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory, neighbour: Neighbour) -> Iterator[SitlRun]:
    """A run that tracks; its first choice of a port is the neighbour's."""
    started = SitlRun(tmp_path_factory.mktemp("run"), "sitl", "lab", "--set", f"bus.port={neighbour.port}")
    try:
        started.until_tracking()
        yield started
    finally:
        started.close()


class Watched:
    """The drones' behaviour during an attack."""

    def __init__(self, run: SitlRun) -> None:
        run.listen()
        self.run, self.since, self.events = run, time.monotonic(), len(run.events())

    def judge(self, named: str = "") -> None:
        """Fail unless all kept tracking, no distance was below its limit, and an event names the refusal."""
        if named:
            self.run.until(lambda: any(named in event for event in self.fresh()), 15, f"event: {named}")
        self.run.until(lambda: time.monotonic() > self.since + 2.0, 5)
        for drone in self.run.record.drones:
            assert set(self.run.modes_since(drone, self.since)) == {"TRACK"}, self.fresh()
            assert self.run.speed_between(drone, self.since, time.monotonic()) < 0.55
        assert self._separation_m() > 0.7
        assert not any(event.startswith("ERROR") for event in self.fresh()), self.fresh()

    def fresh(self) -> list[str]:
        return self.run.events()[self.events :]

    def _separation_m(self) -> float:
        one, two = (dict(self._track(drone)) for drone in self.run.record.drones)
        return min(
            sum((a - b) ** 2 for a, b in zip(one[at], two[at], strict=True)) ** 0.5 for at in set(one) & set(two)
        )

    def _track(self, drone: str) -> list[tuple[int, tuple[float, ...]]]:
        return [(s.header.stamp_ns, s.position_m[:2]) for at, s in self.run.truth(drone) if at > self.since]


@pytest.fixture
def watched(run: SitlRun) -> Watched:
    return Watched(run)


def test_strangers_neither_hear_nor_move_anything(run: SitlRun, watched: Watched, tmp_path: Path) -> None:
    """Forged setpoints, epochs far ahead, leases and take-offs, plain and over TLS, from any local program."""
    keys = tmp_path / "keys"
    make_identities(keys, ["127.0.0.1"], ["tracker"])
    run_authority = identities_of(run.record.site, run.record.supervisor.pid) / zenoh_bus.AUTHORITY
    (keys / zenoh_bus.AUTHORITY).write_bytes(run_authority.read_bytes())
    got = attack("bus", run.record.endpoint, run.record.site, keys)
    assert set(got.values()) == {"refused"}, got
    watched.judge("connections of programs that are not of this run")


def test_a_member_moves_nothing_in_anothers_name(run: SitlRun, watched: Watched) -> None:
    """The certificate of the owner's shells gives the right to command as themselves."""
    identity = Identity(run.record.identities, shell(Role.CLI), run.run_dir.name)
    liars = [
        zenoh_bus.open_bus(run.record.endpoint, run.record.site, source, 2.0, identity)
        for source in ("tracker", "supervisor", "cli_99")
    ]
    for seq in range(50):
        for liar in liars:
            for drone in run.record.drones:
                head = Header(clock.now_ns(), clock.clock_id(), drone, liar.source, 2**40 + seq)
                forged = VelocitySetpoint(
                    header=head, velocity_m_s=(0.6, 0.0, 0.0), yaw_rate_rad_s=0.0, lifetime_ms=300, epoch=10**15
                )
                liar.publish(topics.SETPOINT, forged)
            lease = Lease(header=liar.header("team"), holder=liar.source, expires_ns=clock.now_ns() + 10**10)
            liar.publish(topics.LEASE, lease)
        time.sleep(0.02)
    watched.judge("the bus refused messages of cli-shell: it may not publish")
    for drone in run.record.drones:
        status = run.status(drone)
        assert status is not None
        assert not [reason for reason in status.rejected if reason.startswith(("setpoint_other", "setpoint_epoch"))]
    for liar in liars:
        liar.close()


@pytest.mark.parametrize(
    ("verb", "issuer", "other_run", "age_s", "named"),
    [
        pytest.param(Verb.TAKEOFF, "operator", False, 0, "TAKEOFF of cli_99 refused: the operator", id="take-off"),
        pytest.param(Verb.RESUME, "supervisor", False, 0, "RESUME of cli_99 refused: the operator", id="resume"),
        pytest.param(Verb.CUT_MOTORS, "cli_99", True, 0, "given for another run (lab-old)", id="stop of another run"),
        pytest.param(Verb.CUT_MOTORS, "cli_99", False, 45, "CUT_MOTORS of cli_99 refused: given 45", id="old stop"),
    ],
)
def test_an_order_that_nobody_may_give_is_refused_by_name(
    run: SitlRun, verb: Verb, issuer: str, other_run: bool, age_s: int, named: str
) -> None:
    identity = Identity(run.record.identities, shell(Role.CLI), run.run_dir.name)
    bus = zenoh_bus.open_bus(run.record.endpoint, run.record.site, "cli_99", 2.0, identity)
    time.sleep(1.1)  # a refusal is reported once a second
    watched = Watched(run)
    head = bus.header("team", clock.now_ns() - age_s * 10**9)
    order = Command(
        header=head,
        id=f"forged-{named}",
        verb=verb,
        scope=(),
        issuer=issuer,
        expires_ns=clock.now_ns() + 10**10,
        run="lab-old" if other_run else bus.run,
    )
    for _ in range(5):
        bus.publish(topics.COMMAND, order)
        time.sleep(0.1)
    watched.judge(named)
    bus.close()


def console_of(run: SitlRun) -> str:
    return next(word for word in run.text.split() if word.startswith("http://127.0.0.1:"))


def test_450_silent_connections_keep_no_page_out(run: SitlRun, watched: Watched) -> None:
    got = attack("silence", console_of(run), 450)
    assert got["status"] == 200
    watched.judge("connections that asked for nothing")


def test_another_user_reads_joins_and_commands_nothing(run: SitlRun, watched: Watched) -> None:
    if os.getuid() != 0:
        pytest.skip("becoming another user needs root")
    record = run.record
    keys = identities_of(record.site, record.supervisor.pid)
    paths = (keys, keys / "tracker.key", keys.parent, run.run_dir, run.run_dir / "resolved.yaml")
    got = attack("other_user", pwd.getpwnam("nobody").pw_uid, console_of(run), record.endpoint, *paths)
    assert {got[str(path)] for path in paths} == {"PermissionError"}
    assert {got[page] for page in ("/", "/token", "/?code=guess")} == {403}
    assert {value for name, value in got.items() if "127." in name} == {"refused"}
    watched.judge("requests of other users without the code")


def test_a_router_beside_us_works_and_neither_sees_the_other(run: SitlRun, neighbour: Neighbour) -> None:
    """The last of these tests: it ends the neighbour, who has forged messages since before the run began."""
    watched = Watched(run)
    watched.judge()
    assert f":{neighbour.port}" not in run.record.endpoint
    got = neighbour.end()
    assert got["said"] == got["heard"] > 20
    assert got["of the run"] == 0


def test_no_attack_has_left_a_trace(run: SitlRun) -> None:
    """After all of them: the flight ends normally."""
    run.process.terminate()
    run.until_landed(30)
    assert run.wait(40) == 0
    assert "Traceback" not in run.text
