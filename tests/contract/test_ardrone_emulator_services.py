"""The emulator's other ports over real loopback sockets: configuration dump, version file, pairing, sets of settings,
firmwares, floods, garbage.

The bench (conftest.py) assembles and reads bytes by hand (docs/reference/ardrone.md 2, 4).
"""

import ftplib
import socket
import struct
import threading
from typing import Any

import pytest

from sim_bridge.devices.ardrone import ArDroneEmulator
from sim_bridge.devices.ardrone_firmware import FIRMWARES

TAKE_OFF, LAND = 290718208, 290717696
COMMAND = 1 << 6


def connect(bench: Any, port: int) -> socket.socket:
    tcp = socket.create_connection((bench.address, port), timeout=2)
    tcp.setblocking(False)
    bench.tick(2)
    return tcp


def heard(bench: Any, tcp: socket.socket, end: bytes = b"\0") -> bytes:
    """Return the bytes up to an end mark."""
    text = b""
    for _ in range(200):
        bench.tick()
        try:
            text += tcp.recv(65536)
        except BlockingIOError:
            continue
        if text.endswith(end):
            return text
    raise AssertionError(text)


def configure(bench: Any, *commands: str) -> None:
    bench.say(*commands)
    bench.tick(3)
    bench.say("CTRL,5,0")
    bench.tick(3)


def fit(bench: Any, firmware: str) -> None:
    """Replace the drone's electronics."""
    bench.emulator.close()
    drone, onboard = bench.world.drones["d"], bench.world.onboard["d"]
    bench.emulator = ArDroneEmulator("d", bench.address, drone, onboard, firmware=FIRMWARES[firmware])


def test_the_control_port_dumps_the_configuration(bench: Any) -> None:
    bench.connect()
    tcp = connect(bench, 5559)
    configure(bench, 'CONFIG,"control:altitude_max","2500"')
    bench.say("CTRL,4,0")
    dump = heard(bench, tcp)
    assert bench.state & COMMAND, "set for the time of the transfer"
    bench.tick(3)
    assert not bench.state & COMMAND, "and no longer"
    assert dump.startswith(b"general:num_version_config = 1\ngeneral:num_version_mb = 33\n")
    assert dump.endswith(b"\n\0") and dump.count(b"\0") == 1
    values = dict(line.split(" = ", 1) for line in dump[:-1].decode().splitlines())
    assert values["control:altitude_max"] == "2500"
    assert values["control:euler_angle_max"] == "2.0943999e-01"
    assert values["control:outdoor"] == "FALSE"
    assert values["gps:latitude"] == "5.0000000000000000e+02"
    assert values["general:num_version_soft"] == "2.3.3"
    assert len(values["control:accs_gains"].strip("{} ").split()) == 9
    bench.say("CTRL,4,0")
    assert heard(bench, tcp) == dump, "the connection stays open for more"
    tcp.close()


def test_a_dump_waits_for_the_one_who_wants_it(bench: Any) -> None:
    bench.connect()
    bench.say("CTRL,4,0")
    bench.tick(3)
    tcp = connect(bench, 5559)
    assert heard(bench, tcp).startswith(b"general:")
    tcp.close()


def test_the_control_port_lists_the_sets_of_settings(bench: Any) -> None:
    bench.connect()
    tcp = connect(bench, 5559)
    configure(bench, 'CONFIG,"custom:session_id","1234abcd"')
    configure(
        bench, 'CONFIG_IDS,"1234abcd","00000000","00000000"', 'CONFIG,"custom:session_desc","a session"'
    )  # fmt: skip
    bench.say("CTRL,6,0")
    text = heard(bench, tcp)
    assert b"[sessions]\r00000000,Default session configuration\r1234abcd,a session\r\0" in text
    assert text.index(b"[applis]\r") < text.index(b"[profiles]\r") < text.index(b"[sessions]\r")
    tcp.close()


def test_sets_of_settings_keep_their_values_apart(bench: Any) -> None:
    bench.connect()
    ids = 'CONFIG_IDS,"00000000","{}","00000000"'
    configure(bench, 'CONFIG,"control:euler_angle_max","0.15"')
    configure(bench, 'CONFIG,"custom:profile_id","aaaaaaaa"')
    assert bench.autopilot.limits.tilt_rad == pytest.approx(0.20944), "a new set has the factory's values"
    configure(bench, ids.format("aaaaaaaa"), 'CONFIG,"control:euler_angle_max","0.3"')
    assert bench.autopilot.limits.tilt_rad == pytest.approx(0.3)
    configure(bench, 'CONFIG,"custom:profile_id","00000000"')
    assert bench.autopilot.limits.tilt_rad == pytest.approx(0.15)
    configure(bench, 'CONFIG,"custom:profile_id","aaaaaaaa"')
    assert bench.autopilot.limits.tilt_rad == pytest.approx(0.3)
    configure(bench, 'CONFIG_IDS,"00000000","00000000","00000000"', 'CONFIG,"custom:profile_id","-aaaaaaaa"')
    assert bench.autopilot.limits.tilt_rad == pytest.approx(0.15), "deleted: back to the default set"


def test_hd_video_wants_a_session(bench: Any) -> None:
    configuration = bench.emulator.control.configuration
    bench.connect()
    configure(bench, 'CONFIG,"video:video_codec","131"')
    assert configuration.integer("video:video_codec") == 129
    configure(bench, 'CONFIG_IDS,"00000000","00000000","00000000"', 'CONFIG,"custom:session_id","-all"')
    configure(bench, 'CONFIG_IDS,"00000000","00000000","00000000"', 'CONFIG,"custom:session_id","DEADBEEF"')
    configure(bench, 'CONFIG_IDS,"deadbeef","00000000","00000000"', 'CONFIG,"video:video_codec","131"')
    assert configuration.integer("video:video_codec") == 131


def test_the_first_firmwares_know_no_sets(bench: Any) -> None:
    fit(bench, "ar1-1.5")
    bench.connect()
    configure(bench, 'CONFIG,"custom:session_id","1234abcd"')
    configure(bench, 'CONFIG,"control:euler_angle_max","0.3"')
    assert bench.autopilot.limits.tilt_rad == pytest.approx(0.3)


def test_version_file_by_a_common_ftp_client(bench: Any) -> None:
    lines: list[str] = []
    problems: list[BaseException] = []

    def fetch() -> None:
        try:
            with ftplib.FTP() as ftp:
                ftp.connect(bench.address, 5551, timeout=5)
                ftp.login()
                lines.append(str(ftp.size("version.txt")))
                ftp.retrlines("RETR version.txt", lines.append)
                lines.extend(ftp.nlst())
                with pytest.raises(ftplib.error_perm):
                    ftp.retrbinary("RETR /etc/passwd", lambda _: None)
                ftp.quit()
        except BaseException as error:  # noqa: BLE001  # shown by the test's own thread
            problems.append(error)

    client = threading.Thread(target=fetch, daemon=True)
    client.start()
    for _ in range(2000):
        bench.tick()
        client.join(0.002)
        if not client.is_alive():
            break
    assert not problems, problems
    assert lines == ["6", "2.3.3", "version.txt"]


def test_the_name_alone_logs_in(bench: Any) -> None:
    """Parrot's SDK sends no password: asked for one, it would repeat its USER for ever."""
    with connect(bench, 5551) as tcp:
        assert heard(bench, tcp, b"\r\n").startswith(b"220 ")
        tcp.send(b"USER anonymous\r\n")
        assert heard(bench, tcp, b"\r\n").startswith(b"230 ")
        tcp.send(b"PASV\r\n")
        high, low = heard(bench, tcp, b"\r\n").rpartition(b"(")[2].split(b",")[4:]
        with connect(bench, int(high) * 256 + int(low.split(b")")[0])) as data:
            tcp.send(b"RETR version.txt\r\n")
            assert heard(bench, data, b"\n") == b"2.3.3\n"


def test_a_setting_right_behind_a_dump_is_taken(bench: Any) -> None:
    bench.connect()
    tcp = connect(bench, 5559)
    bench.say("CTRL,5,0")
    bench.say("CTRL,4,0")
    heard(bench, tcp)
    bench.say('CONFIG,"control:altitude_max","1800"')
    bench.tick(3)
    assert bench.autopilot.limits.height_m == 1.8
    assert bench.state & COMMAND
    tcp.close()


def test_old_clients_that_want_the_drones_own_port_get_it(bench: Any) -> None:
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    udp.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    udp.bind(("", 5554))
    udp.setblocking(False)
    udp.sendto(b"\x01\x00\x00\x00", (bench.address, 5554))
    bench.tick(2)
    assert [len(packet) for packet in bench.receive(udp)] == [24]
    udp.close()


def test_pairing_is_answered(bench: Any) -> None:
    bench.at.sendto(b"PARROT AUTH", (bench.address, 5552))
    bench.tick()
    assert bench.receive(bench.at) == [b"PARROT AUTH OK"]


@pytest.mark.parametrize(
    ("firmware", "size", "version"),
    [
        ("ar1-1.7", 1327, "1.7.4"),
        ("ar2-2.2", 1916, "2.2.9"),
        ("ar2-2.3.3", 1924, "2.3.3"),
        ("ar2-2.4-beta", 2384, "2.4.1"),
        ("ar2-2.4.8", 2152, "2.4.8"),
    ],
)
def test_firmwares_have_their_sizes(bench: Any, firmware: str, size: int, version: str) -> None:
    fit(bench, firmware)
    bench.connect()
    bench.keep(0.2)
    assert len(bench.packets[-1]) == size
    assert bench.options(bench.packets[-1])[-1] == (0xFFFF, 8)
    assert bench.emulator.control.configuration.text("general:num_version_soft") == version
    assert struct.unpack_from("<I", bench.packets[-1], size - 4)[0] == sum(bench.packets[-1][:-8])


def test_an_ar_drone_1_flies(bench: Any) -> None:
    fit(bench, "ar1-1.7")
    bench.connect()
    bench.keep(0.2)
    assert bench.demo()[5] == pytest.approx(243, abs=20), "the first generation says its ultrasound on the floor, too"
    bench.keep(6.0, f"REF,{TAKE_OFF}", "PCMD,0,0,0,0,0")
    assert bench.major == 4
    assert not bench.state & 1 << 7, "bit 7 acknowledges trims there"


def test_a_flood_of_commands_is_survived_and_obeyed(bench: Any) -> None:
    bench.fly()
    came = 0
    for _ in range(200):
        for _ in range(95):  # 19,000 a second
            bench.say(f"REF,{LAND}")
        came += len(bench.tick())
    assert came == 200, "navdata goes on"
    assert bench.major == 8 or bench.body.on_ground
    bench.keep(4.0, f"REF,{LAND}")
    assert bench.body.on_ground
    bench.say(f"REF,{TAKE_OFF}")
    bench.tick()
    assert bench.autopilot.motors_on, "what comes after the flood is heard at once"


def test_garbage_on_every_port_changes_nothing(bench: Any) -> None:
    bench.connect()
    tcps = [connect(bench, port) for port in (5551, 5559)]
    for junk in (b"", b"\0" * 2000, bytes(range(256)) * 7, b"AT*", b"AT*REF=", b'AT*CONFIG=1,"', b"\r\n" * 500):
        bench.raw(junk)
        bench.navdata.sendto(junk, (bench.address, 5554))
        bench.at.sendto(junk, (bench.address, 5552))
        for tcp in tcps:
            if junk and tcp.fileno() >= 0:
                try:
                    tcp.send(junk)
                except OSError:
                    tcp.close()
        bench.tick(3)
    bench.keep(0.1)
    assert len(bench.packets[-1]) == 1916 and bench.body.on_ground
    for tcp in tcps:
        tcp.close()
    tcp = connect(bench, 5559)
    bench.say("CTRL,4,0")
    assert heard(bench, tcp).startswith(b"general:")
    tcp.close()


def test_connections_that_pile_up_do_not_shut_the_others_out(bench: Any) -> None:
    idle = [connect(bench, 5559) for _ in range(12)]
    for tcp in idle:
        tcp.close()
    bench.tick(3)
    tcp = connect(bench, 5559)
    bench.connect()
    bench.say("CTRL,4,0")
    assert heard(bench, tcp).endswith(b"\0")
    tcp.close()


def test_closing_gives_all_ports_back(bench: Any) -> None:
    idle = connect(bench, 5559)
    fit(bench, "ar2-2.3")
    bench.connect()
    assert len(bench.packets[-1]) == 1916
    idle.close()
