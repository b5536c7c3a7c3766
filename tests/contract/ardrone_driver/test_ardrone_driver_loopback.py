"""The whole driver over loopback UDP: datagrams to the drone, and messages about it on the bus."""

import socket
import struct
import time

import pytest

from drivers import datagrams
from drivers.ardrone.driver import ArDrone, run
from drivers.host import VehicleHost, run_hosts
from drivers.watchdog_types import WatchdogLimits
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import Command, Severity, Verb
from groundstation.bus.topics import COMMAND, COMMAND_ACK, IMU, ODOMETRY, RAW_RX, RAW_TX, VEHICLE_STATUS
from groundstation.errors import SettingsError

S = 1_000_000_000
FLY, BOOTSTRAP, EMERGENCY = 1 << 0, 1 << 11, 1 << 31


def with_checksum(body: bytes) -> bytes:
    return body + struct.pack("<HHI", 0xFFFF, 8, sum(body))


def test_connecting_configures_before_anything_else_and_sends_no_reference_unheard(rig):
    rig.speaking = False
    for _ in range(5):
        rig.turn()
    rig.speaking = True
    rig.fake.turn()
    unheard = list(rig.fake.lines)
    assert {name for name, _, _ in unheard} == {"COMWDG", "PCMD"}
    assert [number for _, number, _ in unheard[::3]] == [1] * 5, "a drone that was not heard is spoken to from 1"
    rig.connect()
    config = rig.fake.config
    assert next(iter(config)) == "general:navdata_demo" and config["general:navdata_demo"] == "FALSE"
    assert config["control:altitude_max"] == "3000" and config["pic:ultrasound_freq"] == "8"
    rig.turn()
    assert len(rig.fake.said("FTRIM")) >= 1
    assert rig.fake.said("REF") and set(rig.fake.said("REF")) == {"290717696"}
    assert rig.process.states[-1].startswith("READY")


def test_numbers_rise_by_one_without_a_gap(rig):
    rig.connect()
    numbers = [number for _, number, _ in rig.fake.lines if number != 1]
    assert numbers == list(range(2, len(numbers) + 2)), "whether or not a 1 goes in front"
    assert 1 not in [number for _, number, _ in rig.fake.lines[-20:]], "once it obeys"


def test_take_off_track_land_over_the_wire(rig):
    rig.take_off()
    assert "290718208" in rig.fake.said("REF")
    rig.track()
    rig.fake.lines.clear()
    for _ in range(5):
        rig.turn()
    flag, phi, theta, gaz, yaw = (int(value) for value in rig.fake.said("PCMD")[-1].split(","))
    theta = struct.unpack("<f", struct.pack("<i", theta))[0]
    assert flag == 1 and theta < 0 and (gaz, yaw) == (0, 0), "0.5 m/s forward is asked, 0.3 reported: nose down"
    phi = struct.unpack("<f", struct.pack("<i", phi))[0]
    assert phi < 0, "it slips to the right: tilt left"
    rig.order(Verb.LAND)
    rig.until(lambda: rig.decision.mode == "LANDED")
    rig.turn()
    assert rig.fake.said("REF")[-1] == "290717696" and rig.fake.said("PCMD")[-1] == "0,0,0,0,0"
    acks = [(ack.verb, ack.stage) for ack in rig.messages(COMMAND_ACK)]
    for verb in ("TAKEOFF", "TRACK", "LAND"):
        assert [stage for v, stage in acks if v == verb] == ["RECEIVED", "ACCEPTED", "EFFECTIVE"]


def next_motion(rig):
    """Return the odometry and the IMU sample of the next packet."""
    time.sleep(0.05)  # so that neither is decimated
    rig.messages(ODOMETRY), rig.messages(IMU)
    rig.turn()
    assert rig.heard[IMU].wait(1.0)
    return rig.messages(ODOMETRY)[0], rig.messages(IMU)[0]


def test_odometry_and_imu_in_our_frames(rig):
    rig.take_off()
    rig.fake.force_mg = 100.0
    next_motion(rig)  # earlier samples are in the first mean
    before = time.monotonic_ns()
    odometry, imu = next_motion(rig)
    assert odometry.header.entity == "drone_1" and before <= odometry.header.stamp_ns <= time.monotonic_ns()
    assert odometry.velocity_m_s == pytest.approx((0.3, -0.2, 0.0)), "as reported: no scale applied"
    assert (odometry.pitch_rad, odometry.roll_rad) == pytest.approx((-0.0174533, 0.0087266), abs=1e-6)
    assert odometry.height_m == pytest.approx(0.8)
    assert imu.specific_force_m_s2 == pytest.approx((0.980665, 0.0, 9.80665))
    assert imu.angular_velocity_rad_s == pytest.approx((0.0174533, -0.0349066, -0.0523599), abs=1e-6)
    resets = odometry.reset
    rig.fake.psi = 143_500.0
    assert next_motion(rig)[0].reset == resets + 1


def test_cut_presses_the_button_until_the_drone_reports_the_emergency(rig):
    rig.take_off()
    rig.order(Verb.CUT_MOTORS)
    rig.until(lambda: rig.fake.state & EMERGENCY)
    for _ in range(10):
        rig.turn()
    assert rig.fake.state & EMERGENCY, "pressing again would have cleared it"
    assert rig.fake.said("REF")[-1] == "290717696"
    assert rig.decision.mode == "CUT"
    rig.messages(COMMAND_ACK)
    rig.order(Verb.TAKEOFF)
    rig.until(lambda: not rig.fake.state & EMERGENCY)
    assert [ack.final for ack in rig.messages(COMMAND_ACK)] == [False, True], "no sequence may order it again"
    for _ in range(10):
        rig.turn()
    assert rig.decision.mode == "LANDED" and not rig.fake.state & FLY, "clearing starts nothing"
    rig.order(Verb.TAKEOFF)
    rig.until(lambda: rig.decision.mode == "HOVER")


def test_bad_datagrams_are_counted_by_reason_and_move_nothing(rig):
    rig.connect()
    client, good = rig.fake.client, rig.fake.packet()
    assert client is not None
    nan = bytearray(rig.fake.packet()[:-8])
    nan[28:32] = b"\0\0\xc0\x7f"
    bad = {
        "truncated": good[:60],
        "too_short": b"\x88",
        "magic": b"\0" * 40,
        "checksum": good[:-1] + bytes([good[-1] ^ 1]),
        "option_size": with_checksum(good[:18] + b"\0\0" + good[20:-8]),
        "not_finite": with_checksum(bytes(nan)),
    }
    rig.fake.navdata.sendto(good, client)
    for datagram in bad.values():
        rig.fake.navdata.sendto(datagram, client)
    rig.fake.navdata.sendto(good, client)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.bind(("127.0.0.1", 0))
        stranger.sendto(rig.fake.packet(), client)
        time.sleep(0.15)
    rig.turn()
    rejected = rig.drone.health(time.monotonic_ns()).rejected
    for reason in (*bad, "replayed", "foreign_address"):
        assert rejected.get(reason) == 1, (reason, rejected)
    rig.host.publish_status(time.monotonic_ns())
    assert rig.messages(VEHICLE_STATUS)[-1].rejected["checksum"] == 1
    assert rig.decision.mode == "LANDED"


def test_a_restarted_driver_lands_a_flying_drone_and_never_starts_a_standing_one(rig):
    rig.take_off()
    rig.drone.close()
    rig.fake.state |= BOOTSTRAP
    rig.fake.client = None
    rig.fake.lines.clear()
    second = ArDrone(rig.settings, rig.process.bus)
    rig.drone, rig.host = second, VehicleHost(rig.process, second, WatchdogLimits(brake_s=0.05))
    rig.tracking = True
    rig.until(lambda: not rig.fake.state & FLY)
    references = rig.fake.said("REF")
    assert references[0] == "290718208", "first it stays up and brakes"
    assert references[-1] == "290717696"
    assert all(arguments.startswith("0,") for arguments in rig.fake.said("PCMD"))
    assert any("when this driver started" in text for _, text, _ in rig.process.events)
    for _ in range(20):
        rig.turn()
    assert rig.decision.mode == "LANDED" and not rig.fake.state & FLY


def test_a_silent_drone_is_asked_again_and_goes_on_once_it_has_been_heard_for_a_while(rig):
    rig.take_off()
    rig.track()
    rig.speaking, requests = False, rig.fake.requests
    began = time.monotonic()
    while time.monotonic() - began < 1.6:
        rig.turn()
        time.sleep(0.02)
    assert rig.decision.action == "HOVER"
    rig.host.publish_status(time.monotonic_ns())
    status = rig.messages(VEHICLE_STATUS)[-1]
    assert status.flight_state == "LOST" and status.detail == rig.host.watchdog.explanation != "waiting for navdata"
    assert any("does not answer" in text for _, text, _ in rig.process.events)
    rig.speaking = True
    rig.fake.lines.clear()
    for _ in range(10):
        rig.turn()
    assert rig.fake.requests > requests, "navdata was asked for again"
    assert rig.decision.action == "HOVER" and set(rig.fake.said("PCMD")[-5:]) == {"0,0,0,0,0"}
    rig.until(lambda: rig.decision.action == "FLY")
    assert rig.decision.mode == "TRACK"


def test_a_command_for_somebody_else_is_not_answered(rig):
    rig.connect()
    rig.order(Verb.TAKEOFF, scope=("drone_2",))
    rig.turn()
    assert rig.messages(COMMAND_ACK) == [] and rig.decision.mode == "LANDED"


def test_raw_datagrams_are_recorded_in_batches(rig):
    rig.connect()
    rig.drone.flush()
    received = [sample for payload in rig.heard[RAW_RX].drain() for sample in datagrams.unpack(payload.payload)]
    sent = [sample for payload in rig.heard[RAW_TX].drain() for sample in datagrams.unpack(payload.payload)]
    assert all(datagram[:4] == b"\x88\x77\x66\x55" for _, datagram in received)
    assert sent[0][1] == b"\x01\x00\x00\x00" and any(b"AT*REF=" in datagram for _, datagram in sent)
    stamps = [stamp for stamp, _ in received]
    assert stamps == sorted(stamps)


def test_stopping_lands_first_and_then_ends(rig):
    rig.take_off()

    def turn():
        rig.fake.turn()
        time.sleep(0.01)

    rig.process.on_sleep = turn
    rig.process.stop_requested = True
    assert run_hosts(rig.process, [rig.host], rate_hz=100) == 0
    assert rig.process.finished and not rig.fake.state & FLY
    assert rig.messages(VEHICLE_STATUS)[-1].mode == "LANDED"


def test_a_drone_that_never_answers_is_named_after_5_s(rig):
    rig.speaking = False
    now = time.monotonic_ns()
    rig.host.turn(now)
    rig.host.turn(now + 4_900_000_000)
    assert rig.process.events == []
    for second in range(50, 80):
        rig.host.turn(now + second * S // 10)
    ((severity, text, remedy),) = rig.process.events
    assert severity is Severity.ERROR and "drone_1" in text and rig.fake.address in text and "ping" in remedy
    assert rig.process.states == [f"DEGRADED drone_1 does not answer at {rig.fake.address}"]
    rig.speaking = True
    rig.fake.turn()
    assert rig.fake.requests >= 20, "it keeps asking"


def test_entry_refuses_a_bad_section_and_leaves_at_once_when_told_before_it_was_heard(process_on):
    bus = MemoryBus(MemoryExchange(), "lab", "ardrone_drone_1")
    with pytest.raises(SettingsError):
        run(process_on(bus, '{"name": "drone_1", "adress": "127.0.0.1"}'))
    process = process_on(bus, '{"name": "drone_1", "address": "127.0.0.1", "at_port": 40001, "navdata_port": 40002}')
    process.stop_requested = True
    assert run(process) == 0


def test_datagram_framing_round_trip_and_cuts():
    batch = [(5, b"abc"), (-1, b""), (2**62, b"x" * 3000)]
    payload = datagrams.pack(batch)
    assert payload[:15] == struct.pack("<qI", 5, 3) + b"abc"
    assert datagrams.unpack(payload) == batch
    for length in (1, 11, 13, len(payload) - 1):
        with pytest.raises(ValueError, match="cut short"):
            datagrams.unpack(payload[:length])


@pytest.mark.parametrize("fault", ["frozen", "stuck"])
def test_values_that_cannot_be_true_stop_it_like_silence_and_the_operator_reads_why(new_rig, fault):
    rig = new_rig()
    rig.host = VehicleHost(rig.process, rig.drone, WatchdogLimits(land_after_s=1.3))
    rig.take_off()
    rig.track()
    rig.fake.lie = fault
    began = time.monotonic()
    rig.until(lambda: rig.decision.action == "HOVER")
    assert time.monotonic() - began <= 1.3
    rig.messages(ODOMETRY)
    rig.until(lambda: rig.decision.action == "LAND")
    assert rig.messages(ODOMETRY) == [], "what is BAD is not published"
    word = "all values repeat" if fault == "frozen" else "reported velocity stuck at"
    assert any(word in text for _, text, _ in rig.process.events), rig.process.events
    rig.until(lambda: not rig.fake.state & FLY)


def test_an_order_without_the_right_to_give_it_is_an_event(rig):
    rig.connect()
    rig.other.source = "cli_1"
    rig.order(Verb.TAKEOFF)
    rig.other.source = "other"
    rig.turn()
    assert rig.host.watchdog.mode == "LANDED"
    assert any(
        "TAKEOFF of cli_1 refused: the operator lease is held by op" in text for _, text, _ in rig.process.events
    )


def test_an_obeyed_order_that_is_repeated_past_its_time_is_no_event(rig):
    rig.connect()
    sent_ns = time.monotonic_ns()
    header = rig.other.header("team", sent_ns)
    order = Command(header=header, id="t", verb=Verb.TAKEOFF, scope=(), issuer="op", expires_ns=sent_ns + S // 2)
    rig.other.publish(COMMAND, order)
    rig.turn()
    assert rig.host.watchdog.mode == "TAKING_OFF"
    rig.until(lambda: time.monotonic_ns() > order.expires_ns)
    rig.other.publish(COMMAND, order)
    rig.turn()
    assert not any("refused" in text for _, text, _ in rig.process.events), rig.process.events
