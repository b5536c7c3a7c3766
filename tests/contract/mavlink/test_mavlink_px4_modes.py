"""Modes of the emulated PX4, without the driver, as seen on a PX4 1.16 (docs/reference/mavlink.md 2, 5.15)."""

import pytest
from mavlink_bench import Bench

from drivers.mavlink.wire import service as s
from drivers.mavlink.wire import telemetry as t

OFFBOARD, ALTITUDE = 6 << 16, 2 << 16


@pytest.fixture
def bench_of(hand):
    return Bench


def test_an_origin_makes_a_px4_able_to_hold_take_off_and_return(bench_of):
    """As seen on a PX4 1.16 that is fed positions: it then passes its own checks in HOLD, too."""
    bench, nan = bench_of("px4").run(1.0), float("nan")
    assert bench.command(400, 1.0) == 1
    bench.run(1.5).say(s.SetGpsGlobalOrigin(5, 473_977_420, 85_455_940, 488_000))
    assert bench.command(400, 1.0) == 0 and bench.command(400, 0.0) == 0
    bench.up()
    for command, mode in ((20, 5), (22, 2)):
        assert bench.command(command, *[nan] * 7) == 0 and bench.firmware.mode == 4 << 16 | mode << 24
    bench.run(1.5)
    assert bench.copter.airframe.z > 1.5


def test_a_px4_in_flight_refuses_what_it_cannot_fly(bench_of):
    bench = bench_of("px4").up()
    for main, sub, name in ((2, 0, "Altitude"), (3, 0, "Position"), (4, 4, "Mission"), (4, 5, "Return")):
        assert bench.command(176, 1.0, main, sub) == 1 and bench.firmware.mode == OFFBOARD
        assert f"Switching to {name} is currently not available" in bench.run(0.1).texts()
    bench.firmware.transmitter = True
    assert bench.command(176, 1.0, 2.0) == 0 and bench.firmware.mode == ALTITUDE


def test_a_px4_is_in_its_mode_of_before_once_it_has_landed(bench_of):
    bench = bench_of("px4").up()
    assert bench.command(21) == 0
    states = set()
    for _ in range(100):
        bench.run(0.1)
        states |= {(m.base_mode >> 7, m.system_status) for m in bench.heard if isinstance(m, t.Heartbeat)}
    assert bench.firmware.mode == OFFBOARD and not bench.firmware.armed
    assert {(1, 4), (0, 0)} <= states, "active while armed; in OFFBOARD its checks do not pass without setpoints"
