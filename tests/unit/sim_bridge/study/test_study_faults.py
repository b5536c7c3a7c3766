"""The fault campaign: random draws, judgement by truth, stand-ins for threads and sockets, and its table."""

import math
from itertools import pairwise
from types import SimpleNamespace
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
from sim_bridge.study.faults.observed import ObservedValues
from sim_bridge.study.faults.stand_ins import in_memory, manual_clock, read_all
from sim_bridge.study.faults.wrong_cameras import WrongEye
from sim_bridge.world.readings import Readings

FENCE = {"x_m": (-3.7, 3.7), "y_m": (-2.7, 2.7), "z_m": (0.0, 2.8)}
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
    judge = Judge(FENCE, {"a": 0.6, "b": 0.6}, PERIOD_S, root)
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


# -- time at which a fault shows ------------------------------------------------------------------------------------


def test_a_stuck_velocity_shows_once_the_drone_moves() -> None:
    stuck, frozen = fault("velocity_stuck"), fault("telemetry_frozen", start_s=30.0)
    values = ObservedValues((stuck, frozen))
    for n in range(400):
        t = n * PERIOD_S
        honest = Readings(n, (0.3 if t > 12 else 0.0, 0.0, 0.0), 0, 0, 0, (0, 0, 0), (0, 0, 9.8), 1.0)
        values.report(t, honest)
    assert values.observable_s(stuck) == pytest.approx(12.05)
    assert values.observable_s(frozen) == 30.0
    assert ObservedValues((stuck,)).observable_s(stuck) is None


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


class Eye:
    """Gives one observation after the other."""

    name, period_s = "a", 0.1

    def __init__(self) -> None:
        self.bumps: list[float] = []
        self.n = 0

    def bump(self, angle_deg: float, axis_deg: float) -> None:
        self.bumps.append(angle_deg)

    def look(self, world: Any, stamp_ns: int, clock: str) -> list[Any]:
        from groundstation.bus.messages import Header, RelativeObservation

        self.n += 1
        header = Header(stamp_ns, clock, "a", "a_camera", self.n)
        return [
            RelativeObservation(
                header=header, observer="a", subject="b", camera="a_camera", position_m=(float(self.n), 0.0, 1.0),
                yaw_rad=0.0, covariance=(1.0, *(0.0,) * 4, 1.0, *(0.0,) * 4, 1.0, *(0.0,) * 4, 1.0), margin=2.0,
                roll_rad=0.0, pitch_rad=0.0,
            )
        ]  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "seen"), [("picture_frozen", [1, 1, 1, 4]), ("picture_black", [1, 4]), ("camera_stall", [1, 4])]
)
def test_wrong_pictures_at_message_level(kind: str, seen: list[float]) -> None:
    eye: Any = Eye()
    camera = WrongEye(eye, [fault(kind, start_s=1.0, end_s=3.0)])
    found = []
    for t in (0.5, 1.0, 2.0, 3.0):
        world: Any = SimpleNamespace(time_s=t, drones=())
        eye.n = round(t)  # content of an honest picture
        found += camera.look(world, int(t * 1e9), "c")
    assert [one.position_m[0] for one in found] == seen
    assert len({(one.header.stamp_ns, one.header.seq) for one in found}) == len(found)


def test_a_vehicles_camera_that_hangs_trembles_until_its_driver_knows_it() -> None:
    eye: Any = Eye()
    camera, found = WrongEye(eye, [fault("picture_frozen", start_s=1.0)]), []
    for k in range(40):
        world: Any = SimpleNamespace(time_s=0.5 + 0.1 * k, drones={camera.name: None})
        found += camera.look(world, int(k * 1e8), "c")
    unknown, known = found[5:20], found[20:]
    assert all(a.position_m != b.position_m for a, b in pairwise(unknown))
    assert {one.picture_ns for one in unknown} == {0} and {one.picture_ns for one in known} == {400_000_000}


def test_a_frozen_picture_shows_once_it_repeats_somebody() -> None:
    frozen, black = fault("picture_frozen", start_s=1.0), fault("picture_black", start_s=1.0)
    eye: Any = Eye()
    camera = WrongEye(eye, [frozen])
    assert camera.observable_s(frozen) is None
    for t in (0.5, 1.5, 2.0):
        world: Any = SimpleNamespace(time_s=t, drones=())
        camera.look(world, 0, "c")
    assert (camera.observable_s(frozen), camera.observable_s(black)) == (1.5, 1.0)


def test_a_bumped_camera_stays_turned_until_it_is_put_back() -> None:
    eye: Any = Eye()
    camera = WrongEye(eye, [fault("camera_bumped", start_s=1.0, end_s=2.0, value=4.0)])
    for t in (0.0, 1.0, 2.0):
        world: Any = SimpleNamespace(time_s=t, drones=())
        camera.look(world, 0, "c")
    assert eye.bumps == [0.0, 4.0, 0.0]
