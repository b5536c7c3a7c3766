"""Real bodies in the emulated room: the sources of their poses, their absence, and their display."""

import json
import math
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from free_port import free_port

from drivers.mavlink.wire.frames import FrameDecoder, FrameEncoder, split
from drivers.mavlink.wire.simulator import HilStateQuaternion, SimState
from drivers.mavlink.wire.telemetry import Attitude, LocalPositionNed
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import EntityEstimate, Estimate, Severity
from groundstation.bus.topics import ESTIMATE, TRUTH
from groundstation.errors import GroundStationError, SettingsError
from sim_bridge.cameras import render_specs
from sim_bridge.harness import Harness
from sim_bridge.launch_spec import LaunchSpec, read_order
from sim_bridge.real.mavlink_truth import AutopilotTruth
from sim_bridge.real.placed import Placement
from sim_bridge.render.scene import compose_scene
from sim_bridge.world.puppet import STALE_S
from sim_bridge.world.world import TICK_NS, TICK_S

LENS = {
    "width_px": 640, "height_px": 360, "fx_px": 460.0, "fy_px": 461.0, "cx_px": 319.5, "cy_px": 179.5,
    "distortion": [0.0] * 5,
}  # fmt: skip
MARKER = {"code": 1, "square_mm": 44, "position_m": [0.0, 0.0, 0.08]}
CAMERA = {"calibration": LENS, "position_m": [0.09, 0.0, 0.0], "tilt_down_deg": 45.0}
SYSTEM = 11


def order(folder: Path, real: dict[str, Any], **scenario: Any) -> LaunchSpec:
    mavlink = {"flavour": "ardupilot", "system_id": SYSTEM}
    drone = {"kind": "mavlink", "mavlink": mavlink, "marker": MARKER, "camera": CAMERA}
    content = {
        "child": {"name": "sim_bridge", "role": "sim_bridge", "endpoint": "", "site": "lab"},
        "field": {
            "site": "lab",
            "room": {"size_m": [8, 6, 4.5]},
            "cameras": {"ceiling": {"calibration": LENS, "position_m": [0.0, 0.0, 4.2]}},
            "drones": {
                "drone_1": drone | {"pad_m": [1.0, 0.5], "pad_yaw_deg": 90},
                "drone_2": {"kind": "ardrone", "pad_m": [-1, -0.5], "marker": MARKER | {"code": 2}, "camera": CAMERA},
            },
            "target": {"name": "turtlebot", "marker": {"code": 5, "height_m": 0.4, "square_mm": 44}},
        },
        "scenario": scenario,
        "addresses": {"drone_2": "127.91.3.12"},
        "real": real,
        "seed": 1,
    }
    file = folder / "spec.json"
    file.write_text(json.dumps(content))
    return read_order(file)


class Process:
    """Stand-in for the bridge's process, as used by its loop."""

    name, stop_requested, supervisor_alive = "sim_bridge", False, True

    def __init__(self) -> None:
        exchange = MemoryExchange()
        self.bus = MemoryBus(exchange, "lab", "sim_bridge")
        self.tracker = MemoryBus(exchange, "lab", "tracker")
        self.truths = self.tracker.subscribe([TRUTH])
        self.events: list[tuple[Severity, str, str]] = []

    def event(self, severity: Severity, text: str, remedy: str = "", entity: str = "") -> None:
        self.events.append((severity, entity, text))

    def tick_status(self, ticks: int = 0, overruns: int = 0) -> None:
        pass

    def ready(self, detail: str = "") -> None:
        pass

    def estimate(self, x: float, y: float, z: float, yaw: float) -> None:
        robot = EntityEstimate(
            name="drone_1", kind="robot", mean=(x, y, z, yaw), covariance=(0.0,) * 16, velocity_m_s=(0.0, 0.0, 0.0),
            converged=True, age_s=0.0,
        )  # fmt: skip
        header = self.tracker.header("team")
        self.tracker.publish(ESTIMATE, Estimate(header=header, entities=(robot,), epoch=1))


def turn(harness: Harness, seconds: float) -> None:
    for _ in range(round(seconds / TICK_S)):
        harness.tick(harness.world.ticks * TICK_NS + 1)


@pytest.fixture
def port() -> int:
    return free_port(kind=socket.SOCK_DGRAM)


@pytest.fixture
def firmware(tmp_path: Path, port: int) -> Iterator[tuple[Harness, Process, socket.socket]]:
    """A bridge that follows drone_1, and the socket of the firmware that sends its pose."""
    process: Any = Process()
    real = {"drone_1": {"source": "autopilot", "address": ["127.0.0.1", port]}}
    harness = Harness(process, order(tmp_path, real))
    harness.open()
    teller = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    teller.connect(("127.0.0.1", port))
    teller.settimeout(1.0)
    yield harness, process, teller
    teller.close()
    harness.close()


def sim_state(north_m: float, east_m: float, up_m: float, yaw: float, vn: float = 0.0) -> SimState:
    lat, lon = 47.4 + north_m / 111_318.845, 8.5 + east_m / (111_318.845 * math.cos(math.radians(47.4)))
    exact = round(lat * 1e7), round(lon * 1e7)
    zeros = (0.0,) * 6
    return SimState(1, 0, 0, 0, 0.0, 0.1, yaw, *zeros, lat, lon, 488.0 + up_m, 0, 0, vn, 0.0, 0.0, *exact)


def test_a_puppet_follows_a_firmware_s_true_state_from_its_pad_on(
    firmware: tuple[Harness, Process, socket.socket],
) -> None:
    harness, process, teller = firmware
    mind = FrameEncoder(SYSTEM, 1)
    teller.send(mind.encode(sim_state(0.0, 0.0, 0.0, yaw=0.3)))
    turn(harness, 0.1)
    row = harness.world.states()[0]
    assert row[:3] == pytest.approx([1.0, 0.5, 0.06], abs=0.02) and row[8] == pytest.approx(math.pi / 2)
    # 2 m ahead of its first heading is 2 m along the heading that the field gives its pad: world y.
    teller.send(mind.encode(sim_state(2 * math.cos(0.3), 2 * math.sin(0.3), 1.2, yaw=0.3 + 0.5)))
    turn(harness, 0.1)
    row = harness.world.states()[0]
    assert row[:3] == pytest.approx([1.0, 2.5, 1.26], abs=0.03)
    assert row[8] == pytest.approx(math.pi / 2 - 0.5) and row[7] == pytest.approx(-0.1)
    assert harness.world.airborne == ("drone_1",)
    request = FrameDecoder().decode(next(split(teller.recv(512)))).message
    assert request is not None and request[:3] == (SYSTEM, 1, 511), "it asks for the true state"
    assert [text for _, _, text in process.events if "is followed" in text or "its pose" in text] == ["is followed"]


def hil_state(north_m: float, up_m: float) -> HilStateQuaternion:
    lat = 47.4 + north_m / 111_194.927
    zeros = (0,) * 3
    return HilStateQuaternion(0, (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0, round(lat * 1e7), round(8.5e7),
                              round(1000 * (488.0 + up_m)), *zeros, 0, 0, *zeros)  # fmt: skip


def test_a_vehicle_does_not_move_when_its_simulator_is_placed_on_its_globe(
    firmware: tuple[Harness, Process, socket.socket],
) -> None:
    harness, process, teller = firmware
    mind = FrameEncoder(SYSTEM, 1)
    still = (0.0, 0.0, 0.0)
    teller.send(mind.encode(Attitude(1, *still, *still)))
    for place in ((0.0, 0.0, 0.0), (1.0, 0.0, -1.0)):  # its own reports, before and after its flight
        teller.send(mind.encode(LocalPositionNed(2, *place, *still)))
        turn(harness, 0.05)
    before = harness.world.states()[0][:3].copy()
    assert before == pytest.approx([1.0, 1.5, 1.06], abs=0.01)
    told = (Severity.WARNING, "drone_1", "its pose is its own estimate: cameras confirm its errors")
    assert process.events == [(Severity.INFO, "drone_1", "is followed"), told], "at its lift-off, once"
    teller.send(mind.encode(hil_state(5.0, 0.0)))
    turn(harness, 0.05)
    assert harness.world.states()[0][:3] == pytest.approx(before, abs=0.02)
    assert process.events[-1] == (Severity.INFO, "drone_1", "its pose is exact now")
    teller.send(mind.encode(hil_state(6.0, 0.9)))
    turn(harness, 0.05)
    assert harness.world.states()[0][:3] == pytest.approx(np.add(before, (0.0, 1.0, 0.9)), abs=0.02)


def test_an_estimate_that_wanders_on_the_pad_moves_nobody(
    firmware: tuple[Harness, Process, socket.socket],
) -> None:
    harness, _, teller = firmware
    mind, still = FrameEncoder(SYSTEM, 1), (0.0, 0.0, 0.0)
    teller.send(mind.encode(Attitude(1, *still, *still)))
    for place in (still, (0.1, 0.0, 0.2)):
        teller.send(mind.encode(LocalPositionNed(2, *place, *still)))
        turn(harness, 0.05)
    teller.send(mind.encode(hil_state(0.0, 0.0)))
    turn(harness, 0.05)
    assert harness.world.states()[0][:3] == pytest.approx([1.0, 0.5, 0.06], abs=0.01)


def test_a_body_without_fresh_pose_is_nowhere_and_an_event_says_so(
    firmware: tuple[Harness, Process, socket.socket],
) -> None:
    harness, process, teller = firmware
    turn(harness, 0.1)
    assert np.isnan(harness.world.states()[0]).all(), "a firmware that is not heard stands nowhere"
    assert (
        process.events[0][:2] == (Severity.WARNING, "drone_1") and "no pose of the real one yet" in process.events[0][2]
    )
    teller.send(FrameEncoder(SYSTEM, 1).encode(sim_state(0.0, 0.0, 0.0, yaw=0.0)))
    turn(harness, 0.1)
    process.truths.drain()
    turn(harness, STALE_S + 0.2)
    assert np.isnan(harness.world.states()[0]).all()
    assert process.events[-1][2].startswith(f"no pose of the real one for {STALE_S:g} s")
    turn(harness, 0.2)
    said = {received.message.header.entity for received in process.truths.drain()[-6:] if received.message}
    assert said == {"drone_2", "turtlebot"}, "no truth is made up"


def test_telemetry_of_another_vehicle_moves_no_body(firmware: tuple[Harness, Process, socket.socket]) -> None:
    harness, _, teller = firmware
    teller.send(FrameEncoder(SYSTEM + 1, 1).encode(sim_state(0.0, 0.0, 0.0, yaw=0.0)))
    teller.send(b"no frame at all")
    turn(harness, 0.05)
    assert harness.world.puppets["drone_1"].poses == 0


def test_emulated_cameras_show_a_followed_body_and_not_one_that_only_the_tracker_knows(tmp_path: Path) -> None:
    for source, shown in (("autopilot", True), ("estimate", False)):
        address = {"address": ["127.0.0.1", free_port(kind=socket.SOCK_DGRAM)]} if source == "autopilot" else {}
        read = order(tmp_path, {"drone_1": {"source": source, **address}})
        streams = {"ceiling": ("127.91.3.50", 8080), "drone_1": ("127.91.3.51", 8080)}
        specs = render_specs(read.site, read.scenario, streams, "board", 1, read.unseen)
        assert ("drone_1" in {board.body for board in specs[0].boards}) is shown


def test_a_body_that_is_nowhere_is_in_no_picture(tmp_path: Path) -> None:
    read = order(tmp_path, {"drone_1": {"source": "autopilot", "address": ["127.0.0.1", 9]}})
    (spec,) = render_specs(read.site, read.scenario, {"ceiling": ("127.91.3.50", 8080)}, "board", 1, read.unseen)
    states = np.zeros((3, 13))
    assert {sight.board.body for sight in compose_scene(spec, states).sights} == {"drone_1", "drone_2", "turtlebot"}
    states[0] = math.nan
    assert {sight.board.body for sight in compose_scene(spec, states).sights} == {"drone_2", "turtlebot"}


def test_the_tracker_s_estimate_moves_a_puppet_and_is_no_truth(tmp_path: Path) -> None:
    process: Any = Process()
    harness = Harness(process, order(tmp_path, {"drone_1": {"source": "estimate"}}))
    harness.open()
    try:
        turn(harness, 0.1)
        assert harness.world.states()[0][:2] == pytest.approx([1.0, 0.5]), "until then it stands on its pad"
        process.estimate(0.3, -0.4, 1.5, 0.7)
        turn(harness, 0.1)
        assert harness.world.states()[0][[0, 1, 2, 8]] == pytest.approx([0.3, -0.4, 1.5, 0.7])
        said = {received.message.header.entity for received in process.truths.drain() if received.message}
        assert "drone_1" not in said
        turn(harness, 1.0)
        assert np.isnan(harness.world.states()[0]).all()
    finally:
        harness.close()


def test_a_real_target_is_in_no_emulated_picture_and_is_not_steered(tmp_path: Path) -> None:
    real = {"drone_1": {"source": "estimate"}, "turtlebot": {"source": "none"}}
    process: Any = Process()
    harness = Harness(process, order(tmp_path, real))
    assert harness.world.targets == {} and np.isnan(harness.world.states()[2]).all()


def test_faults_of_what_is_real_are_refused(tmp_path: Path) -> None:
    faults = [{"kind": "navdata_silent", "entity": "drone_1", "start_s": 1}]
    with pytest.raises(SettingsError, match="'drone_1' is none of drone_2"):
        order(tmp_path, {"drone_1": {"source": "estimate"}}, faults=faults)
    with pytest.raises(SettingsError, match="'drone_9' is no body"):
        order(tmp_path, {"drone_9": {"source": "estimate"}})


def test_a_taken_port_is_named(port: int) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.bind(("127.0.0.1", port))
        with pytest.raises(GroundStationError, match=rf"the true pose of drone_1: cannot listen on 127.0.0.1:{port}"):
            AutopilotTruth("drone_1", ("127.0.0.1", port), SYSTEM, Placement((0.0, 0.0), 0.0))


@pytest.fixture
def truth(port: int) -> Iterator[AutopilotTruth]:
    listener = AutopilotTruth("drone_1", ("127.0.0.1", port), SYSTEM, Placement((0.0, 0.0), 0.0))
    yield listener
    listener.close()


def test_px4_s_true_state_is_read_in_its_units(truth: AutopilotTruth) -> None:
    half = math.radians(30) / 2
    q = (math.cos(half), 0.0, 0.0, math.sin(half))
    zeros = (0, 0, 0, 0, 0)
    mind = FrameEncoder(SYSTEM, 1)
    truth.take(mind.encode(HilStateQuaternion(1, q, 0.1, 0.2, 0.3, 474000000, 85000000, 488000, 0, 0, 0, *zeros)))
    state = truth.take(
        mind.encode(HilStateQuaternion(1, q, 0.1, 0.2, 0.3, 474000900, 85000000, 489500, 50, -20, 10, *zeros))
    )
    assert state is not None
    assert state.position == pytest.approx((10.0, 0.0, -489.5), abs=0.01)
    assert state.velocity == pytest.approx((0.5, -0.2, 0.1)) and state.attitude[2] == pytest.approx(math.radians(30))
    assert state.grain_m == pytest.approx(0.0111, abs=0.0001), "1e-7 degrees"


def test_a_local_position_counts_until_something_exact_is_heard(truth: AutopilotTruth) -> None:
    mind = FrameEncoder(SYSTEM, 1)
    local = mind.encode(LocalPositionNed(5, 1.0, 2.0, -1.5, 0.1, 0.2, 0.3))
    assert truth.take(local) is None, "without an attitude it is no pose"
    truth.take(mind.encode(Attitude(5, 0.0, 0.1, 0.2, 0.0, 0.0, 0.0)))
    state = truth.take(local)
    assert state is not None and state.position == pytest.approx((1.0, 2.0, -1.5))
    assert state.velocity == pytest.approx((0.1, 0.2, 0.3)) and state.attitude == pytest.approx((0.0, 0.1, 0.2))
    truth.take(mind.encode(sim_state(0.0, 0.0, 0.0, yaw=0.0)))
    assert truth.take(local) is None
    nan = mind.encode(sim_state(0.0, 0.0, math.nan, yaw=0.0))
    assert truth.take(nan) is None
