"""Faulty bus members, and strangers at the bus and the drone's port: named, counted, without consequence."""

import json
import random
import signal
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from groundstation.bus import clock, keys
from groundstation.bus.messages import CommandAck
from groundstation.bus.roles import Identity, Role, shell
from groundstation.bus.topics import COMMAND, COMMAND_ACK, EVENT, LEASE, ODOMETRY, SETPOINT, TOPICS
from groundstation.bus.zenoh_bus import open_bus
from groundstation.errors import GroundStationError
from groundstation.supervisor.joining import join
from groundstation.supervisor.runtime_file import RuntimeRecord
from groundstation.time_units import NS_PER_S

pytestmark = [pytest.mark.sitl, pytest.mark.slow, pytest.mark.timeout(240)]
Start = Callable[..., Any]
_NESTED = b'{"header":' + b"[" * 5000
GARBAGE = (
    b"",
    b"null",
    b"[]",
    b"{",
    b"\xff\xfe",
    b'{"header":{}}',
    _NESTED,
    b'{"header":{"stamp_ns":1e400}}',
    b"0" * 20_000,
)


COUNTED = {"command_malformed", "lease_malformed", "lease_future"}
ROGUES = ("supervisor", "tracker", "drone_1", shell(Role.CLI))


class Rogues:
    """Members of a run without rules: each publishes everything, in every name."""

    def __init__(self, record: RuntimeRecord) -> None:
        run = Path(record.run_dir).name
        self._buses = [
            open_bus(record.endpoint, record.site, name, 5.0, Identity(record.identities, name, run)) for name in ROGUES
        ]
        self._site = record.site

    def put(self, key: str, payload: bytes, attachment: bytes | None = None) -> None:
        for bus in self._buses:
            bus._session.put(key, payload, attachment=attachment)

    def garbage(self) -> None:
        """Publish everything but valid messages under keys of every topic, also in the names of our own processes."""
        for topic in TOPICS.values():
            for entity in ("drone_1", "team", "tracker", "nobody"):
                for source in ("cli_1", "supervisor", "tracker", "drone_1"):
                    key = keys.expression(self._site, topic, entity, source)
                    for payload in GARBAGE:
                        self.put(key, payload, random.choice(GARBAGE) or None)

    def say(
        self, topic: Any, entity: str, source: str, seq: int, fields: str, key: str = "", stamp_ns: int = 0
    ) -> None:
        header = {"stamp_ns": stamp_ns or clock.now_ns(), "clock": clock.clock_id(), "entity": entity, "source": source}
        text = f'{{"header":{json.dumps(header | {"seq": seq})},{fields}}}'
        self.put(key or keys.expression(self._site, topic, entity, source), text.encode())

    def close(self) -> None:
        for bus in self._buses:
            bus.close()


@pytest.fixture
def rogues() -> Iterator[Callable[..., Rogues]]:
    made: list[Rogues] = []

    def appear(run: Any) -> Rogues:
        made.append(Rogues(run.record))
        return made[-1]

    yield appear
    for one in made:
        one.close()


def _command(verb: str, issuer: str, expires_ns: int) -> str:
    fields = {"id": f"forged-{verb}-{issuer}-{expires_ns}", "verb": verb, "scope": [], "issuer": issuer}
    return json.dumps(fields | {"expires_ns": expires_ns})[1:-1]


def _pids(run: Any) -> dict[str, int]:
    run.listen()
    return {process.name: process.pid for process in run.record.processes}


def test_members_gone_mad_change_nothing(sitl: Start, rogues: Callable[..., Rogues]) -> None:
    run = sitl()
    run.until_tracking()
    before, started = _pids(run), time.monotonic()
    for address in (run.record.endpoint, run.record.endpoint.replace("tls/", "tcp/")):
        with pytest.raises(GroundStationError, match="no router answers"):
            open_bus(address, run.record.site, "tracker", 0.0)
    rogue = rogues(run)
    for _ in range(8):  # a busy router drops; the messages that arrived count
        if all(set(run.status(drone).rejected) >= COUNTED for drone in run.record.drones):
            break
        rogue.garbage()
        _numbers_that_are_none(rogue)
        for pattern in ("**", f"gs/@v1/{run.record.site}/*/command/*", f"gs/@v1/{run.record.site}/team/command/*"):
            rogue.say(COMMAND, "team", "cli_1", 1, _command("CUT_MOTORS", "stranger", 0), key=pattern)
        _forge_starts(run, rogue)
        run.listen()
    run.until(lambda: time.monotonic() > started + 4, 20)
    assert _pids(run) == before, "a process ended"
    for drone in run.record.drones:
        assert not {"CUT", "TAKING_OFF"} & set(run.modes_since(drone, started))
        rejected = set(run.status(drone).rejected)
        assert rejected >= COUNTED and {"lease_held", "lease_old"} & rejected
    run.process.send_signal(signal.SIGTERM)
    assert run.wait(40) == 0


def _numbers_that_are_none(rogue: Rogues) -> None:
    zeros = "[" + ",".join("0" * 9) + "]"
    for seq, number in enumerate(("NaN", "Infinity", "1e999", "-1e999", "1e308", str(10**30)), 10**12):
        motion = f'"velocity_m_s":[{number},0,0],"velocity_covariance":{zeros}'
        rogue.say(ODOMETRY, "drone_1", "drone_1", seq, f'{motion},"yaw_rad":0,"roll_rad":0,"pitch_rad":0,"reset":0')
        turn = f'"yaw_rate_rad_s":0,"lifetime_ms":300,"epoch":{10**30}'
        rogue.say(SETPOINT, "drone_1", "tracker", seq, f'"velocity_m_s":[{number},0,0],{turn}')


def _forge_starts(run: Any, rogue: Rogues) -> None:
    now_ns = clock.now_ns()
    soon_ns = now_ns + 5 * NS_PER_S
    with closing(join(run.record, "view", Role.VIEW)) as bus:
        answers = bus.subscribe([COMMAND_ACK])
        forged = (("TAKEOFF", "operator", 1), ("TAKEOFF", "stranger", soon_ns), ("TRACK", "stranger", soon_ns))
        refused: set[tuple[str, str]] = set()
        for seq in range(20):  # repeated, as all our senders do without an acknowledgement: the garbage may push it out
            if len(refused) == 3 * len(run.record.drones):
                break
            rogue.say(LEASE, "team", "supervisor", seq, f'"holder":"stranger","expires_ns":{now_ns + 10**12}')
            later = f'"holder":"operator","expires_ns":{soon_ns}'
            rogue.say(LEASE, "team", "supervisor", seq, later, stamp_ns=now_ns + 10**15)
            for verb, issuer, expires_ns in forged:
                rogue.say(COMMAND, "team", "cli_1", seq, _command(verb, issuer, expires_ns))
            time.sleep(0.2)
            heard = [r.message for r in answers.drain() if isinstance(r.message, CommandAck)]
            acks = [ack for ack in heard if ack.command_id.startswith("forged")]
            assert not [ack for ack in acks if ack.stage in ("ACCEPTED", "EFFECTIVE")]
            refused |= {(ack.header.entity, ack.command_id) for ack in acks if ack.stage == "REFUSED"}
        assert len(refused) == 3 * len(run.record.drones)


FAULTS = """\
faults:
  - {kind: navdata_silent, entity: drone_2, start_s: 0}
  - {kind: camera_cut, entity: drone_2, start_s: 0}
  - {kind: camera_stall, entity: drone_1, start_s: 30, end_s: 33}
  - {kind: camera_cut, entity: ceiling, start_s: 35, end_s: 37}
"""


def test_silent_devices_are_named_and_the_other_drone_flies(sitl: Start, tmp_path: Path) -> None:
    shipped = Path(__file__).parents[2] / "config" / "scenarios" / "realistic.yaml"
    scenario = tmp_path / "faults.yaml"
    scenario.write_text(shipped.read_text().replace("faults: []\n", FAULTS))
    run = sitl("--scenario", str(scenario))
    run.until(lambda: run.mode("drone_1") == "TRACK", 90, "drone_1 tracks")
    assert "drone_2: left out" in run.text
    assert any("ERROR drone_2: drone_2 does not answer at" in event for event in run.events())
    assert any("drone_2_camera: camera drone_2_camera: no picture" in event for event in run.events())
    flying = time.monotonic()
    for camera in ("drone_1_camera", "ceiling"):
        run.until(lambda camera=camera: _heals(run, camera, flying), 40, f"{camera} named, and heals")
    assert run.mode("drone_1") == "TRACK"
    assert not run.height("drone_2") > 0.1


def _heals(run: Any, camera: str, since: float) -> bool:
    heard = run.history[EVENT.name, camera]
    told = "\n".join(event.text for at, event in heard if at > since)
    return "no picture" in told and "pictures arrive" in told.partition("no picture")[2]


@pytest.mark.exhaustive
def test_datagrams_from_foreign_addresses_are_counted(sitl: Start) -> None:
    run = sitl()
    run.until_tracking()
    ports = _ports(run)
    assert len(ports) == 2, "navdata and AT"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        rng = random.Random(1)
        for size in (0, 1, 16, 500, 4096, 60_000):
            for port in ports:
                other.sendto(rng.randbytes(size), ("127.0.0.1", port))
    run.until(lambda: run.status("drone_1").rejected.get("foreign_address", 0) >= 5, 3, "counted")
    assert run.mode("drone_1") == "TRACK"


def _ports(run: Any) -> list[int]:
    """Return the open UDP ports of drone_1's driver."""
    inodes = set()
    for link in Path(f"/proc/{run.pid('drone_1')}/fd").iterdir():
        target = str(link.readlink())
        if target.startswith("socket:["):
            inodes.add(target[8:-1])
    lines = [line.split() for line in Path("/proc/net/udp").read_text().splitlines()[1:]]
    return [int(fields[1].partition(":")[2], 16) for fields in lines if fields[9] in inodes]
