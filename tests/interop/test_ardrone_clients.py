"""Public AR.Drone clients fly our emulator: take-off, motion, acknowledged settings, landing."""

from typing import Any

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.interop, pytest.mark.timeout(180)]


def flew(states: list[dict[str, Any]], address: str) -> None:
    """Assert by ground truth that a drone rose, moved ahead on its own track and landed again."""
    track = [state[address] for state in states]
    begin, end = track[0]["position"], track[-1]["position"]
    assert max(row["position"][2] for row in track) > 0.6
    assert 0.3 < end[0] - begin[0] < 6.0, "forward is along x"
    assert abs(end[1] - begin[1]) < 0.8
    phases = {row["phase"] for row in track}
    # At a hover command it first brakes: on a busy machine the program may command the landing before that ends.
    assert {"TAKING_OFF", "FLYING", "LANDING"} <= phases and phases & {"BRAKING", "HOVERING"}
    assert track[-1]["phase"] == "LANDED" and end[2] < 0.1


def assert_node_was_served(seen: dict[str, Any]) -> None:
    assert seen["acks"] == [["navdata_demo", True], ["altitude_max", True], ["euler_angle_max", True]]
    order = [event for event in seen["events"] if event != "landed"]
    assert order == ["takeoff", "hovering", "flying", "hovering", "landing"] and seen["events"][-1] == "landed"
    assert seen["errors"] == 0
    assert 0.6 < seen["altitude"] < 1.2
    assert 80 < seen["last"]["battery"] <= 100 and seen["last"]["state"] == "CTRL_LANDED"


def test_three_drones_fly_at_once_by_two_programs(hangar: Any, programs: Any) -> None:
    drones = hangar(3)
    first, second, third = drones.addresses
    running = [programs.node("node_flight.js", address, "demo", 2.0) for address in (first, second)]
    other = programs.pyardrone("pyardrone_flight.py", third, 2.0)
    for process in running:
        seen = programs.result(process)
        assert_node_was_served(seen)
        assert seen["options"]["demo"] > 100 and seen["options"]["visionDetect"] == seen["options"]["demo"]
    seen = programs.result(other)
    assert seen["took_off"] and seen["hovers"] and seen["landed"]
    assert seen["vx"] > 500 and 500 < seen["altitude"] < 1200
    assert {"demo", "magneto", "zimmu_3000", "cks"} <= set(seen["options"]), "every option has its size"
    assert seen["sent"] > 1000, "a loop without a pause"
    states = drones.stop()
    for address in drones.addresses:
        flew(states, address)


@pytest.mark.parametrize(
    ("options", "gps"),
    [
        pytest.param(("--omit-option", "27"), False, id="2.3", marks=pytest.mark.exhaustive),
        pytest.param(("--firmware", "ar2-2.4.8"), True, id="2.4.8"),
    ],
)
def test_node_reads_full_navdata(hangar: Any, programs: Any, options: tuple[str, ...], gps: bool) -> None:
    drones = hangar(1, *options)
    seen = programs.result(programs.node("node_flight.js", drones.addresses[0], "full", 1.5))
    assert_node_was_served(seen)
    assert seen["packets"] > 1000, "200 packets a second"
    assert seen["options"]["magneto"] > 1000 and seen["options"]["rawMeasures"] > 1000
    assert ("gps" in seen["options"]) is gps
    flew(drones.stop(), drones.addresses[0])


def test_a_program_that_navigates_by_itself_completes_its_mission(hangar: Any, programs: Any) -> None:
    drones = hangar(1)
    seen = programs.result(programs.node("node_mission.js", drones.addresses[0]))
    assert seen["error"] is None
    assert {"demo", "visionDetect", "magneto", "wifi"} <= set(seen["options"])
    track = [state[drones.addresses[0]]["position"] for state in drones.stop()]
    highest = max(z for _, _, z in track)
    (x, y, z), (x0, y0, _) = track[-1], track[0]
    assert 0.8 < highest < 1.5, "it asked for 1 m"
    assert 0.9 < ((x - x0) ** 2 + (y - y0) ** 2) ** 0.5 < 2.2, "1 m forward and 1 m to the right"
    assert z < 0.1


def test_node_parses_our_video(hangar: Any, programs: Any) -> None:
    drones = hangar(1, "--video")
    seen = programs.result(programs.node("node_video.js", drones.addresses[0], 0))
    assert seen["frames"] >= 20 and seen["keys"] >= 1
    assert seen["sizes"] == [640, 360]


def test_node_turns_our_video_into_pictures(hangar: Any, programs: Any) -> None:
    drones = hangar(1, "--video")
    seen = programs.result(programs.node("node_video.js", drones.addresses[0], 5))
    assert len(seen["pngs"]) >= 5
    for width, height, size in seen["pngs"]:
        assert (width, height) == (640, 360)
        assert size > 5_000, "not an empty picture"
