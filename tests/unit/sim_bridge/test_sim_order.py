"""The bridge's launch specification: checks, sections of the render processes, time and faults."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import Severity
from groundstation.errors import GroundStationError, SettingsError
from sim_bridge.cameras import render_specs
from sim_bridge.devices.ardrone import ArDroneEmulator
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.faults import FaultSchedule
from sim_bridge.harness import Harness
from sim_bridge.launch_spec import read_order
from sim_bridge.render.spec import BodyShape
from sim_bridge.scenario import Scenario
from sim_bridge.tick_schedule import LATE_NS, Clockwork
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.world import TICK_NS, World

LENS = {
    "model": "plumb_bob",
    "width_px": 640,
    "height_px": 360,
    "fx_px": 460.0,
    "fy_px": 461.0,
    "cx_px": 319.5,
    "cy_px": 179.5,
    "distortion": [-0.3, 0.08, 0.0, 0.0, 0.0],
}
MARKER = {"code": 1, "square_mm": 44, "position_m": [0.0, 0.0, 0.08]}
CAMERA = {"calibration": LENS, "position_m": [0.09, 0.0, 0.0], "tilt_down_deg": 45.0}


def order() -> dict[str, Any]:
    return {
        "child": {"name": "sim_bridge", "role": "sim_bridge", "endpoint": "", "site": "lab"},
        "field": {
            "site": "lab",
            "room": {"size_m": [8, 6, 4.5], "fence": "not for the simulator"},
            "cameras": {"ceiling": {"calibration": LENS, "position_m": [0.5, 0.0, 4.2]}},
            "drones": {
                "drone_1": {
                    "kind": "ardrone",
                    "pad_m": [-1, 0.5],
                    "pad_yaw_deg": 90,
                    "marker": MARKER,
                    "camera": CAMERA,
                },
                "drone_2": {"kind": "ardrone", "pad_m": [-1, -0.5], "marker": MARKER | {"code": 2}, "camera": CAMERA},
            },
            "target": {"name": "turtlebot", "marker": {"code": 5, "height_m": 0.4, "square_mm": 44}},
            "planner": {"of": "no interest"},
        },
        "scenario": {"seed": 4},
        "addresses": {"drone_1": "127.1.2.11", "drone_2": "127.1.2.12"},
        "streams": {"ceiling": ["127.1.2.50", 8080], "drone_1": ["127.1.2.51", 8080]},
        "seed": 9,
    }


def write(path: Path, content: dict[str, Any]) -> Path:
    file = path / "spec.json"
    file.write_text(json.dumps(content))
    return file


def test_a_good_order_is_read(tmp_path: Path) -> None:
    read = read_order(write(tmp_path, order()))
    assert read.site.bodies == ("drone_1", "drone_2", "turtlebot")
    assert read.seed == 9
    assert read.streams["ceiling"] == ("127.1.2.50", 8080)
    assert read.scenario.seed == 4


def test_without_a_seed_the_scenario_decides(tmp_path: Path) -> None:
    content = order()
    del content["seed"]
    assert read_order(write(tmp_path, content)).seed == 4


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (lambda o: o.pop("field"), "field"),
        (lambda o: o["field"]["drones"]["drone_1"].pop("pad_m"), "drones.drone_1.pad_m"),
        (lambda o: o["addresses"].pop("drone_2"), "addresses: none for drone_2"),
        (lambda o: o["scenario"].update(cameras={"fsp": 3}), "cameras.fsp"),
        (
            lambda o: o["scenario"].update(faults=[{"kind": "camera_cut", "entity": "celing", "start_s": 1}]),
            "'celing' is none of ceiling, drone_1",
        ),
        (
            lambda o: o["scenario"].update(faults=[{"kind": "navdata_silent", "entity": "ceiling", "start_s": 1}]),
            "'ceiling' is none of drone_1, drone_2",
        ),
        (
            lambda o: o["scenario"].update(drones={"firmware_by_drone": {"drone_9": "ar1-1.7"}}),
            r"firmware_by_drone\.drone_9: there is no such drone, only drone_1, drone_2",
        ),
        (lambda o: o["child"].pop("role"), r"child\.role: Field required"),
        (lambda o: o["scenario"].update(drones={"firmware": "ar3"}), "firmware: known firmwares: ar1-1.5, "),
    ],
)
def test_wrong_orders_are_refused_by_name(tmp_path: Path, change: Any, named: str) -> None:
    content = order()
    change(content)
    with pytest.raises(SettingsError, match=named):
        read_order(write(tmp_path, content))


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match=r"nowhere\.json"):
        read_order(tmp_path / "nowhere.json")


def test_render_specs_follow_field_and_scenario(tmp_path: Path) -> None:
    content, broken = order(), (("camera_stall", 4), ("camera_held_back", 4), ("camera_held_back", 5))
    content["scenario"] = {
        "cameras": {"frame_loss": 0.1},
        "faults": [{"kind": kind, "entity": "ceiling", "start_s": 3, "end_s": end_s} for kind, end_s in broken],
    }
    read = read_order(write(tmp_path, content))
    ceiling, onboard = render_specs(read.site, read.scenario, read.streams, "board", read.seed)
    assert (ceiling.camera, ceiling.address, ceiling.port) == ("ceiling", "127.1.2.50", 8080)
    assert ceiling.mount.body == ""
    point = ceiling.mount.parent_from_optical.apply(np.array([1.0, 2.0, 4.2]))
    np.testing.assert_allclose(point, [1.5, -2.0, 0.0], atol=1e-12)
    assert [outage.kind.value for outage in ceiling.scenario.outages] == ["stall", "held_back", "stall"]
    assert ceiling.scenario.frame_loss == 0.1
    assert onboard.mount.body == "drone_1"
    assert onboard.scenario.outages == ()
    ahead = onboard.mount.parent_from_optical.apply(np.array([0.0, 0.0, np.sqrt(2.0)]))
    np.testing.assert_allclose(ahead, [1.09, 0.0, -1.0], atol=1e-12)
    assert [(board.body, board.code) for board in onboard.boards] == [("drone_1", 1), ("drone_2", 2), ("turtlebot", 5)]
    assert onboard.boards[2].shape is BodyShape.TURTLEBOT
    assert onboard.boards[2].position_m == (0.0, 0.0, 0.4)


@pytest.mark.parametrize(
    ("firmware", "header_bytes"), [("ar2-2.2", 64), ("ar2-2.3", 68), ("ar2-2.3.3", 68), ("ar2-2.4.8", 68), (None, 68)]
)
def test_the_header_of_a_drone_s_video_is_that_of_its_firmware(
    tmp_path: Path, firmware: str | None, header_bytes: int
) -> None:
    content = order()
    content["field"]["drones"]["drone_1"]["camera"]["source"] = "ardrone://192.168.1.11"
    if firmware is not None:
        content["scenario"] = {"drones": {"firmware_by_drone": {"drone_1": firmware}}}
    read = read_order(write(tmp_path, content))
    _, onboard = render_specs(read.site, read.scenario, read.streams, "board", read.seed)
    assert onboard.own is not None and onboard.own.options == {"header_bytes": header_bytes}


def test_a_stream_of_no_camera_is_named(tmp_path: Path) -> None:
    content = order()
    content["streams"]["attic"] = ["127.1.2.53", 8080]
    read = read_order(write(tmp_path, content))
    with pytest.raises(GroundStationError, match="attic"):
        render_specs(read.site, read.scenario, read.streams, "board", 1)


def test_clockwork_counts_late_ticks_and_gives_up_on_lost_time() -> None:
    clock = Clockwork(0)
    assert [clock.next_deadline() for _ in range(3)] == [TICK_NS, 2 * TICK_NS, 3 * TICK_NS]
    clock.begin(clock.deadline_ns + 9_000_000)
    assert clock.overruns == 0
    clock.begin(clock.deadline_ns + 11_000_000)
    assert clock.overruns == 1
    assert clock.next_deadline() == 4 * TICK_NS, "it catches up"
    clock.begin(5_000_000_000)
    assert clock.next_deadline() == 5_000_000_000 + TICK_NS, "after a freeze it starts anew"


def test_more_than_one_percent_late_invalidates_the_run() -> None:
    clock = Clockwork(0)
    for tick in range(1000):
        deadline = clock.next_deadline()
        clock.begin(deadline + (20_000_000 if tick < 10 else 0))
    assert not clock.faults
    clock.begin(clock.next_deadline() + 20_000_000)
    assert clock.faults


def test_faults_begin_and_end_on_time(tmp_path: Path) -> None:
    read = read_order(write(tmp_path, order()))
    world = World(read.site, Scenario(), 1)
    emulators = {
        name: ArDroneEmulator(name, "127.90.1.1" if name == "drone_1" else "127.90.1.2", drone, world.onboard[name])
        for name, drone in world.of(Quadrotor).items()
    }
    schedule = FaultSchedule(
        [
            Fault(kind=FaultKind.NAVDATA_SILENT, entity="drone_1", start_s=2, end_s=3),
            Fault(kind=FaultKind.AT_DEAF, entity="drone_2", start_s=1),
            Fault(kind=FaultKind.BATTERY_DROP, entity="drone_1", start_s=1.5, value=0.1),
            Fault(kind=FaultKind.CAMERA_CUT, entity="ceiling", start_s=0),
            Fault(kind=FaultKind.PROPELLER_BLOCKED, entity="drone_2", start_s=2.5, end_s=2.9),
        ],
        world,
        emulators,
    )
    assert schedule.apply(0.5) == [("ceiling", "fault camera_cut of ceiling begins")]
    assert len(schedule.apply(1.6)) == 2
    assert [line.split()[1] for _, line in schedule.apply(1.7, flies=True)] == ["camera_cut", "at_deaf", "battery_drop"]
    assert emulators["drone_2"].deaf
    assert world.drones["drone_1"].battery == 0.1
    assert not emulators["drone_1"].silent
    schedule.apply(2.0)
    assert emulators["drone_1"].silent
    schedule.apply(2.6)
    assert emulators["drone_2"].control.blocked
    schedule.apply(2.95)
    assert not emulators["drone_2"].control.blocked
    assert schedule.apply(3.1) == [("drone_1", "fault navdata_silent of drone_1 ends")]
    assert not emulators["drone_1"].silent
    for emulator in emulators.values():
        emulator.close()


def test_late_ticks_before_anything_flies_do_not_count() -> None:
    clock = Clockwork(0)
    for matters in (False, True):
        for late in (True, False):
            clock.begin(clock.next_deadline() + (LATE_NS + 1 if late else 0), matters)
    assert (clock.ticks, clock.judged, clock.overruns) == (4, 2, 1)


def test_a_run_whose_pictures_come_late_is_invalid() -> None:
    clock = Clockwork(0)
    clock.count_pictures(50, 40, matters=False)  # before anything flies
    clock.count_pictures(1050, 50)
    assert (clock.pictures, clock.late_pictures, clock.faults) == (1000, 10, [])
    clock.count_pictures(1060, 60)
    assert "pictures" in clock.faults[0]


@pytest.mark.parametrize(
    ("entry", "named"),
    [
        ({"kind": "uniform_floor", "entity": "px4_1"}, "'px4_1' is none of drone_1, drone_2"),
        ({"kind": "wrong_board", "entity": "drone_1", "other": "nobody"}, "other: 'nobody' is none of"),
        ({"kind": "odometry_silent", "entity": "turtlebot"}, "'turtlebot' is none of"),
        ({"kind": "picture_black", "entity": "turtlebot"}, "'turtlebot' is none of ceiling, drone_1"),
        ({"kind": "ids_swapped", "entity": "drone_1", "other": "px4_1"}, "drone_1 and px4_1 are of different kinds"),
    ],
)
def test_wrong_values_of_what_cannot_have_them_are_refused(tmp_path: Path, entry: dict[str, Any], named: str) -> None:
    content = order()
    px4 = {"kind": "mavlink", "mavlink": {"flavour": "px4", "system_id": 11}, "pad_m": [1, 0], "marker": MARKER}
    content["field"]["drones"]["px4_1"] = px4
    content["addresses"]["px4_1"] = "127.1.2.13"
    content["scenario"]["faults"] = [{"start_s": 0, **entry}]
    with pytest.raises(SettingsError, match=named):
        read_order(write(tmp_path, content))


def test_cameras_are_told_their_faults_and_carried_by_the_body_behind_an_address(tmp_path: Path) -> None:
    content = order()
    content["scenario"] = {
        "faults": [
            {"kind": "ids_swapped", "entity": "drone_1", "other": "drone_2", "start_s": 0},
            {"kind": "picture_frozen", "entity": "ceiling", "start_s": 3},
            {"kind": "wrong_board", "entity": "drone_2", "other": "turtlebot", "start_s": 4},
        ]
    }
    read = read_order(write(tmp_path, content))
    ceiling, onboard = render_specs(read.site, read.scenario, read.streams, "board", 1)
    assert [fault.kind for fault in ceiling.scenario.faults] == [FaultKind.PICTURE_FROZEN, FaultKind.WRONG_BOARD]
    assert [fault.kind for fault in onboard.scenario.faults] == [FaultKind.WRONG_BOARD]
    assert onboard.mount.body == "drone_2"


class Process:
    """Stand-in for the bridge's process, as used by its loop."""

    name, stop_requested, supervisor_alive = "sim_bridge", False, True

    def __init__(self) -> None:
        self.bus = MemoryBus(MemoryExchange(), "lab", "sim_bridge")
        self.events: list[tuple[str, str, str]] = []

    def event(self, severity: Severity, text: str, remedy: str = "", entity: str = "", injected: bool = False) -> None:
        self.events.append((str(severity) * injected, entity, text))

    def tick_status(self, ticks: int = 0, overruns: int = 0) -> None:
        pass

    def ready(self, detail: str = "") -> None:
        pass


def test_injected_faults_are_events_of_their_entities_and_reach_the_wire(tmp_path: Path) -> None:
    content = order()
    content["streams"] = {}
    content["addresses"] = {"drone_1": "127.90.1.11", "drone_2": "127.90.1.12"}
    content["scenario"]["faults"] = [
        {"kind": "velocity_stuck", "entity": "drone_1", "start_s": 0.1, "end_s": 0.3, "value": 0.5},
        {"kind": "wind", "entity": "drone_2", "start_s": 0.1, "value": 1.0, "direction_deg": 90},
    ]
    process: Any = Process()
    harness = Harness(process, read_order(write(tmp_path, content)))
    harness.open()
    try:
        for tick in range(100):
            harness.tick(tick * TICK_NS)
        assert harness.world.drones["drone_2"].wind == pytest.approx((0.0, 1.0), abs=1e-12)
        emulator = harness._stage.emulators["drone_1"]
        assert isinstance(emulator, ArDroneEmulator) and emulator._edge._wrong is not None
    finally:
        harness.close()
    assert process.events == [
        ("WARNING", "drone_1", "fault velocity_stuck 0.5 of drone_1 begins"),
        ("WARNING", "drone_2", "fault wind 1 of drone_2 begins"),
        ("WARNING", "drone_1", "fault velocity_stuck 0.5 of drone_1 ends"),
    ]
