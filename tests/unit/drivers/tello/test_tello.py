"""The Tello at the wire: text, signs and units, checked by flying its emulator; invalid states."""

import dataclasses
import json
import math
import random
import socket
import time
from contextlib import closing
from pkgutil import resolve_name

import pytest

from drivers.tello.driver import Heard, Tello, velocity_from_state
from drivers.tello.settings import TelloDriverSettings
from drivers.tello.wire.text import COMMAND_PORT, STATE_PORT, State, WireError, parse_state, rc
from drivers.watchdog_types import Action, DriverMode, WatchdogDecision
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import FlightState, Odometry
from groundstation.bus.topics import ODOMETRY
from groundstation.vehicles import kind_named
from sim_bridge.conformance.subject import subject_of
from sim_bridge.devices.tello import TelloBody, TelloEmulator
from sim_bridge.devices.tello_text import parse_rc, state_text
from sim_bridge.scenario import Scenario, parse_scenario
from sim_bridge.site import SiteDrone
from sim_bridge.world.noise import generator_of

STATE = State(-3, 2, -120, (5, -4, 1), 71, 50, 82, 14, (17.0, -4.0, -956.0))
ADDRESS = "127.64.77.11"
DRONE = SiteDrone.model_validate(
    {"kind": "tello", "pad_m": (0.0, 0.0), "pad_yaw_deg": 30.0, "marker": {"code": 1, "position_m": (0.0, 0.0, 0.08)}}
)


class Flight:
    """The driver's object between a bus and a vehicle that receives everything, without a loop."""

    def __init__(self) -> None:
        order = subject_of("tello").order()
        settings = TelloDriverSettings.model_validate_json(kind_named("tello").processes([order])[0].section)
        own = settings.tello.model_copy(update={"local_address": "127.64.78.1"})
        settings = settings.model_copy(update={"address": "127.64.78.11", "tello": own})
        self.heard = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.heard.bind((settings.address, COMMAND_PORT))
        self.heard.settimeout(1.0)
        exchange = MemoryExchange()
        self.tello = Tello(settings, MemoryBus(exchange, "lab", "tello"))
        self.odometry = MemoryBus(exchange, "lab", "tracker").subscribe([ODOMETRY])

    def told(
        self, action: Action, velocity=(0.0, 0.0, 0.0), turn=0.0, state=STATE, back=None
    ) -> tuple[bytes, FlightState]:
        """Return the messages to the vehicle for a decision, and the driver's flight state afterwards."""
        now_ns = time.monotonic_ns()
        self.tello._ready = True
        self.tello.heard = Heard(now_ns, now_ns, state, velocity_from_state(state))
        self.tello.apply(now_ns, WatchdogDecision(DriverMode.TRACK, action, velocity, turn, back_m_s=back))
        return self.heard.recv(64), self.tello.view(now_ns).flight_state

    def close(self) -> None:
        self.tello.close()
        self.heard.close()


@pytest.fixture
def flight():
    flight = Flight()
    yield flight
    flight.close()


def test_corrections_in_hover_are_commanded_as_velocities_in_flight(flight: Flight) -> None:
    flies, _ = flight.told(Action.FLY, (0.1, -0.15, 0.0))
    assert flight.told(Action.HOVER, back=(0.1, -0.15, 0.0))[0] == flies != flight.told(Action.HOVER)[0]


def test_one_absurd_velocity_is_not_published_and_the_next_ones_are_uncertain(flight: Flight) -> None:
    now_ns = time.monotonic_ns()
    for number in range(30):
        north = 990 if number == 20 else number % 3
        state = dataclasses.replace(
            STATE, velocity=(north, 0, 0), acceleration=(17.0, -4.0, -956.0 - number), time=number
        )
        flight.tello._hear_state(now_ns + number * 100_000_000, state_text(state))
    told = [one.message for one in flight.odometry.drain() if isinstance(one.message, Odometry)]
    assert len(told) == 29 and all(math.hypot(*one.velocity_m_s) < 1.0 for one in told)
    stds = [math.sqrt(one.velocity_covariance[0]) for one in told]
    assert max(stds[:20]) < 0.1 and stds[20:] == pytest.approx([0.5] * 9)


class Rig:
    """The emulator with a client, alone in its world and without a clock."""

    def __init__(self) -> None:
        scenario: Scenario = parse_scenario(json.dumps({"mavlink": {"air_unrest_m_s2": 0.0}}))
        self.body = TelloBody(DRONE, scenario, 0.005, generator_of(1, "tello"))
        self.vehicle = TelloEmulator("tello", ADDRESS, self.body)
        self.partner = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.partner.bind(("127.64.77.1", 0))
        self.states = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.states.bind(("127.64.77.1", STATE_PORT))
        for udp in (self.partner, self.states):
            udp.settimeout(1.0)

    def say(self, words: bytes, seconds: float = 0.0) -> None:
        self.partner.sendto(words, (ADDRESS, COMMAND_PORT))
        time.sleep(0.001)
        self.vehicle.receive()
        self.turn(seconds)

    def turn(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.005)):
            self.body.step((0.0, 0.0, 0.0))
            self.body.sense()
            self.vehicle.send()

    def state(self) -> State:
        self.states.setblocking(False)
        last = b""
        while True:
            try:
                last = self.states.recv(2048)
            except BlockingIOError:
                return parse_state(last)

    def close(self) -> None:
        self.vehicle.close()
        self.partner.close()
        self.states.close()


@pytest.fixture
def rig():
    rig = Rig()
    yield rig
    rig.close()


def test_a_state_survives_its_text():
    assert parse_state(state_text(STATE)) == STATE


def test_spaces_and_an_end_mark_around_keys_and_values_are_no_damage():
    """As real ones send it: spaces before values and keys, none or several marks at the end."""
    said = state_text(STATE).decode().strip()
    for other in (said.rstrip(";"), said + "  ", said + "\r\n\0", said.replace(";", "; "), said.replace(":", ": ")):
        assert parse_state(other.encode()) == STATE


def test_sticks_survive_their_text_and_are_cut():
    assert parse_rc(rc(-100, 7, 0, 100)) == (-100, 7, 0, 100)
    assert rc(-250, 0, 101, 3) == b"rc -100 0 100 3"
    assert parse_rc(b"rc 1 2 3") is None and parse_rc(b"rc a 0 0 0") is None and parse_rc(b"rc 0 0 0 101") is None


def test_mutated_states_are_refused_or_sane():
    draw, refused = random.Random(4), 0
    for _ in range(3000):
        data = bytearray(state_text(STATE))
        for _ in range(draw.randint(1, 6)):
            data[draw.randrange(len(data))] = draw.randrange(256)
        try:
            state = parse_state(bytes(data))
        except WireError:
            refused += 1
            continue
        assert abs(state.yaw) <= 180 and 0 <= state.battery <= 100 and all(map(math.isfinite, state.acceleration))
    assert 500 < refused < 3000


@pytest.mark.parametrize(
    ("velocity", "turn", "words"),
    [((0.3, 0.0, 0.0), 0.0, b"rc 0 30 0 0"), ((3.0, 4.0, 0.0), 0.0, b"rc -48 36 0 0"),
     ((0.0, 0.0, -2.0), 0.0, b"rc 0 0 -40 0"), ((0.0, 0.0, 0.0), 9.0, b"rc 0 0 0 -60")],
)  # fmt: skip
def test_sticks_keep_the_limits_of_the_field_and_the_direction(flight, velocity, turn, words):
    assert flight.told(Action.FLY, velocity, turn)[0] == words


def test_it_says_when_it_hovers(flight):
    still = dataclasses.replace(STATE, velocity=(0, 1, 0))
    assert flight.told(Action.HOVER, state=still) == (b"rc 0 0 0 0", FlightState.HOVERING)
    assert flight.told(Action.HOVER, state=dataclasses.replace(STATE, velocity=(6, 0, 0)))[1] is FlightState.FLYING
    assert flight.told(Action.FLY, state=still)[1] is FlightState.FLYING
    assert flight.told(Action.LAND, state=still) == (b"rc 0 0 0 0", FlightState.LANDING)
    assert flight.heard.recv(64) == b"land", "its last sticks would be kept while it lands"
    assert flight.told(Action.CUT, state=still)[0] == b"emergency"
    assert flight.heard.recv(64) == b"rc 0 0 0 0", "one that does not obey must not fly on at its last velocity"


@pytest.mark.parametrize(("tof", "height"), [(70, 30), (70, 40), (45, 10), (6553, 30), (6553, 60)])
def test_a_take_off_succeeds_though_its_height_word_is_coarse_and_low(flight, tof, height):
    """Real ones report `h` in steps of 10 cm, up to 35 cm below `tof`."""
    low = dataclasses.replace(STATE, tof=tof, height=height)
    assert flight.told(Action.TAKE_OFF, state=low)[1] is FlightState.FLYING


def test_a_take_off_whose_height_word_stays_low_ends_when_the_climb_does(flight):
    """Without an echo 20 cm may be 55: it is level for 2 s, and is not landed because of the word."""
    low, said = dataclasses.replace(STATE, tof=6553, height=20, velocity=(0, 0, 1)), []
    flight.told(Action.TAKE_OFF, state=low)
    flight.tello.heard = Heard()
    for number in range(25):
        flight.tello.heard = flight.tello.heard.next(1 + number * 100_000_000, low)
        said.append(flight.tello._flight_state(1 + number * 100_000_000))
    assert said == [FlightState.TAKING_OFF] * 20 + [FlightState.FLYING] * 5


def test_the_floor_counts_where_tof_sees_it_whatever_h_says():
    """`h` is above the take-off: one that has landed on a table stands."""
    assert not Heard(1, 0, dataclasses.replace(STATE, tof=10, height=70)).airborne(5_000_000_000)
    assert Heard(1, 0, dataclasses.replace(STATE, tof=20, height=0)).airborne(5_000_000_000)
    assert not Heard(1, 0, dataclasses.replace(STATE, tof=6553, height=10)).airborne(5_000_000_000)


def test_the_emulator_reports_heights_as_low_and_coarse_as_real_ones(rig):
    rig.say(b"command")
    rig.say(b"takeoff", 5.0)
    state = rig.state()
    assert state.height % 10 == 0 and 20 <= state.tof - state.height <= 45


def test_one_that_says_that_it_stands_is_told_to_land_all_the_same(flight):
    """Its report may be wrong."""
    assert flight.told(Action.LAND, state=dataclasses.replace(STATE, tof=10, height=0))[0] == b"rc 0 0 0 0"
    assert flight.heard.recv(64) == b"land"


def test_a_take_off_that_is_called_off_is_followed_by_land(flight):
    """It stands still at the command, and would take off all the same."""
    standing = dataclasses.replace(STATE, tof=10, height=0, time=0)
    flight.tello.heard = Heard(1, 0, standing)

    def told(action: Action) -> bytes:
        flight.tello.apply(time.monotonic_ns(), WatchdogDecision(DriverMode.LANDED, action))
        skipped = (b"streamon", b"rc 0 0 0 0")
        return next(word for word in iter(lambda: flight.heard.recv(64), b"") if word not in skipped)

    flight.tello._ready = True
    assert told(Action.IDLE) == b"command"
    assert told(Action.TAKE_OFF) == b"takeoff"
    assert told(Action.IDLE) == b"land"


def test_the_answer_to_a_refused_command_is_reported(flight):
    flight.told(Action.TAKE_OFF, state=dataclasses.replace(STATE, height=0, tof=0, time=0))
    flight.tello._hear_answer(time.monotonic_ns(), b"error Motor stop\r\n")
    assert flight.tello.health(time.monotonic_ns()).detail == "it answers 'error motor stop' when told to take off"
    flight.told(Action.HOVER)
    assert flight.tello.health(time.monotonic_ns()).detail == ""


def test_it_flies_only_after_it_was_greeted(rig):
    rig.say(b"takeoff", 1.0)
    assert not rig.body.motors_on
    assert rig.partner.recv(64).startswith(b"unknown command")


@pytest.mark.parametrize(
    ("sticks", "velocity", "turn"),
    [((0, 40, 0, 0), (0.4, 0, 0), 0), ((40, 0, 0, 0), (0, -0.4, 0), 0), ((0, 0, 30, 0), (0, 0, 0.3), 0),
     ((0, 0, 0, 30), (0, 0, 0), -0.52), ((-20, -30, 0, -30), (-0.3, 0.2, 0), 0.52)],
)  # fmt: skip
def test_signs_and_units_of_sticks_and_state_agree(rig, sticks, velocity, turn):
    rig.say(b"command")
    rig.say(b"takeoff", 4.0)
    before = rig.state()
    rig.say(rc(*sticks), 2.0)
    after = rig.state()
    assert velocity_from_state(after) == pytest.approx(velocity, abs=0.16)
    turned = -math.radians(math.remainder(after.yaw - before.yaw, 360.0))
    assert turned == pytest.approx(2.0 * turn, abs=0.15)
    assert rig.body.airframe.velocity_stabilized() == pytest.approx(velocity[:2], abs=0.16)


def test_it_lands_after_fifteen_silent_seconds(rig):
    rig.say(b"command")
    rig.say(b"takeoff", 4.0)
    rig.turn(10.0)
    assert rig.body.airborne
    rig.turn(6.0)
    assert not rig.body.airborne and not rig.body.motors_on


def test_emergency_stops_the_motors_and_hover_does_not_start_them(rig):
    stop = kind_named("tello").stop([subject_of("tello").order()])
    rig.say(b"command")
    rig.say(stop.hover, 1.0)
    assert not rig.body.motors_on
    rig.say(b"takeoff", 4.0)
    rig.say(stop.hover, 1.0)
    assert rig.body.airborne
    rig.say(b"emergency")
    assert not rig.body.motors_on


def travelled(rig, *words: bytes) -> float:
    """Return how far one that flies at 0.6 m/s gets from an order until it stands [m]."""
    rig.say(b"command")
    rig.say(b"takeoff", 4.0)
    rig.say(rc(0, 60, 0, 0), 2.0)
    x, y = rig.body.airframe.x, rig.body.airframe.y
    for said in words:
        rig.say(said)
    rig.turn(5.0)
    assert not rig.body.motors_on
    return math.hypot(rig.body.airframe.x - x, rig.body.airframe.y - y)


def test_land_alone_lets_it_fly_on_with_its_last_sticks(rig):
    assert travelled(rig, b"land") > 1.2


def test_the_driver_centres_the_sticks_of_one_that_lands(rig, flight):
    words = [flight.told(Action.LAND)[0], flight.heard.recv(64)]
    assert travelled(rig, *words) < 0.6


def test_the_fail_safe_lands_one_that_flies_away_with_centred_sticks(rig):
    stop = kind_named("tello").stop([subject_of("tello").order()])
    with (
        closing(resolve_name(stop.transport)(stop.way, 2)) as transport,
        closing(socket.socket(type=socket.SOCK_DGRAM)) as heard,
    ):
        heard.bind(("127.64.79.11", 0))
        heard.settimeout(1.0)
        transport.send(stop.land, [heard.getsockname()])
        words = [heard.recv(64), heard.recv(64)]
        transport.send(stop.hover, [heard.getsockname()])
        assert heard.recv(64) == b"rc 0 0 0 0"
    assert words == [b"rc 0 0 0 0", b"land"] and travelled(rig, *words) < 0.6


def test_one_that_stands_and_gets_no_echo_from_the_floor_does_not_count_as_airborne():
    """As in logs of several real vehicles before the first flight."""
    said = (
        b"mid:-1;x:0;y:0;z:0;mpry:0,0,0;pitch:0;roll:0;yaw:0;vgx:0;vgy:0;vgz:0;templ:59;temph:63;tof:6553;h:0;"
        b"bat:91;baro:60.84;time:0;agx:-3.00;agy:14.00;agz:-1008.00;\r\n"
    )
    assert not Heard(1, 0, parse_state(said)).airborne(2_000_000_000)
    assert Heard(1, 0, parse_state(said.replace(b"h:0", b"h:90"))).airborne(2_000_000_000)


def test_a_vehicle_whose_motors_run_on_the_floor_counts_as_airborne():
    low = State(0, 0, 0, (0, 0, 0), 10, 0, 80, 3, (0.0, 0.0, -1000.0))
    assert Heard(1, 1_000_000_000, low).airborne(2_000_000_000)
    assert not Heard(1, 1_000_000_000, low).airborne(3_000_000_000)
