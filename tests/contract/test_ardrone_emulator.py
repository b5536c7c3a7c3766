"""The emulator's link over real loopback UDP: bootstrap, packets, ack bit, configuration, sequence rules, watchdogs.

The bench (conftest.py) assembles and reads bytes by hand (docs/reference/ardrone.md 2, 4).
"""

import struct
from typing import Any

import pytest

FLY, START, COMMAND, DEMO, BOOTSTRAP, COM_LOST = 1 << 0, 1 << 5, 1 << 6, 1 << 10, 1 << 11, 1 << 13
COM_WATCHDOG = 1 << 30


def test_silent_until_asked(bench: Any) -> None:
    assert bench.tick(40) == []
    bench.say("COMWDG")
    assert bench.tick(40) == []


@pytest.mark.parametrize("payload", [b"\x01", b"\x01\x00\x00\x00", b"1", b"\x01" + b"\x00" * 13])
def test_any_request_brings_a_bootstrap_packet_to_its_sender(bench: Any, payload: bytes) -> None:
    bench.request(payload)
    packet = bench.tick()[0]
    magic, state, sequence, vision = struct.unpack_from("<IIII", packet)
    assert (len(packet), magic, sequence, vision) == (24, 0x55667788, 1, 0)
    assert state & BOOTSTRAP
    assert not state & FLY
    assert struct.unpack_from("<HHI", packet, 16) == (0xFFFF, 8, sum(packet[:16]))


def test_bootstrap_goes_on_at_the_demo_rate_while_requests_come(bench: Any) -> None:
    bench.request()
    bench.tick()
    packets = bench.tick(13 * 10)
    assert len(packets) == 10
    assert {len(packet) for packet in packets} == {24}


def test_requests_every_100_ms_do_not_restart_the_session(bench: Any) -> None:
    bench.connect()
    for _ in range(5):
        bench.request()
        bench.say("COMWDG")
        bench.tick(20)
    sequences = [struct.unpack_from("<I", packet, 8)[0] for packet in bench.packets]
    assert sequences == list(range(1, len(sequences) + 1))
    assert not bench.state & BOOTSTRAP


def test_full_mode_is_200_hz_with_the_options_of_the_sheet(bench: Any, golden_packet: Any) -> None:
    bench.connect()
    assert len(bench.tick(10)) == 10
    packet = bench.packets[-1]
    assert len(packet) == 1916
    assert not bench.state & (DEMO | BOOTSTRAP)
    assert struct.unpack_from("<I", packet, len(packet) - 4)[0] == sum(packet[:-8])
    assert bench.options(packet) == bench.options(golden_packet("full-landed"))


def test_a_landed_drone_says_what_a_real_one_said(bench: Any, real_data: Any) -> None:
    bench.connect()
    bench.tick()
    real, ours = real_data("ardrone/ar2-full-1916.bin").read_bytes(), bench.packets[-1]
    assert bench.options(ours) == bench.options(real)
    assert struct.unpack_from("<I", ours, 20) == struct.unpack_from("<I", real, 20), "control state"
    assert struct.unpack_from("<i", ours, 40)[0] == struct.unpack_from("<i", real, 40)[0] == 0, "altitude"
    start = {}
    offset = 16
    for tag, size in bench.options(real):
        start[tag] = offset
        offset += size
    for tag, place, form, tolerance in (
        (2, 4, "<H", 60),  # accelerometer LSB, x
        (2, 8, "<H", 80),  # and z
        (2, 46, "<i", 20),  # ultrasound on the ground
        (3, 18, "<f", 60.0),  # mg, z down: gravity is negative
        (21, 14, "<i", 1),  # pressure
    ):
        mine = struct.unpack_from(form, ours, start[tag] + place)[0]
        theirs = struct.unpack_from(form, real, start[tag] + place)[0]
        assert mine == pytest.approx(theirs, abs=tolerance), (tag, place)


def test_demo_mode_is_15_hz_with_500_bytes(bench: Any, golden_packet: Any) -> None:
    bench.connect("TRUE")
    bench.keep(0.3)
    del bench.packets[:]
    bench.keep(1.56)
    demo = [packet for packet in bench.packets if len(packet) == 500]
    assert len(demo) == pytest.approx(1.56 * 200 / 13, abs=1)
    assert bench.options(demo[0]) == [(0, 148), (16, 328), (0xFFFF, 8)]
    assert bench.state & DEMO
    assert bench.options(demo[0]) == bench.options(golden_packet("demo-flying"))


def test_navdata_options_choose_what_demo_mode_sends(bench: Any) -> None:
    bench.connect("TRUE")
    bench.say(f'CONFIG,"general:navdata_options","{1 << 0 | 1 << 10 | 1 << 16}"')
    bench.tick(30)
    assert [tag for tag, _ in bench.options(bench.packets[-1])] == [0, 10, 16, 0xFFFF]


def test_config_in_demo_mode_brings_a_status_only_packet(bench: Any) -> None:
    bench.connect("TRUE")
    bench.tick(13)
    bench.say('CONFIG,"control:altitude_max","2500"')
    packets = bench.tick(1)
    assert [len(packet) for packet in packets] == [24]
    assert bench.state & COMMAND


def test_the_ack_bit_is_held_for_two_packets(bench: Any) -> None:
    bench.connect()
    assert not bench.state & COMMAND
    bench.say('CONFIG,"control:altitude_max","2500"', "CTRL,5,0")
    states = [struct.unpack_from("<I", packet, 4)[0] & COMMAND for packet in bench.tick(4)]
    assert states == [COMMAND, COMMAND, 0, 0]
    assert bench.autopilot.limits.height_m == 2.5


def test_the_ack_bit_stays_until_it_is_acknowledged(bench: Any) -> None:
    bench.connect()
    bench.say('CONFIG,"control:altitude_max","2500"')
    bench.keep(1.0)
    assert bench.state & COMMAND
    bench.say('CONFIG,"control:altitude_max","1500"')
    bench.tick(2)
    assert bench.autopilot.limits.height_m == 2.5, "a second CONFIG before the ack is lost"
    bench.say("CTRL,5,0")
    bench.tick(2)
    assert not bench.state & COMMAND


def test_bootstrap_ends_with_the_ack(bench: Any) -> None:
    bench.request()
    bench.say('CONFIG,"general:navdata_demo","FALSE"')
    bench.tick(30)
    assert bench.state & BOOTSTRAP
    assert bench.state & COMMAND
    bench.say("CTRL,5,0")
    bench.tick(2)
    assert not bench.state & BOOTSTRAP


def test_clients_that_never_acknowledge_get_navdata_all_the_same(bench: Any) -> None:
    bench.request()
    bench.say('CONFIG,"general:navdata_demo","TRUE"')
    bench.keep(1.5)
    assert len(bench.packets[-1]) == 500


def test_limits_are_clamped_and_applied(bench: Any) -> None:
    bench.connect()
    for key, value in (
        ("control:euler_angle_max", "0.1"),
        ("CONTROL:control_vz_max", "9000"),
        ("control:control_yaw", "3.0"),
    ):
        bench.say(f'CONFIG,"{key}","{value}"')
        bench.tick(3)
        bench.say("CTRL,5,0")
        bench.tick(3)
    limits = bench.autopilot.limits
    assert (limits.tilt_rad, limits.climb_m_s, limits.yaw_rate_rad_s) == pytest.approx((0.1, 2.0, 3.0))


def test_multi_configuration_wants_the_active_ids(bench: Any) -> None:
    bench.connect()
    for commands in (
        ('CONFIG,"custom:session_id","1234abcd"',),
        ('CONFIG_IDS,"00000000","00000000","00000000"', 'CONFIG,"control:euler_angle_max","0.1"'),
        ('CONFIG_IDS,"1234abcd","00000000","00000000"', 'CONFIG,"control:euler_angle_max","0.2"'),
    ):
        bench.say(*commands)
        bench.tick(3)
        bench.say("CTRL,5,0")
        bench.tick(3)
        assert bench.autopilot.limits.tilt_rad != pytest.approx(0.1)
    assert bench.autopilot.limits.tilt_rad == pytest.approx(0.2)


def test_outdoor_selects_the_outdoor_limits(bench: Any) -> None:
    bench.connect()
    bench.say('CONFIG,"control:outdoor","true"')
    bench.tick(2)
    limits = bench.autopilot.limits
    assert (limits.tilt_rad, limits.climb_m_s) == pytest.approx((0.3490658, 1.0), abs=1e-6)


def test_old_sequence_numbers_are_ignored_and_one_resets(bench: Any) -> None:
    bench.connect()
    bench.raw(b"AT*REF=100,290718208\r")
    bench.tick()
    assert bench.state & START
    bench.raw(b"AT*REF=99,290717696\r")
    bench.raw(b"AT*REF=100,290717696\r")
    bench.tick()
    assert bench.state & START
    bench.raw(b"AT*REF=1,290717696\r")
    bench.tick()
    assert not bench.state & START
    bench.raw(b"AT*REF=2,290718208\r")
    bench.tick()
    assert bench.state & START


def test_after_silence_any_number_is_a_new_base(bench: Any) -> None:
    bench.connect()
    bench.raw(b"AT*COMWDG=5000\r")
    bench.tick(450)
    bench.raw(b"AT*REF=7,512\r")
    bench.request()
    bench.tick(14)
    assert bench.state & START


def test_com_watchdog_after_50_ms(bench: Any) -> None:
    bench.connect()
    bench.say("COMWDG")
    bench.tick(10)
    assert not bench.state & COM_WATCHDOG
    bench.tick(3)
    assert bench.state & COM_WATCHDOG
    assert not bench.state & COM_LOST
    bench.raw(b"\r")
    bench.tick()
    assert not bench.state & COM_WATCHDOG, "any traffic feeds it"


def test_two_seconds_of_silence_end_the_stream(bench: Any) -> None:
    bench.connect()
    came = bench.tick(500)
    assert len(came) == pytest.approx(400, abs=5)
    assert bench.tick(200) == []
    bench.request()
    packet = bench.tick()[0]
    assert struct.unpack_from("<I", packet, 8)[0] == 1, "a new session counts from 1"
    assert bench.state & BOOTSTRAP
    assert bench.state & COM_LOST


def test_a_second_client_is_served_beside_the_first(bench: Any) -> None:
    bench.connect()
    other = bench.client()
    other.sendto(b"\x01", (bench.address, 5554))
    assert len(bench.tick(14)) == 14, "the first is not disturbed"
    packet = bench.receive(other)[0]
    assert struct.unpack_from("<I", packet, 8)[0] == 1, "counted by itself"
    assert struct.unpack_from("<I", packet, 4)[0] & BOOTSTRAP
    bench.keep(1.2)
    bench.receive(other)
    bench.tick(5)
    packets = bench.receive(other)
    assert len(packets[-1]) == 1916, "who only listens joins the stream that the other has chosen"
    assert packets[-1][16:-8] == bench.packets[-1][16:-8], "the same readings"
    sequences = [struct.unpack_from("<I", packet, 8)[0] for packet in packets]
    assert sequences == list(range(sequences[0], sequences[0] + len(sequences)))
    other.close()


def test_programs_that_restart_without_goodbye_do_not_pile_up(bench: Any) -> None:
    bench.connect()
    clients = [bench.client() for _ in range(9)]
    for client in clients:
        client.sendto(b"\x01", (bench.address, 5554))
        bench.keep(0.05)
    for client in clients:
        bench.receive(client)
    bench.keep(0.2)
    served = [bool(bench.receive(client)) for client in clients]
    assert served == [False] * 5 + [True] * 4, "the newest four"
    for client in clients:
        client.close()
