"""The motion capture driver with the emulated system on loopback, and with a stand-in for the library."""

import socket
import sys
import time
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from free_port import free_port

from drivers.motion_capture import driver as process
from drivers.motion_capture.captured_frame import CapturedFrame
from drivers.motion_capture.driver import MotionCaptureDriver
from drivers.motion_capture.settings import MotionCaptureSection, parse_source
from drivers.motion_capture.sources import LibrarySource, NatnetSource, open_source
from drivers.motion_capture.wire import natnet
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import BodyPoses, CameraStatus, RelativeObservation
from groundstation.bus.topics import BODY_POSES, CAMERA_STATUS, OBSERVATION
from groundstation.errors import SettingsError
from sim_bridge.devices.captured_bodies import CapturedBodies
from sim_bridge.devices.natnet import NatnetEmulator
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.site import SiteCapture

HOST = "127.0.0.1"
WIDE = {"x_m": (-3.0, 3.0), "y_m": (-3.0, 3.0), "z_m": (-0.1, 3.0)}
PLACES = {"drone_1": (0.5, 0.2, 1.5), "drone_2": (-0.9, 0.1, 1.4)}


class FakeChild:
    stop_requested, supervisor_alive, supervisor_fresh, spoken_for_ns = False, True, True, 0

    def __init__(self, bus: MemoryBus, section: str) -> None:
        self.bus, self.name, self.section = bus, "mocap", section
        self.states: list[str] = []
        self.events: list[str] = []

    def ready(self, detail: str = "") -> None:
        self.states.append("READY")

    def degrade(self, detail: str, works: bool = True) -> None:
        self.states.append("DEGRADED")

    def event(self, severity: str, text: str, remedy: str = "", entity: str | None = None) -> None:
        self.events.append(text)

    def beat(self) -> None: ...
    def tick_status(self, ticks: int = 0, overruns: int = 0, overflowed: int = 0) -> None: ...


def a_port() -> int:
    return free_port(HOST, kind=socket.SOCK_DGRAM)


@dataclass
class Rig:
    """Emulated system, driver, and a subscriber; `run` advances both, the emulator on a manual clock."""

    system: NatnetEmulator
    driver: MotionCaptureDriver
    child: FakeChild
    heard: Any
    clock: SimpleNamespace

    def run(self, frames: int) -> list[object]:
        for _ in range(frames):
            for _ in range(2):
                self.clock.ns += 5_000_000
                self.system.receive()
                self.system.send()
            self.driver.turn()
        return [one.message for one in self.heard.drain()]


@pytest.fixture
def rig(request, monkeypatch):
    clock = SimpleNamespace(ns=10**12)
    for module in ("drivers.stream_health", "drivers.motion_capture.sources"):
        monkeypatch.setattr(f"{module}.clock.now_ns", lambda: clock.ns)
    faults, observed = getattr(request, "param", ((), ("drone_1", "drone_2")))
    place = (HOST, a_port())

    def states() -> np.ndarray:
        return np.array([[*at, 0, 0, 0, 0.1, 0.0, 0.3, 0, 0, 0, 0] for at in PLACES.values()])

    capture = SiteCapture.model_validate({"volume_m": WIDE, "up": "y", "position_m": (0.3, 0.0, 0.0), "yaw_deg": 30.0})
    seen = CapturedBodies("mocap", capture, PLACES, states, np.random.default_rng(1), faults, errors=False)
    system = NatnetEmulator("mocap", place, seen)
    order = {
        "name": "mocap",
        "source": f"natnet://{HOST}:{place[1]}",
        "bodies": tuple({"entity": name, "name": name, "marker_m": (0.0, 0.0, 0.08)} for name in PLACES),
        "observed": observed,
        "volume_m": tuple(WIDE.values()),
        "up": "y",
        "position_m": (0.3, 0.0, 0.0),
        "yaw_deg": 30.0,
        "silent_after_s": 0.05,
    }
    section = MotionCaptureSection.model_validate(order)
    exchange = MemoryExchange()
    child: Any = FakeChild(MemoryBus(exchange, "lab", "mocap"), section.model_dump_json())
    heard = MemoryBus(exchange, "lab", "test").subscribe([OBSERVATION, BODY_POSES, CAMERA_STATUS])
    source = NatnetSource(parse_source(section.source))
    yield Rig(system, MotionCaptureDriver(child, section, source), child, heard, clock)
    source.close()
    system.close()


def told(messages, kind):
    return [one for one in messages if isinstance(one, kind)]


def test_bodies_come_as_poses_and_as_observations_in_the_world(rig) -> None:
    heard = rig.run(120)
    seen = [one for one in told(heard, RelativeObservation) if one.subject == "drone_1"]
    assert 20 <= len(seen) <= 45  # 30 a second
    mean = np.mean([one.position_m for one in seen], axis=0)
    assert np.allclose(mean, (0.5, 0.2, 1.58), atol=0.01) and abs(seen[0].yaw_rad - 0.3) < 0.1
    poses = told(heard, BodyPoses)[-1]
    assert {body.name for body in poses.bodies} == set(PLACES) and not poses.refused
    assert rig.child.states == ["READY"]
    status = told(heard, CameraStatus)[-1]
    assert status.connected and 50 < status.fps < 150 and not status.detail


@pytest.mark.parametrize("rig", [((), ())], indirect=True)
def test_the_truth_is_published_and_never_observed(rig) -> None:
    heard = rig.run(60)
    assert told(heard, BodyPoses) and not told(heard, RelativeObservation)


def broken(kind: FaultKind, **more: object) -> tuple[Fault, ...]:
    return (Fault.model_validate({"kind": kind, "entity": "drone_1", "start_s": 0.5, "end_s": 1.5, **more}),)


@pytest.mark.parametrize(
    ("rig", "who", "why"),
    [
        ((broken(FaultKind.BODY_JUMPED, value=0.4), ("drone_1", "drone_2")), {"drone_1"}, "jumped"),
        ((broken(FaultKind.BODY_TURNED, value=90.0), ("drone_1", "drone_2")), {"drone_1"}, "turned"),
        ((broken(FaultKind.BODIES_SWAPPED, other="drone_2"), ("drone_1", "drone_2")), set(PLACES), "exchanged"),
        ((broken(FaultKind.CAPTURE_FROZEN, entity="mocap"), ("drone_1", "drone_2")), set(PLACES), "frozen"),
    ],
    indirect=["rig"],
)
def test_impossible_poses_are_reported_once_and_not_observed(rig, who, why) -> None:
    rig.run(80)
    during = rig.run(40)
    assert not [one for one in told(during, RelativeObservation) if one.subject in who]
    assert all(why in told(during, BodyPoses)[-1].refused[name] for name in who)
    assert sum(why in text for text in rig.child.events) == len(who)
    rig.run(60)
    after = rig.run(40)
    assert {one.subject for one in told(after, RelativeObservation)} == set(PLACES)
    assert sum("followed again" in text for text in rig.child.events) == len(who)


def test_silence_is_told_and_its_end(rig, monkeypatch) -> None:
    rig.run(30)
    rig.system.silent = True
    heard = rig.run(80)
    assert rig.child.states == ["READY", "DEGRADED"] and "no frame for 0.05 s" in rig.child.events[-1]
    assert not told(heard, CameraStatus)[-1].connected
    rig.system.silent = False
    rig.run(30)
    assert rig.child.states[-1] == "READY"


def test_strangers_and_noise_are_counted(rig) -> None:
    rig.run(20)
    port = rig.driver._source._requests.getsockname()[1]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.bind(("127.0.0.9", 0))
        stranger.sendto(natnet.encode(natnet.FRAME, b"x" * 40), (HOST, port))
    rig.system._socket.sendto(b"\x07", (HOST, port))
    rig.run(5)
    assert rig.driver._source.rejected == {"stranger": 1, "short": 1}


def test_a_system_that_was_started_anew_is_asked_again(rig) -> None:
    rig.run(60)
    rig.system._heard.clear()
    assert told(rig.run(30), BodyPoses) == [], "it streams to nobody who did not ask"
    rig.run(120)
    assert told(rig.run(30), BodyPoses)


def test_names_that_the_system_changes_are_asked_for_anew(rig) -> None:
    """As in Motive, when the operator selects other bodies: two exchange their ids, one is new."""
    rig.run(60)
    rig.system._ids = {"drone_1": 2, "drone_2": 1}
    frame_of = rig.system._frame
    rig.system._frame = lambda now_s: replace(frame_of(now_s), changed=True)
    rig.run(1)
    rig.system._frame = frame_of
    rig.run(120)
    seen = [one for one in told(rig.run(30), RelativeObservation) if one.subject == "drone_1"]
    assert seen and np.allclose(np.mean([one.position_m for one in seen], axis=0), (0.5, 0.2, 1.58), atol=0.01)
    rig.system._ids = {"drone_1": 7, "drone_2": 1}
    rig.run(150)
    assert {body.name for body in told(rig.run(10), BodyPoses)[-1].bodies} == set(PLACES)


def test_a_system_that_never_answers_is_told_with_its_address(monkeypatch) -> None:
    address = parse_source(f"natnet://{HOST}:{a_port()}")
    source = open_source(address)
    assert isinstance(source, NatnetSource) and source.poll(0.01) == [] and str(address.port) in source.detail
    source.close()


def test_frames_for_a_group_that_cannot_be_joined_are_told_and_tried_again() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as system:
        system.bind((HOST, 0))
        system.settimeout(5.0)
        source = NatnetSource(parse_source(f"natnet://{HOST}:{system.getsockname()[1]}"))
        source.poll(0.0)
        _, client = system.recvfrom(2048)
        server = natnet.Server("Motive", (4, 1), 10**6, a_port(), "10.0.0.1")  # no multicast address
        system.sendto(natnet.encode_server(server), client)
        assert source.poll(1.0) == [] and "cannot be taken at 10.0.0.1" in source.detail
        system.sendto(natnet.encode_server(replace(server, group="239.255.42.99")), client)
        assert source.poll(1.0) == [] and source.detail == ""
        source.close()


def test_other_systems_come_through_the_library(monkeypatch) -> None:
    turn = SimpleNamespace(x=0.0, y=0.0, z=0.0, w=1.0)
    body = SimpleNamespace(position=np.array([1.0, 2.0, 3.0], dtype=np.float32), rotation=turn)
    calls, breaks = [], ["link lost"]
    monkeypatch.setattr("drivers.motion_capture.sources._AGAIN_S", 0.05)
    monkeypatch.setattr("socket.create_connection", lambda *_: socket.socket())  # it answers

    class System:
        def __init__(self) -> None:
            self.rigidBodies = {"cf1": body}

        def waitForNextFrame(self) -> None:  # noqa: N802 - as the library calls it
            calls.append(1)
            time.sleep(0.001)
            if breaks and len(calls) > 3:
                raise RuntimeError(breaks[0])

    asked = []

    def connect(kind: str, values: dict[str, str]) -> System:
        asked.append((kind, values))
        return System()

    library = SimpleNamespace(connect=connect)
    monkeypatch.setitem(sys.modules, "motioncapture", library)
    source = open_source(parse_source("vicon://10.0.0.2"))
    assert isinstance(source, LibrarySource)
    frames: list[CapturedFrame] = []
    deadline = time.monotonic() + 5.0
    while len(frames) < 3 and time.monotonic() < deadline:
        frames += source.poll(0.05)
    assert asked == [("vicon", {"hostname": "10.0.0.2"})]
    assert [frame.poses for frame in frames] == [{"cf1": ((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0))}] * 3
    while "link lost" not in source.detail and time.monotonic() < deadline:
        time.sleep(0.01)
    assert source.detail == "RuntimeError: link lost"
    breaks.clear()
    while not source.poll(0.05) and time.monotonic() < deadline:
        pass
    assert source.detail == "" and len(asked) > 1  # connected anew
    source.close()


def test_a_missing_library_is_named_with_the_remedy(monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "motioncapture", None)
    with pytest.raises(SettingsError, match=r"\[mocap\]"):
        open_source(parse_source("vicon://10.0.0.2"))


def test_the_process_serves_until_it_is_told_to_stop(rig) -> None:
    class Stopping(FakeChild):
        turns = 0

        def beat(self) -> None:
            self.turns += 1
            self.stop_requested = self.turns > 2

    child: Any = Stopping(rig.child.bus, rig.child.section)
    assert process.run(child) == 0
    child.section = '{"name": "mocap"}'
    with pytest.raises(SettingsError, match="motion capture: source"):
        process.run(child)


@pytest.mark.parametrize("rig", [(broken(FaultKind.BODY_JUMPED, value=2.7), ("drone_1", "drone_2"))], indirect=True)
def test_a_jump_out_of_the_volume_is_a_jump(rig) -> None:
    rig.run(80)
    during = rig.run(40)
    assert not [one for one in told(during, RelativeObservation) if one.subject == "drone_1"]
    assert any("jumped by 2." in text for text in rig.child.events), rig.child.events
