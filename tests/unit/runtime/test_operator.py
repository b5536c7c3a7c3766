"""The operator over a bus in memory: lease, take-off one by one, stops from elsewhere, requests of other shells."""

from collections.abc import Iterator

import pytest

from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import (
    AckStage,
    Command,
    CommandAck,
    FlightState,
    Lease,
    Odometry,
    RelativeObservation,
    VehicleStatus,
    Verb,
)
from groundstation.bus.topics import COMMAND, COMMAND_ACK, LEASE, OBSERVATION, ODOMETRY, VEHICLE_STATUS
from groundstation.runtime.marker_height import FixedCamera
from groundstation.runtime.operator import Operator
from groundstation.runtime.take_off import TakeOffLimits
from groundstation.runtime.team import TeamPhase

MS = 1_000_000
LIMITS = TakeOffLimits(connect_s=5, lift_off_s=15, unseen_s=10)
CEILING_M, MARKER_M, FLIGHT_M = 4.2, 0.1, 0.8
CAMERAS = {"ceiling": FixedCamera(CEILING_M, (0.0, 0.0, -1.0))}


class Drone:
    """A driver with its drone: takes off in half a second, answers every order.

    marker: whose marker the drone carries; reports: whether it measures its height.
    """

    def __init__(
        self,
        exchange: MemoryExchange,
        name: str,
        seen: bool = True,
        refusal: str = "",
        marker: str = "",
        reports: bool = True,
    ) -> None:
        self.bus = MemoryBus(exchange, "lab", name)
        self.camera = MemoryBus(exchange, "lab", "ceiling")
        self.name, self.seen, self.refusal = name, seen, refusal
        self.marker, self.reports = marker or name, reports
        self.state = FlightState.LANDED
        self.commands = self.bus.subscribe([COMMAND])
        self.heard: list[Verb] = []
        self.change: tuple[int, FlightState, Command] | None = None
        self.last: dict[str, AckStage] = {}
        self.lost: AckStage | None = None  # of this stage the first answer does not arrive

    def turn(self, now_ns: int) -> None:
        for received in self.commands.drain():
            command = received.message
            assert isinstance(command, Command)
            if not command.scope or self.name in command.scope:
                self.obey(command, now_ns)
        if self.change and now_ns >= self.change[0]:
            self.state = self.change[1]
            self.answer(self.change[2], AckStage.EFFECTIVE)
            self.change = None
        header = self.bus.header(self.name)
        self.bus.publish(VEHICLE_STATUS, VehicleStatus(header=header, flight_state=self.state, mode="HOVER"))
        height_m = 0.0 if self.state is FlightState.LANDED else FLIGHT_M
        self.measure(height_m if self.reports and height_m else None)
        if self.seen:
            self.observe(height_m)

    def obey(self, command: Command, now_ns: int) -> None:
        if command.id in self.last:
            self.answer(command, self.last[command.id])
            return
        self.heard.append(command.verb)
        self.answer(command, AckStage.RECEIVED)
        if self.refusal and command.verb is Verb.TAKEOFF:
            self.answer(command, AckStage.REFUSED, self.refusal)
            return
        self.answer(command, AckStage.ACCEPTED)
        after = {Verb.TAKEOFF: FlightState.HOVERING, Verb.LAND: FlightState.LANDED}.get(command.verb, self.state)
        self.change = (now_ns + 500 * MS, after, command)

    def answer(self, command: Command, stage: AckStage, reason: str = "") -> None:
        self.last[command.id] = stage
        if stage is self.lost:
            self.lost = None
            return
        header = self.bus.header(self.name)
        ack = CommandAck(header=header, command_id=command.id, verb=command.verb, stage=stage, reason=reason)
        self.bus.publish(COMMAND_ACK, ack)

    def measure(self, height_m: float | None) -> None:
        odometry = Odometry(
            header=self.bus.header(self.name),
            velocity_m_s=(0.0, 0.0, 0.0),
            velocity_covariance=(1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0),
            yaw_rad=0.0,
            roll_rad=0.0,
            pitch_rad=0.0,
            height_m=height_m,
        )
        self.bus.publish(ODOMETRY, odometry)

    def observe(self, height_m: float) -> None:
        observation = RelativeObservation(
            header=self.camera.header("ceiling"),
            observer="ceiling",
            subject=self.marker,
            camera="ceiling",
            position_m=(0.0, 0.0, CEILING_M - MARKER_M - height_m),
            yaw_rad=None,
            covariance=(1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0),
        )
        self.camera.publish(OBSERVATION, observation)


class Scene:
    def __init__(self) -> None:
        self.exchange = MemoryExchange()
        self.said: list[str] = []
        self.bus = MemoryBus(self.exchange, "lab", "supervisor")
        self.operator = Operator(self.bus, ("drone_1", "drone_2"), CAMERAS, LIMITS, self.said.append)
        self.drones: dict[str, Drone] = {}
        self.now_ns = clock.now_ns() // 10**9 * 10**9

    def add(self, name: str, **options: object) -> Drone:
        self.drones[name] = Drone(self.exchange, name, **options)  # type: ignore[arg-type]
        return self.drones[name]

    def run(self, seconds: float) -> Iterator[float]:
        for _ in range(round(seconds * 20)):
            self.now_ns += 50 * MS
            for drone in self.drones.values():
                drone.turn(self.now_ns)
            self.operator.step(self.now_ns)
            yield self.now_ns / 1e9

    def pass_(self, seconds: float) -> None:
        for _ in self.run(seconds):
            pass


@pytest.fixture
def scene() -> Scene:
    return Scene()


def test_lease_is_renewed_twice_a_second(scene: Scene) -> None:
    leases = scene.bus.subscribe([LEASE])
    scene.pass_(2.0)
    heard = [r.message for r in leases.drain()]
    assert 4 <= len(heard) <= 5
    assert all(isinstance(lease, Lease) and lease.holder == "operator" for lease in heard)


def test_one_by_one_then_track(scene: Scene) -> None:
    one, two = scene.add("drone_1"), scene.add("drone_2")
    scene.pass_(0.2)
    scene.operator.take_off(scene.now_ns)
    for _ in scene.run(5.0):
        if Verb.TAKEOFF in two.heard:
            assert one.state is FlightState.HOVERING
    assert one.heard == two.heard == [Verb.TAKEOFF, Verb.TRACK]
    assert scene.operator.phase is TeamPhase.TRACKING and scene.operator.tracking_since_ns
    assert scene.operator.mistake is None
    assert "drone_1: TAKEOFF sent / received / accepted / effective" in scene.said


@pytest.mark.parametrize("reports", [True, False])
def test_exchanged_drones_stop_the_take_off_and_the_one_that_flies_lands(scene: Scene, reports: bool) -> None:
    one = scene.add("drone_1", marker="drone_2", reports=reports)
    two = scene.add("drone_2", marker="drone_1", reports=reports)
    scene.pass_(0.5)
    scene.operator.take_off(scene.now_ns)
    scene.pass_(10.0)
    assert (one.heard, two.heard) == ([Verb.TAKEOFF, Verb.LAND], [])
    assert one.state is FlightState.LANDED and scene.operator.phase is TeamPhase.GROUND
    says = "drone_1 reports 0.8 m" if reports else "drone_1 says that it flies"
    mistake = (
        f"{says} but its marker is on the floor and drone_2's marker rose: the addresses or markers of the two are "
        "probably exchanged; check address, system id and marker code of drone_1 and drone_2 in the field file "
    )
    assert sum(line.startswith(f"TAKE-OFF STOPPED: {mistake}") for line in scene.said) == 1
    assert str(scene.operator.mistake).startswith(mistake)
    assert "drone_2: left out, the take-off was stopped" in scene.said
    assert not any("localised" in line for line in scene.said)


def test_a_mix_up_among_the_others_lets_who_was_seen_hover_without_tracking(scene: Scene) -> None:
    one = scene.add("drone_1")
    two = scene.add("drone_2", marker="stranger")
    scene.add("its_marker_on_the_floor", marker="drone_2")
    scene.pass_(0.5)
    scene.operator.take_off(scene.now_ns)
    scene.pass_(12.0)
    assert (one.heard, two.heard) == ([Verb.TAKEOFF], [Verb.TAKEOFF, Verb.LAND])
    assert scene.operator.phase is TeamPhase.UP
    assert any("drone_2 reports 0.8 m but its marker is on the floor and no other rose" in s for s in scene.said)


def test_missing_drone_is_named_and_the_rest_flies_on(scene: Scene) -> None:
    two = scene.add("drone_2")
    scene.operator.take_off(scene.now_ns)
    scene.pass_(4.5)
    assert two.heard == []
    scene.pass_(5.0)
    assert two.heard == [Verb.TAKEOFF, Verb.TRACK]
    assert any(line.startswith("drone_1: left out") for line in scene.said)


def test_unseen_drone_lands(scene: Scene) -> None:
    one = scene.add("drone_1", seen=False)
    two = scene.add("drone_2")
    scene.operator.take_off(scene.now_ns)
    scene.pass_(16.0)
    assert one.heard == [Verb.TAKEOFF, Verb.LAND] and one.state is FlightState.LANDED
    assert two.heard == [Verb.TAKEOFF, Verb.TRACK]


def test_refusal_is_retried_then_reported_with_its_reason(scene: Scene) -> None:
    one, two = scene.add("drone_1", refusal="battery"), scene.add("drone_2")
    scene.operator.take_off(scene.now_ns)
    scene.pass_(9.0)
    assert one.heard.count(Verb.TAKEOFF) > 2
    assert "drone_1: left out, refused: battery" in scene.said
    assert two.state is FlightState.HOVERING


@pytest.mark.parametrize("verb", [Verb.LAND, Verb.HOLD, Verb.CUT_MOTORS])
def test_a_stop_by_anyone_ends_the_take_off(scene: Scene, verb: Verb) -> None:
    scene.add("drone_1", seen=False)
    two = scene.add("drone_2")
    scene.operator.take_off(scene.now_ns)
    scene.pass_(2.0)
    other = MemoryBus(scene.exchange, "lab", "cli_1")
    other.publish(COMMAND, Command(header=other.header("team"), id="x", verb=verb, scope=(), issuer="cli_1"))
    scene.pass_(20.0)
    assert two.heard == [verb]


def test_a_stop_of_one_drone_leaves_the_others_to_go_on(scene: Scene) -> None:
    one, two = scene.add("drone_1", seen=False), scene.add("drone_2")
    scene.operator.take_off(scene.now_ns)
    scene.pass_(2.0)
    tracker = MemoryBus(scene.exchange, "lab", "tracker")
    command = Command(header=tracker.header("team"), id="x", verb=Verb.LAND, scope=("drone_1",), issuer="tracker")
    tracker.publish(COMMAND, command)
    scene.pass_(4.0)
    assert one.heard == [Verb.TAKEOFF, Verb.LAND]
    assert two.heard == [Verb.TAKEOFF, Verb.TRACK]


def test_unheard_order_is_repeated_with_the_same_id(scene: Scene) -> None:
    scene.add("drone_1")
    scene.pass_(0.2)
    del scene.drones["drone_1"]
    spy = scene.bus.subscribe([COMMAND])
    scene.operator.land(scene.now_ns)
    scene.pass_(1.0)
    commands = [r.message for r in spy.drain()]
    assert len(commands) >= 3
    assert len({command.id for command in commands if isinstance(command, Command)}) == 1
    scene.pass_(25.0)
    assert "drone_1: LAND sent / NOT CONFIRMED" in scene.said


@pytest.mark.parametrize("stage", [AckStage.RECEIVED, AckStage.ACCEPTED, AckStage.EFFECTIVE])
def test_an_answer_lost_on_the_bus_is_asked_for_again(scene: Scene, stage: AckStage) -> None:
    drone = scene.add("drone_1")
    scene.pass_(0.2)
    drone.lost = stage
    scene.operator.land(scene.now_ns)
    scene.pass_(3.0)
    assert drone.heard == [Verb.LAND]
    assert "drone_1: LAND sent / received / accepted / effective" in scene.said


def test_another_shell_may_ask_for_take_off(scene: Scene) -> None:
    scene.add("drone_1")
    scene.add("drone_2")
    other = MemoryBus(scene.exchange, "lab", "cli_1")
    acks = other.subscribe([COMMAND_ACK], entity="operator")
    request = Command(
        header=other.header("operator"), id="r1", verb=Verb.TAKEOFF, scope=("operator",), issuer="cli_1", expires_ns=0
    )
    scene.pass_(0.2)
    other.publish(COMMAND, request)
    scene.pass_(5.0)
    stages = [r.message.stage for r in acks.drain() if isinstance(r.message, CommandAck)]
    assert stages == [AckStage.RECEIVED, AckStage.ACCEPTED, AckStage.EFFECTIVE]
    phases = [scene.operator.phase]
    other.publish(COMMAND, Command(header=other.header("operator"), id="r2", verb=Verb.TRACK, scope=("operator",),
                                   issuer="cli_1", expires_ns=0))  # fmt: skip
    scene.pass_(2.0)
    stages = [r.message.stage for r in acks.drain() if isinstance(r.message, CommandAck)]
    assert stages == [AckStage.RECEIVED, AckStage.ACCEPTED, AckStage.EFFECTIVE]
    assert [*phases, scene.operator.phase] == [TeamPhase.UP, TeamPhase.TRACKING]


def test_landed_means_all_say_so(scene: Scene) -> None:
    scene.add("drone_1")
    two = scene.add("drone_2")
    scene.operator.take_off(scene.now_ns)
    scene.pass_(4.0)
    assert not scene.operator.landed(scene.now_ns)
    scene.operator.land(scene.now_ns)
    scene.pass_(1.5)
    assert scene.operator.landed(scene.now_ns)
    two.state = FlightState.LOST
    scene.pass_(0.2)
    assert not scene.operator.landed(scene.now_ns), "a lost drone is not known to stand"


def test_a_driver_that_starts_anew_and_hears_nothing_lands_no_drone(scene: Scene) -> None:
    flying = scene.add("drone_1")
    flying.state = FlightState.FLYING
    list(scene.run(0.1))
    flying.state = FlightState.UNKNOWN  # as its driver says that was started anew
    list(scene.run(0.5))
    assert not scene.operator.landed(scene.now_ns)
    assert scene.operator.team.airborne(scene.now_ns) == ("drone_1",)
    flying.state = FlightState.LANDED
    list(scene.run(0.1))
    assert scene.operator.landed(scene.now_ns)
    flying.state = FlightState.UNKNOWN
    list(scene.run(0.1))
    assert scene.operator.landed(scene.now_ns), "it stood when it was heard last"


@pytest.mark.parametrize("refusal", ["", "battery empty"])
def test_a_later_take_off_of_one_leaves_the_others_tracking_whatever_comes_of_it(scene: Scene, refusal: str) -> None:
    scene.add("drone_1")
    scene.pass_(0.2)
    scene.operator.take_off(scene.now_ns, ("drone_1",))
    scene.pass_(4.0)
    late = scene.add("drone_2", refusal=refusal)
    scene.pass_(0.2)
    other = MemoryBus(scene.exchange, "lab", "cli_1")
    header = other.header("operator")
    scope = ("operator", "drone_2")
    other.publish(COMMAND, Command(header=header, id="r1", verb=Verb.TAKEOFF, scope=scope, issuer="cli_1"))
    scene.pass_(8.0)
    assert late.state is (FlightState.LANDED if refusal else FlightState.HOVERING)
    assert scene.operator.phase is TeamPhase.TRACKING


def test_who_flies_already_is_none_of_a_later_take_off_of_all_seen_or_not(scene: Scene) -> None:
    flying = scene.add("drone_1")
    scene.pass_(0.2)
    scene.operator.take_off(scene.now_ns, ("drone_1",))
    scene.pass_(4.0)
    flying.seen = False  # below another one, or at the edge of the room
    late = scene.add("drone_2")
    scene.pass_(3.0)
    other = MemoryBus(scene.exchange, "lab", "cli_1")
    request = Command(header=other.header("operator"), id="r1", verb=Verb.TAKEOFF, scope=("operator",), issuer="cli_1")
    other.publish(COMMAND, request)
    scene.pass_(14.0)
    assert flying.heard == [Verb.TAKEOFF, Verb.TRACK] and flying.state is FlightState.HOVERING
    assert late.heard == [Verb.TAKEOFF] and late.state is FlightState.HOVERING
