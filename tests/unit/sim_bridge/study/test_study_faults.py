"""The fault campaign: random draws, judgement by truth, stand-ins for threads and sockets, and its table."""

import math
from typing import Any

import numpy as np
import pytest

from groundstation.bus import clock
from groundstation.bus.messages import FlightState, VehicleStatus
from groundstation.bus.topics import ODOMETRY, VEHICLE_STATUS
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.scenario import Scenario
from sim_bridge.study.faults.draw import KINDS, draw
from sim_bridge.study.faults.judge import Judge
from sim_bridge.study.faults.local_bus import LocalBus, LocalExchange
from sim_bridge.study.faults.memory_network import MemoryNetwork, NothingWaits
from sim_bridge.study.faults.stand_ins import in_memory, manual_clock, read_all

FENCE = {"x_m": (-3.7, 3.7), "y_m": (-2.7, 2.7), "z_m": (0.0, 2.8)}
PILLAR = {"centre_m": (-2.0, 1.5), "size_m": (0.4, 0.4, 2.0)}
FIELD: dict[str, Any] = {
    "room": {"fence": FENCE},
    "cameras": {"ceiling": {}},
    "drones": {"drone_1": {"kind": "ardrone"}, "px4_1": {"kind": "mavlink"}},
}
PERIOD_S = 0.05


def fault(kind: str, **more: Any) -> Fault:
    given: dict[str, Any] = {"entity": "a", "start_s": 10.0} | more
    return Fault(kind=FaultKind(kind), **given)


# -- random draws ---------------------------------------------------------------------------------------------------


def test_a_seed_is_one_flight_and_seeds_differ() -> None:
    drawn = [draw(FIELD, Scenario(), seed, (11.0, 20.0)) for seed in (1, 1, 2)]
    assert drawn[0] == drawn[1]
    assert drawn[0].field["drones"] != drawn[2].field["drones"]


def test_all_kinds_come_one_or_two_at_once_within_the_window_and_some_flights_are_healthy() -> None:
    flights = [draw(FIELD, Scenario(), seed, (11.0, 20.0)).scenario.faults for seed in range(400)]
    assert {fault.kind for faults in flights for fault in faults} == set(KINDS)
    assert {len(faults) for faults in flights} == {0, 1, 2}
    assert all(11.0 <= fault.start_s <= 20.0 for faults in flights for fault in faults)
    blind = {(f.entity, f.value) for faults in flights for f in faults if f.kind is FaultKind.UNIFORM_FLOOR}
    assert blind == {("drone_1", value) for value in (0.0, 1.0, 2.0)}, "only AR.Drones, each kind of report"


def test_pads_are_apart() -> None:
    for seed in range(100):
        pads = [d["pad_m"] for d in draw(FIELD, Scenario(), seed, (11.0, 20.0)).field["drones"].values()]
        assert math.dist(*pads) >= 1.1


# -- judgement by truth ---------------------------------------------------------------------------------------------


def row(x: float, y: float, vx: float = 0.0, ground: bool = False) -> Any:
    return np.array([x, y, 1.2, vx, 0.0, 0.0, 0, 0, 0, 0, 0, 0, float(ground)])


def judged(
    rows: Any,
    told: Any = lambda t: True,
    off_m: float = 0.0,
    faults: tuple[Fault, ...] = (),
    root: str | None = None,
    deaf: Any = lambda t: (),
) -> dict[str, Any]:
    """Return the verdict on 15 s in which drone a flies rows(t) and drone b stands still 3 m away."""
    judge = Judge({"fence": FENCE, "obstacles": {"pillar": PILLAR}}, {"a": 0.6, "b": 0.6}, PERIOD_S, root)
    for n in range(300):
        t = 5.0 + n * PERIOD_S
        truth = {"a": rows(t), "b": row(0.0, -2.0)}
        believed = {name: truth[name][:2] + np.array([off_m, 0.0]) for name in truth}
        judge.see(t, truth, {"a": told(t), "b": False}, believed, deaf(t))
    return judge.verdict(faults, tuple(fault.start_s for fault in faults))


@pytest.mark.parametrize(
    ("rows", "broken"),
    [
        (lambda t: row(0.0, 0.0), {}),
        (lambda t: row(0.0, -1.5), {"separation": 5.0}),
        (lambda t: row(3.8 if t > 9.99 else 3.0, 0.0), {"fence": 10.0}),
        (lambda t: row(-2.0, 1.05 if t > 9.99 else 0.9), {"obstacle": 10.0}),
        (lambda t: row(-2.0, 1.5, ground=True), {}),
        (lambda t: row(0.0, 0.0, vx=0.95), {"speed": 5.0}),
        (lambda t: row(0.0, 0.0, vx=0.85), {}),
        (lambda t: row(0.0, -1.5, ground=True), {}),
    ],
)
def test_separation_fence_and_speed(rows: Any, broken: dict[str, float]) -> None:
    assert judged(rows)["unsafe"] == pytest.approx(broken)


def test_to_fly_on_a_wrong_belief_is_unsafe_and_to_hover_is_not() -> None:
    assert set(judged(lambda t: row(0.0, 0.0), off_m=0.6)["unsafe"]) == {"unlocalised"}
    assert judged(lambda t: row(0.0, 0.0), told=lambda t: False, off_m=0.6)["unsafe"] == {}
    assert judged(lambda t: row(0.0, 0.0), off_m=0.4)["unsafe"] == {}


def flown(stops_s: float, rests_s: float) -> Any:
    """A drone that moves at 0.3 m/s until it rests, with setpoints to move until it stops."""
    return {
        "rows": lambda t: row(-1.0 + 0.3 * (min(t, rests_s) - 5.0), 0.0, 0.3 * (t < rests_s)),
        "told": lambda t: t < stops_s,
    }


@pytest.mark.parametrize(
    ("stops_s", "rests_s", "broken"),
    [(10.5, 13.0, set()), (11.5, 13.0, {"hover"}), (10.5, 14.5, {"rest"}), (99.0, 99.0, {"hover", "rest"})],
)
def test_after_useless_words_hover_and_rest_are_due(stops_s: float, rests_s: float, broken: set[str]) -> None:
    verdict = judged(**flown(stops_s, rests_s), faults=(fault("telemetry_frozen"),))
    assert set(verdict["unsafe"]) == broken
    assert verdict["hover_s"] == pytest.approx(min(stops_s, 19.95) - 10.0, abs=0.11)


def test_a_fault_before_the_first_sample_is_judged_from_there() -> None:
    before = fault("telemetry_frozen", start_s=0.0)
    verdict = judged(lambda t: row(0.0, 0.0), told=lambda t: False, faults=(before,))
    assert (verdict["hover_s"], verdict["rest_s"], verdict["unsafe"]) == (0.0, 0.0, {})
    assert judged(**flown(5.5, 7.0), faults=(before.model_copy(update={"end_s": 6.0}),))["unsafe"] == {}


DEAF = fault("at_deaf", end_s=14.0)


@pytest.mark.parametrize(
    ("rows", "faults", "unsafe", "unreached"),
    [
        (lambda t: row(0.0, 0.0, vx=1.0 if 11.0 <= t < 14.0 else 0.5), (DEAF,), ["speed"], ["speed"]),
        (lambda t: row(0.0, 0.0, vx=1.0 if t > 14.02 else 0.5), (DEAF,), ["speed"], []),
        (lambda t: row(0.0, 0.0, vx=1.0 if t > 9.0 else 0.5), (DEAF,), ["speed"], []),
        (lambda t: row(0.0, 0.0, vx=1.0 if t > 11.0 else 0.5), (DEAF, fault("wind", entity="b")), ["speed"], []),
        (lambda t: row(3.8 if t > 11.0 else 3.5, 0.0), (DEAF, fault("wind", start_s=12.0)), ["fence"], ["fence"]),
        (lambda t: row(0.0, -1.5 if t > 11.0 else 0.0), (DEAF,), ["separation"], []),
    ],
    ids=["too fast", "hears again", "was too fast", "something else is wrong", "out", "the other one hears"],
)
def test_violations_that_nobody_could_stop_are_unsafe_and_named(
    rows: Any, faults: tuple[Fault, ...], unsafe: list[str], unreached: list[str]
) -> None:
    verdict = judged(rows, faults=faults, deaf=lambda t: ["a"] * (10.0 <= t < 14.0))
    assert sorted(verdict["unsafe"]) == unsafe
    assert verdict["unreached"] == unreached


def test_two_that_come_together_are_out_of_reach_where_both_hear_nothing() -> None:
    both = (DEAF, fault("at_deaf", entity="b"))
    verdict = judged(lambda t: row(0.0, -1.5 if t > 11.0 else 0.0), faults=both, deaf=lambda t: ["a", "b"] * (t >= 10))
    assert verdict["unreached"] == ["separation"]


def test_how_far_a_deaf_drone_flies_on_is_measured_from_where_it_became_deaf() -> None:
    def rows(t: float) -> Any:
        moving = row(0.3 * (min(t, 13.0) - 5.0), 0.0, 0.3 + 0.5 * (11.0 < t < 12.0), ground=t > 18.0)
        moving[7] = math.radians(4.0)
        return moving

    (spell,) = judged(rows, deaf=lambda t: ["a"] * (t >= 10.0))["deaf"]
    assert (spell["drone"], spell["from_s"]) == ("a", pytest.approx(10.0))
    assert (spell["speed_m_s"], spell["tilt_deg"], spell["fastest_m_s"]) == pytest.approx((0.3, 4.0, 0.8))
    assert spell["flown_m"] == pytest.approx(0.9, abs=0.02)


@pytest.mark.parametrize(("root", "broken"), [("ceiling", {"hover", "rest"}), ("other", set()), (None, set())])
def test_nobody_flies_on_where_the_picture_of_the_only_fixed_camera_freezes(root: str | None, broken: set[str]) -> None:
    frozen = fault("picture_frozen", entity="ceiling")
    assert set(judged(**flown(99.0, 99.0), faults=(frozen,), root=root)["unsafe"]) == broken


def test_nothing_is_due_after_a_fault_that_need_not_stop_or_healed_at_once() -> None:
    for harmless in (fault("camera_bumped", entity="ceiling"), fault("wind"), fault("velocity_stuck", end_s=11.0)):
        assert judged(**flown(99.0, 99.0), faults=(harmless,))["unsafe"] == {}


# -- stand-ins ------------------------------------------------------------------------------------------------------


def test_datagrams_stay_in_the_process_and_a_reader_ends_where_it_would_wait() -> None:
    import socket
    import threading

    network = MemoryNetwork()
    real: tuple[type, type] = (socket.socket, threading.Thread)
    heard: list[bytes] = []
    with in_memory(network) as readers:
        server, client = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), socket.socket()
        server.bind(("127.0.0.2", 5554))
        server.settimeout(0.1)

        def read() -> None:
            while True:
                heard.append(server.recvfrom(100)[0])

        threading.Thread(target=read, name="reader", daemon=True).start()
    assert (socket.socket, threading.Thread) == real
    for word in (b"one", b"two"):
        client.sendto(word, ("127.0.0.2", 5554))
    client.sendto(b"lost", ("127.0.0.3", 5554))
    read_all(readers)
    assert heard == [b"one", b"two"]
    with pytest.raises(OSError, match="in use"):
        client.bind(("127.0.0.2", 5554))
    server.close()
    client.setblocking(False)
    with pytest.raises(BlockingIOError):
        client.recvfrom(100)
    client.settimeout(1.0)
    with pytest.raises(NothingWaits):
        client.recvfrom(100)


def test_everybody_reads_the_manual_clock_while_it_runs() -> None:
    with manual_clock(lambda: 42):
        assert clock.now_ns() == 42
    assert clock.now_ns() > 42


def test_the_local_bus_hands_messages_over_as_they_are() -> None:
    exchange = LocalExchange()
    driver, tracker = (LocalBus(exchange, "lab", name) for name in ("drone_1", "tracker"))
    everything, one = tracker.subscribe([VEHICLE_STATUS, ODOMETRY]), tracker.subscribe([VEHICLE_STATUS], "drone_2")
    newest = tracker.subscribe([VEHICLE_STATUS], newest=True)
    said = [VehicleStatus(header=driver.header("drone_1"), flight_state=FlightState.LANDED, mode=mode) for mode in "ab"]
    for message in said:
        driver.publish(VEHICLE_STATUS, message)
    assert [received.message for received in everything.drain()] == said
    assert everything.waiting is False
    assert one.drain() == []
    assert [received.message for received in newest.drain()] == said[1:]
