"""The conformance kit: our kinds pass, wrong flights fail, its command and its plug-in find the checks."""

import math
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from groundstation.bus.api import Received
from groundstation.bus.keys import parse
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import AckStage, CommandAck, FlightState, Odometry, VehicleStatus, Verb
from groundstation.bus.topics import COMMAND_ACK, ODOMETRY, VEHICLE_STATUS
from groundstation.errors import SettingsError
from sim_bridge.conformance.check import CHECKS, Case
from sim_bridge.conformance.flights import LEG_S, SCRIPTS, SPEED_M_S
from sim_bridge.conformance.kit import Kit, chosen
from sim_bridge.conformance.record import Heard, Moment, Record
from sim_bridge.conformance.subject import NAME, subject_of

ROOT = Path(__file__).parents[4]
S = 1_000_000_000
LEGS = {"forward": (1, 0), "left": (0, 1), "back": (-1, 0), "right": (0, -1)}
BUS = MemoryBus(MemoryExchange(), "lab", "driver")


def heard(topic, at_ns, message):
    return Heard(at_ns, Received(parse(BUS.key(topic, NAME)), message.header, message, b""))


def odometry(at_ns, velocity):
    variance = (0.0025, 0.0, 0.0, 0.0, 0.0025, 0.0, 0.0, 0.0, 0.0025)
    header = BUS.header(NAME, at_ns)
    return heard(
        ODOMETRY,
        at_ns + 1000,
        Odometry(header=header, velocity_m_s=velocity, velocity_covariance=variance, yaw_rad=0.0, roll_rad=0.0,
                 pitch_rad=0.0),
    )  # fmt: skip


def flown(turned_rad=0.0, told=1.0):
    """Return a square flown with heading 0.4 rad, turned by an angle; told: share of its reported velocity."""
    record, at_ns, place, yaw = Record(), S, [0.0, 0.0], 0.4
    for mark, (ahead, aside) in LEGS.items():
        begin = at_ns
        angle = math.atan2(aside, ahead) + yaw + turned_rad
        velocity = (SPEED_M_S * math.cos(angle), SPEED_M_S * math.sin(angle), 0.0)
        for tick in range(round(LEG_S / 0.01)):
            at_ns += S // 100
            place = [p + 0.01 * v for p, v in zip(place, velocity[:2], strict=True)]
            moment = Moment(at_ns, (place[0], place[1], 1.0), velocity, (0.0, 0.0, yaw), False, True, 0.9)
            record.moments.append(moment)
            if tick % 5 == 0:
                forward, left = moment.forward_left
                noise = 0.001 * (tick % 3)
                record.messages["odometry"].append(odometry(at_ns, (told * forward + noise, told * left - noise, 0.0)))
        record.marks[mark] = (begin, at_ns)
        for _ in range(120):
            at_ns += S // 100
            record.moments.append(replace(moment, at_ns=at_ns, velocity=(0.0, 0.0, 0.0)))
    return record


def verdict(record, name, kind="tello"):
    kit = Kit(kind)
    kit._records = dict.fromkeys(["", *SCRIPTS], record)
    return kit.judge(CHECKS[name])


@pytest.mark.parametrize("kind", ["ardrone", "mavlink", "ros2", "tello"])
def test_the_objects_of_our_kinds_pass(kind):
    kit = Kit(kind)
    checks = [one for one in chosen("kind") if one.name != "kind_is_light"]  # it starts an interpreter
    assert [(v.check.name, v.why) for v in kit.verdicts(checks) if v.end == "failed"] == []
    assert len(checks) > 15


def test_there_are_many_checks_and_each_says_what_must_hold():
    assert len(CHECKS) >= 60
    assert {one.flight for one in CHECKS.values()} == {"", *SCRIPTS}
    assert not [name for name, one in CHECKS.items() if len(one.text) < 15]


SQUARE = [
    *("forward_is_forward", "left_is_left", "back_is_back", "right_is_right", "square_closes"),
    *("forward_velocity_is_told", "left_velocity_is_told", "velocity_deviation_is_true", "odometry_is_fresh"),
    *("odometry_comes_often", "velocity_covariance_is_honest"),
]


@pytest.mark.parametrize("name", SQUARE)
def test_a_good_square_passes(name):
    assert verdict(flown(), name).end == "passed"


@pytest.mark.parametrize(
    ("record", "names"),
    [
        (flown(turned_rad=math.pi), ("forward_is_forward", "left_is_left", "back_is_back", "right_is_right")),
        (flown(turned_rad=math.pi / 2), ("forward_is_forward", "left_is_left")),
        (flown(told=-1.0), ("forward_velocity_is_told", "left_velocity_is_told", "velocity_deviation_is_true")),
        (flown(told=0.1), ("forward_velocity_is_told", "left_velocity_is_told")),
        (Record(failure="it fell"), SQUARE),
    ],
)
def test_wrong_signs_units_and_failed_flights_fail(record, names):
    assert {verdict(record, name).end for name in names} == {"failed"}


def test_answers_are_looked_for_by_their_command():
    def answered(*stages):
        record = Record(commands={"hold": "hold-1"})
        for stage in stages:
            ack = CommandAck(header=BUS.header(NAME, S), command_id="hold-1", verb=Verb.HOLD, stage=stage)
            record.messages["command_ack"].append(heard(COMMAND_ACK, S, ack))
        return verdict(record, "hold_is_answered").end

    assert answered(AckStage.RECEIVED, AckStage.ACCEPTED, AckStage.EFFECTIVE) == "passed"
    assert answered(AckStage.RECEIVED, AckStage.ACCEPTED) == "failed"


def test_a_vehicle_that_rises_from_the_ground_fails():
    stands = Moment(S, (0.0, 0.0, 0.06), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), True, False, 0.9)
    record = Record(moments=[replace(stands, at_ns=S + i) for i in range(5)], marks={"told to hover": (S, 2 * S)})
    assert verdict(record, "hover_datagram_lifts_nothing").end == "passed"
    record.moments.append(replace(stands, at_ns=S + 9, motors=True))
    assert verdict(record, "hover_datagram_lifts_nothing").end == "failed"


@pytest.mark.parametrize(("finished", "end"), [(1.0, "passed"), (0.0, "failed")])
def test_a_driver_that_ends_without_a_word_fails(finished, end):
    record = Record(marks={"low battery": (S, 2 * S)}, exits=[0], facts={"finished": finished})
    assert verdict(record, "end_on_the_ground_is_told").end == end


def test_a_driver_that_is_silent_for_long_fails():
    record = Record(marks={"damaged": (S, 5 * S)})
    for at_ns in (2 * S, 4 * S):
        status = VehicleStatus(header=BUS.header(NAME, at_ns), flight_state=FlightState.LANDED, mode="LANDED")
        record.messages[VEHICLE_STATUS.name].append(heard(VEHICLE_STATUS, at_ns, status))
    assert verdict(record, "driver_goes_on_speaking_under_damage").end == "failed"


def hovering(rate_rad_s):
    """Return the samples of a vehicle that hovers and turns on the spot."""
    still = Moment(S, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), False, True, 0.9)
    turns = [(0.0, 0.0, math.remainder(rate_rad_s * i / 100, math.tau)) for i in range(250)]
    moments = [replace(still, at_ns=S + i * S // 100, attitude=one) for i, one in enumerate(turns)]
    return Record(moments=moments, marks={"told to hover": (S, S + 5 * S // 2)})


def test_a_hover_that_spins_is_no_hover():
    assert verdict(hovering(0.02), "hover_datagram_stops_it").end == "passed"
    spun = verdict(hovering(-4.0), "hover_datagram_stops_it")
    assert (spun.end, spun.why) == ("failed", "it turns by 4.00 rad/s")


def drifting(gathers_m_s2, stands=True):
    """Return the samples of a vehicle with a hover command that brakes from 0.4 m/s, and accelerates again."""
    moments = []
    for i in range(250):
        speed = abs(max(0.0 if stands else 0.3, 0.4 - 0.004 * i) - gathers_m_s2 * max(0.0, i / 100 - 1.0))
        one = Moment(S + i * S // 100, (0.0, 0.0, 1.0), (speed, 0.0, 0.0), (0.0, 0.0, 0.0), False, True, 0.9)
        moments.append(one)
    return Record(moments=moments, marks={"told to hover": (S, S + 5 * S // 2)})


@pytest.mark.parametrize(
    ("kind", "record", "end"),
    [
        ("mavlink", drifting(0.0), "passed"),
        ("mavlink", drifting(0.17), "passed"),
        ("mavlink", drifting(0.4), "failed"),
        ("mavlink", drifting(0.0, stands=False), "failed"),
        ("mavlink", hovering(0.5), "failed"),
        ("tello", drifting(0.0), "passed"),
        ("tello", drifting(0.17), "failed"),
    ],
)
def test_only_who_flies_on_our_positions_may_gather_speed_without_them(kind, record, end):
    assert verdict(record, "hover_datagram_stops_it", kind).end == end


def limited(share):
    """Return the flight under low limits by a vehicle that reaches a share of each."""
    record, at_ns, yaw = Record(), S, 0.0
    speed, climb, turn = 0.3 * share, 0.2 * share, math.radians(30.0) * share
    for mark, velocity, rate in (
        ("too fast ahead", (speed, 0.0, 0.0), 0.0),
        ("too fast aslant", (-0.7 * speed, 0.7 * speed, 0.0), 0.0),
        ("too fast up", (0.0, 0.0, climb), 0.0),
        ("too fast down", (0.0, 0.0, -climb), 0.0),
        ("too fast a turn", (0.0, 0.0, 0.0), turn),
    ):
        begin = at_ns
        for _ in range(240):
            at_ns, yaw = at_ns + S // 100, math.remainder(yaw + rate / 100, math.tau)
            record.moments.append(Moment(at_ns, (0.0, 0.0, 1.0), velocity, (0.0, 0.0, yaw), False, True, 0.9))
        record.marks[mark] = (begin, at_ns)
    return record


@pytest.mark.parametrize("name", ["speed_limit_is_flown", "climb_limit_is_flown", "turn_limit_is_flown"])
def test_limits_are_flown(name):
    ends = {share: verdict(limited(share), name).end for share in (0.3, 0.95, 2.0)}
    assert ends == {0.3: "failed", 0.95: "passed", 2.0: "failed"}


def test_an_unknown_word_is_refused_with_those_that_there_are():
    with pytest.raises(SettingsError) as refused:
        chosen("square,wings")
    said = "\n".join(refused.value.problems)
    assert "called wings" in said and "lossy" in said and "hover_datagram_stops_it" in said
    assert {one.flight for one in chosen("square, lands,kind")} == {"square", ""}


def test_a_vehicle_is_made_as_its_kind_s_example_says_and_otherwise():
    other = subject_of("mavlink", ["mavlink.flavour=ardupilot"])
    assert other.sections["mavlink"].model_dump()["flavour"] == "ardupilot"
    case = Case(subject_of("tello"), Record())
    assert case.subject.sections["tello"].model_dump()["local_address"] == case.subject.local_address


@pytest.mark.parametrize(
    ("kind", "options", "text"),
    [
        ("zeppelin", [], "kind: zeppelin is not known"),
        ("tello", ["wings.span=1"], "tello has no section wings"),
        ("tello", ["tello"], "tello: must be SECTION.KEY=VALUE"),
        ("tello", ["tello.full_speed_m_s=-3"], "full_speed_m_s"),
    ],
)
def test_invalid_kinds_and_options_are_named(kind, options, text):
    with pytest.raises(SettingsError, match=text):
        subject_of(kind, options)


@pytest.mark.slow
def test_the_plug_in_makes_a_test_of_each_check(tmp_path):
    command = [sys.executable, "-m", "pytest", "-p", "sim_bridge.conformance.plugin", "-p", "no:cacheprovider"]
    command += ["--skein-vehicle", "ardrone", "--skein-only", "kind", "-q"]
    env = os.environ | {"PYTHONPATH": str(ROOT), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    result = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True, timeout=100, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    assert f"{len(chosen('kind'))} passed" in result.stdout


def test_no_check_passes_where_nothing_was_flown():
    """A check without data must not pass."""
    empty = Record(failure="it fell")
    passed = [one.name for one in CHECKS.values() if one.flight and verdict(empty, one.name).end != "failed"]
    assert passed == []


def test_no_check_passes_where_the_driver_said_nothing():
    """The vehicle flew throughout, without any message."""
    record, at_ns = flown(), 100 * S
    record.messages.clear()
    still = Moment(at_ns, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), False, True, 0.9)
    record.moments += [replace(still, at_ns=at_ns + i * S // 100) for i in range(500)]
    told = [
        *("says_that_it_stands", "status_comes_at_4_hz", "status_tells_the_charge", "odometry_is_fresh"),
        *("odometry_comes_often", "heading_is_told", "track_is_answered", "hold_is_answered", "resume_is_answered"),
        *("refusals_are_events", "datagrams_are_recorded", "operator_is_told_why", "unheard_vehicle_is_lost", "lands"),
        *("commands_are_sent_often", "flight_states_follow", "take_off_ends_in_hover"),
    ]
    marks = ("standing", "still", "turn", "up", "down", "hover", "landed", "jumping", "silent vehicle")
    record.marks |= dict.fromkeys(marks, (at_ns, at_ns + 4 * S))
    assert {name: verdict(record, name).end for name in told} == dict.fromkeys(told, "failed")


@pytest.mark.parametrize(("load", "said"), [(0.4, "the computer was not too busy"), (2.5, "the computer was too busy")])
def test_a_span_without_data_is_told_as_such(load, said):
    """Python's errors were the result: max() of an empty sequence."""
    record = flown()
    record.load, record.marks["jumping"] = load, (0, 1)
    record.marks |= {"heard again": (0, 1), "held": (0, 1)}
    speed, told, known, held = (
        verdict(record, name).why
        for name in ("impossible_velocity_is_not_flown_by", "operator_is_told_why", "heard_again_it_is_known",
                     "hold_goes_before_setpoints")
    )  # fmt: skip
    assert speed == f"nothing was recorded of: jumping ({said}: load {load} per core" + speed.partition("per core")[2]
    assert told.startswith(f"no event has a reason; events: none ({said}")
    assert known.startswith(f"no vehicle_status was received in: heard again ({said}")
    assert held.startswith(f"nothing was recorded of: held ({said}")
