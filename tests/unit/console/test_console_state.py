"""The console's state and its form: sections, history, health, pictures, scene."""

import json
import math
from pathlib import Path

import msgspec
import numpy as np
import pytest

from groundstation.bus import keys
from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.api import Received
from groundstation.bus.topics import Topic
from groundstation.console.history import History
from groundstation.console.innovation_statistics import InnovationStatistics, chi_square_bounds
from groundstation.console.room import bare_scene, lenses_of, scene_from_field
from groundstation.console.snapshot import Snapshot
from groundstation.console.state import ConsoleState
from groundstation.field.resolved import ResolvedField
from groundstation.monitor.state import Cast
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field
from groundstation.time_units import NS_PER_S

LAB = Path(__file__).parents[3] / "config" / "lab.yaml"


@pytest.fixture(scope="module")
def field() -> ResolvedField:
    return resolved_field(load_field(LAB, []))


def header(entity: str, stamp_ns: int = NS_PER_S) -> m.Header:
    return m.Header(stamp_ns, "c", entity, "s", 0)


def received(topic: Topic, message: m.Message) -> Received:
    key = keys.Key("lab", message.header.entity, topic, "s")
    return Received(key, message.header, message, b"")


def estimate(stamp_ns: int = NS_PER_S, age_s: float = 0.1) -> m.Estimate:
    robot = m.EntityEstimate(
        "drone_1", "robot", (1.0, 2.0, 1.5, 0.3), (0.04, 0.01, 0, 0, 0.01, 0.02) + (0.0,) * 10, (0, 0, 0), True, age_s
    )
    target = m.EntityEstimate("turtlebot", "target", (0.5, 0.0), (0.01, 0.0, 0.0, 0.01), (0.1, 0.0), True, age_s)
    return m.Estimate(header=header("team", stamp_ns), entities=(robot, target), epoch=3)


def test_the_map_of_a_search_is_shown_as_long_as_it_lasts() -> None:
    state, board = ConsoleState(Cast(), 0), Snapshot()
    of_search = m.TargetSearch("turtlebot", "SEARCH", 2.0, (0.4, 0.0), 0.1, None, "searched for 2 s")
    cells = m.SearchMap(header=header("turtlebot"), first_m=(-0.2, 0.0), cell_m=0.2, columns=3, chances=(0, 255, 9))
    searching = msgspec.structs.replace(estimate(), searches=(of_search,))
    shown = []
    for message, topic in ((cells, t.SEARCH_MAP), (searching, t.ESTIMATE), (estimate(), t.ESTIMATE)):
        state.ingest([received(topic, message)])
        board.begin()
        state.put_seldom(board, NS_PER_S)
        shown.append(json.loads(board.since(-1))["search_maps"])
    assert shown == [{}, {"turtlebot": {"first": [-0.2, 0.0], "cell": 0.2, "columns": 3, "chances": [0, 255, 9]}}, {}]


def test_a_board_tells_what_changed_since() -> None:
    board = Snapshot()
    board.begin()
    board.put("a", 1)
    board.put("b", 2)
    first = board.turn
    assert json.loads(board.since(-1)) == {"a": 1, "b": 2}
    board.begin()
    board.put("a", 1)
    board.put("b", 3)
    assert json.loads(board.since(first)) == {"b": 3}
    assert json.loads(board.since(board.turn)) == {}
    assert json.loads(board.since(0)) == {"a": 1, "b": 3}
    # Two viewers with the same state share the bytes.
    assert board.since(first) is board.since(first)


def test_sections_say_what_came() -> None:
    state, board = ConsoleState(Cast("lab", {"drone_1": 0.15}, ("turtlebot",)), NS_PER_S), Snapshot()
    setpoint = m.VelocitySetpoint(
        header=header("drone_1"), velocity_m_s=(0.1, 0, 0), yaw_rate_rad_s=0.2, lifetime_ms=300, epoch=3
    )
    control = m.Control("drone_1", (0.1, 0, 0), 0.2, ("fence",), (0.5, 0, 0))
    plan = m.Plan(
        header=header("team"),
        topology="drone_1",
        cost=0.01,
        controls=(control,),
        edges=(m.Edge("ceiling", "drone_1", 5.0),),
        alternatives=(m.Alternative("drone_1", 0.01),),
        solver=m.SolverReport("converged", 10, 0.02, 1, 1),
        mode="TRACK",
    )
    truth = m.TruthState(
        header=header("turtlebot"),
        position_m=(0.5, 0.1, 0),
        velocity_m_s=(0, 0, 0),
        attitude_rad=(0, 0, 1.0),
        on_ground=True,
    )
    status = m.VehicleStatus(header=header("drone_1"), flight_state=m.FlightState.FLYING, mode="TRACK", battery=0.5)
    event = m.Event(header=header("drone_1"), severity=m.Severity.ERROR, text="bang", remedy="duck")
    process = m.ProcessStatus(header=header("tracker"), state=m.Lifecycle.READY, pid=1, cpu=0.1, ticks=100, overruns=2)
    camera = m.CameraStatus(
        header=header("ceiling"), connected=True, fps=15, age_ms=90, frames=1, skipped=0, detections=0
    )
    state.ingest(
        [
            received(t.ESTIMATE, estimate()),
            received(t.SETPOINT, setpoint),
            received(t.PLAN, plan),
            received(t.TRUTH, truth),
            received(t.VEHICLE_STATUS, status),
            received(t.EVENT, event),
            received(t.PROCESS_STATUS, process),
            received(t.CAMERA_STATUS, camera),
        ]
    )
    for turn in range(10):
        board.begin()
        state.note(NS_PER_S + turn * 50_000_000)
        state.put(board, NS_PER_S + turn * 50_000_000)
    said = json.loads(board.since(-1))
    assert [entity["name"] for entity in said["estimate"]["entities"]] == ["drone_1", "turtlebot"]
    assert said["estimate"]["entities"][0]["cov"] == [0.04, 0.01, 0.02]
    assert (said["plan"]["cost"], said["plan"]["words"]) == ("100 cm²", "drone_1")
    assert said["plan"]["cost_cm2"] == 100.0 and said["plan"]["controls"][0]["wanted"] == [0.5, 0, 0]
    assert said["setpoints"]["drone_1"]["at"] == 1000.0
    assert said["truth"]["turtlebot"]["yaw"] == 1.0
    assert (said["vehicles"]["drone_1"]["battery"], said["vehicles"]["drone_1"]["charge"]) == (0.5, "good")
    assert said["events"][0]["remedy"] == "duck"
    assert said["processes"]["tracker"]["late"] == 0.02
    assert said["cameras"]["ceiling"]["fps"] == 15
    assert json.loads(board.since(0))["samples"][0]["error_m"] == pytest.approx(0.1)
    assert any("bang" in alarm["text"] and alarm["grave"] and alarm["asks"] for alarm in said["alarms"])
    assert said["safety"] == {"level": "ACT", "reason": "drone_1: bang. To do: duck"}


def plan(at_s: float, topology: str, cost: float, stay: dict[str, float]) -> Received:
    made = m.Plan(
        header=header("team", int(at_s * NS_PER_S)),
        topology=topology,
        cost=cost,
        controls=(),
        edges=(),
        alternatives=tuple(m.Alternative(*other) for other in stay.items()),
        solver=m.SolverReport("converged", 10, 0.02, 1, 1),
        mode="TRACK",
    )
    return received(t.PLAN, made)


def test_curves_of_a_tracker_that_is_silent_end() -> None:
    state, board = ConsoleState(Cast("lab", {}, ("turtlebot",)), 0), Snapshot()
    innovation = m.Innovation(
        header=header("ceiling"), observer="ceiling", subject="drone_1", verdict=m.Verdict.ACCEPTED,
        residual=(0.1, 0.1), nis=2.0,
    )  # fmt: skip
    state.ingest([received(t.ESTIMATE, estimate()), plan(1.0, "drone_1", 0.04, {})])
    state.ingest([received(t.INNOVATION, innovation)] * 10)
    samples = []
    for seconds in (0.1, 3.0):
        state.note(NS_PER_S + round(seconds * NS_PER_S))
        board.begin()
        state.put(board, NS_PER_S)
        samples += json.loads(board.since(board.turn - 1))["samples"]
    figures = ("axis_m", "cost_cm2", "nis")
    assert all(samples[0][name] is not None for name in figures)
    assert [samples[1][name] for name in figures] == [None, None, None] and samples[1]["topology"] == ""
    assert len(state.history.as_json()["trails"]["turtlebot"]) == 1


def test_the_last_switch_of_topology_stays_with_its_reason() -> None:
    state, board = ConsoleState(Cast(), 0), Snapshot()
    state.ingest([plan(1.0, "a,b", 0.2, {}), plan(2.0, "a/b", 0.1, {"a,b": 0.2})])
    state.ingest([plan(3.0, "a/b", 0.1, {"a,b": 0.2})])
    board.begin()
    state.put_often(board, NS_PER_S)
    said = json.loads(board.since(-1))["switch"]
    assert said == {
        "at": 2000.0,
        "before": "a + b",
        "now": "a over b",
        "reason": "the target's place should be known 50 % better this way",
    }


def test_a_viewer_gets_all_that_was_added_since_its_last_frame() -> None:
    """Slow ones too: otherwise trails and curves had gaps in a fast replay."""
    board = Snapshot()
    for turn in range(1, 4):
        board.begin()
        board.put("estimate", turn)
        board.add("points", [["drone_1", turn], ["drone_2", turn]])
    assert json.loads(board.since(1)) == {
        "estimate": 3,
        "points": [[f"drone_{k}", turn] for turn in (2, 3) for k in (1, 2)],
    }
    assert json.loads(board.since(3)) == {} and json.loads(board.since(-1)) == {"estimate": 3}, (
        "the seed has the history"
    )
    board.begin()
    board.add("points", [])
    assert json.loads(board.since(3)) == {}
    board.add("points", ([index] for index in range(1500)))
    assert len(json.loads(board.since(3))["points"]) == 1000
    board.forget()
    assert json.loads(board.since(1)) == {}


def test_an_infinite_age_is_sent_as_a_large_number() -> None:
    state, board = ConsoleState(Cast("lab", {}, ("turtlebot",)), 0), Snapshot()
    seen = estimate(age_s=1e300)
    nowhere = tuple(msgspec.structs.replace(one, unlocalised_s=1e300) for one in seen.entities)
    state.ingest([received(t.ESTIMATE, msgspec.structs.replace(seen, entities=nowhere))])
    board.begin()
    state.put(board, NS_PER_S)
    sent = json.loads(board.since(-1))["estimate"]["entities"][0]
    assert (sent["age_s"], sent["unplaced_s"]) == (1e6, 1e6)


def test_history_keeps_trails_and_samples_within_bounds() -> None:
    history, new = History(("turtlebot",)), 0
    for k in range(20 * 200):
        history.step(NS_PER_S + k * 50_000_000, estimate(NS_PER_S + k * 50_000_000), None, 1.0, {})
        new += len(history.take_new()[1])
    kept = history.as_json()
    assert len(kept["trails"]["drone_1"]) == 300 and kept["trails"]["drone_1"][-1] == (1.0, 2.0)
    assert len(kept["samples"]) == 240
    assert new == pytest.approx(400, abs=2)
    assert kept["samples"][-1]["axis_m"] == pytest.approx(0.1 * math.sqrt(5.991), abs=1e-3)


@pytest.mark.parametrize("degrees", [5, 20, 200])
def test_chi_square_bounds(degrees: int) -> None:
    from scipy.stats import chi2

    low, high = chi_square_bounds(degrees)
    assert low == pytest.approx(chi2.ppf(0.025, degrees), rel=0.05)
    assert high == pytest.approx(chi2.ppf(0.975, degrees), rel=0.01)


def test_health_counts_what_entered_and_names_what_did_not() -> None:
    health = InnovationStatistics()
    assert health.summary()["nis"] is None
    for k in range(40):
        late = k % 4 == 0
        health.take(
            m.Innovation(
                header=header("drone_1"),
                observer="drone_1",
                subject="turtlebot",
                verdict=m.Verdict.LATE if late else m.Verdict.ACCEPTED,
                residual=() if late else (0.1, 0.1, 0.1),
                nis=None if late else 3.0,
                reason="by 0.7 s" if late else "",
            )
        )
    said = health.summary()
    assert said["nis"] == 1.0 and said["low"] < 1.0 < said["high"]
    assert said["accepted"] == 0.75
    assert said["edges"][0]["refused"] == "LATE by 0.7 s"


def test_footprints_are_true_to_scale(field: ResolvedField) -> None:
    scene = scene_from_field(field, truth=True)
    lens = lenses_of(field)["ceiling"]
    rays = np.array(scene["cameras"][0]["rays"])
    # The middle of the left edge: undo the projection by projecting it again.
    left = rays[np.abs(rays[:, 1]) < 1e-3][:, 0].min()
    pixel = lens.project(np.array([left, 0.0, 1.0]))
    assert pixel[0] == pytest.approx(-0.5, abs=0.1)
    onboard = np.array(scene["drones"][0]["camera"]["rays"])
    assert onboard[:, 0].min() > 0  # tilted 45 degrees down with less than 90 of view: all of it lies ahead
    assert onboard[:, 2].max() < 0
    assert json.loads(json.dumps(scene))["targets"][0]["name"] == "turtlebot"


@pytest.mark.parametrize(("name", "is_truth"), [("mocap-lab", False), ("mocap-truth", True)])
def test_the_volume_of_motion_capture_is_in_the_scene(name: str, is_truth: bool) -> None:
    (volume,) = scene_from_field(resolved_field(load_field(find_field(name))), truth=False)["volumes"]
    assert volume["name"] == "mocap" and volume["truth"] is is_truth
    assert volume["x_m"][0] < -3 and volume["y_m"][1] > 2 and volume["z_m"][1] > 2


def test_a_scene_without_a_field() -> None:
    assert bare_scene("lab", ("a",), False)["drones"][0]["name"] == "a"
