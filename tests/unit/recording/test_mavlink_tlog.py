"""`export --tlog`: pymavlink's own reader finds the recorded frames, in order and with their times."""

import os

import pytest
from click.testing import CliRunner

from drivers.datagrams import DatagramLog
from drivers.mavlink.wire import telemetry
from drivers.mavlink.wire.frames import FrameEncoder
from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.topics import RAW_RX, RAW_TX
from groundstation.cli.export import export
from groundstation.cli.tlog import write_tlogs
from groundstation.recording.capture import Capture
from groundstation.recording.mcap_file import McapFile
from groundstation.recording.preamble import Preamble
from groundstation.recording.run import open_run
from groundstation.recording.timeline import Timeline

S = 1_000_000_000
OFFSET = 1_700_000_000 * S


def record(folder, *speakers):
    """Write a recording of the messages that the speakers put into the logs of a bus."""
    bus = MemoryBus(MemoryExchange(), "lab", "mavlink")
    queue = bus.subscribe([RAW_RX, RAW_TX])
    for entity, speak in speakers:
        log = DatagramLog(bus, entity)
        speak(log)
        log.flush()
    capture = Capture(Timeline(clock.clock_id(), OFFSET))
    file = McapFile(folder / "raw.mcap", Preamble({"run": {}}, {}, OFFSET))
    for sample in queue.drain_samples():
        entry = capture.entry(sample, S)
        assert entry is not None
        file.write(entry)
    file.close()
    return folder


def copter(log):
    encoder = FrameEncoder(11, 1)
    for second in range(5):
        log.received(second * S, encoder.encode(telemetry.ExtendedSysState(0, second)))
        log.sent(second * S + S // 2, encoder.encode(telemetry.Heartbeat(6, 8, 0, 0, 4)))


def ardrone(log):
    log.received(S, b"\x88\x77\x66\x55 an AR.Drone's")


@pytest.fixture
def run_dir(tmp_path):
    return record(tmp_path, ("drone_2", copter), ("drone_1", ardrone))


def test_tlog_is_read_by_pymavlink(run_dir):
    os.environ["MAVLINK20"] = "1"
    from pymavlink import mavutil

    written = write_tlogs(open_run(run_dir), run_dir)
    assert {path.name: (len(log.frames), log.refused) for path, log in written.items()} == {"drone_2.tlog": (10, {})}
    log = mavutil.mavlink_connection(str(run_dir / "drone_2.tlog"))
    found = []
    while (message := log.recv_match()) is not None:
        found.append((message.get_type(), message._timestamp))
    log.close()
    assert [name for name, _ in found] == ["EXTENDED_SYS_STATE", "HEARTBEAT"] * 5
    assert [stamp - 1_700_000_000 for _, stamp in found] == pytest.approx([n / 2 for n in range(10)], abs=1e-3)


def test_a_vehicle_of_mavlink_1_is_read_too(tmp_path):
    encoder = FrameEncoder(11, 1)
    old = encoder.encode(telemetry.Heartbeat(2, 12, 1, 0, 3), old=True)
    new = encoder.encode(telemetry.ExtendedSysState(0, 1))
    damaged = old[:-1] + bytes([old[-1] ^ 1])

    def vehicle(log):
        for second, datagram in enumerate((old, damaged, old + old[:5], old + new)):
            log.received(second * S, datagram)

    written = write_tlogs(open_run(record(tmp_path, ("drone_2", vehicle))), tmp_path)
    ((path, log),) = written.items()
    assert [frame for _, frame in log.frames] == [old, old, old, new]
    assert log.refused == {"checksum": 1, "truncated": 1}
    from pymavlink import mavutil

    reader = mavutil.mavlink_connection(str(path))
    names = [message.get_type() for message in iter(reader.recv_match, None)]
    reader.close()
    assert names == ["HEARTBEAT"] * 3 + ["EXTENDED_SYS_STATE"]


def test_a_run_without_mavlink_and_a_log_that_exists_are_errors(run_dir, tmp_path):
    assert CliRunner().invoke(export, ["--tlog", str(run_dir)], standalone_mode=False).exit_code == 0
    again = CliRunner().invoke(export, ["--tlog", str(run_dir)], standalone_mode=False)
    assert "exists already" in str(again.exception)
    empty = tmp_path / "empty"
    empty.mkdir()
    McapFile(empty / "raw.mcap", Preamble({"run": {}}, {}, OFFSET)).close()
    result = CliRunner().invoke(export, ["--tlog", str(empty)], standalone_mode=False)
    why = "no MAVLink frames are recorded there: it has no MAVLink vehicle, or recording.raw_datagrams is off"
    assert why in str(result.exception)


def test_noise_that_an_older_version_recorded_is_left_out_and_counted(tmp_path):
    good = FrameEncoder(11, 1).encode(telemetry.Heartbeat(2, 12, 1, 0, 3))
    noise = bytes((0xFD, 1, 0, 0, 9, 11, 1, 0xFF, 0xFF, 0)) + b"abc"

    def noisy(log):
        for datagram in (noise, good + noise + good, good[:-1] + bytes([good[-1] ^ 1]), b"rubbish", good[:9]):
            log.received(S, datagram)

    record(tmp_path, ("drone_2", noisy), ("drone_3", lambda log: log.received(S, noise)))
    result = CliRunner().invoke(export, ["--tlog", str(tmp_path)], standalone_mode=False)
    assert result.exit_code == 0, result.output
    assert (tmp_path / "drone_2.tlog").read_bytes()[8:] == good + (tmp_path / "drone_2.tlog").read_bytes()[:8] + good
    assert not (tmp_path / "drone_3.tlog").exists()
    for line in ("drone_2.tlog: 2 frames", "drone_2: left out: 2 x unknown kind", "drone_2: left out: 1 x checksum",
                 "drone_2: left out: 1 x no frame", "drone_3: left out: 1 x unknown kind"):  # fmt: skip
        assert line in result.output
