"""The newest telemetry: which states of heartbeats count."""

import pytest

from drivers.mavlink.latest_telemetry import LatestTelemetry
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.telemetry import Heartbeat

S = 1_000_000_000
FLYING = LatestTelemetry(base_mode=129, status=4)


def beat(status, armed=True):
    return Heartbeat(2, 12, 129 if armed else 1, 6 << 16, status)


@pytest.mark.parametrize("status", [7, 8])
def test_the_end_of_a_flight_counts_from_the_second_heartbeat_in_a_row_on(status):
    first = FLYING.after_heartbeat(S, beat(status))
    assert first.status == 4 and first.heartbeat_ns == S
    assert first.after_heartbeat(2 * S, beat(status)).status == status
    assert first.after_heartbeat(S + 50_000_000, beat(status)).status == 4  # the same one, twice received
    calm = first.after_heartbeat(2 * S, beat(4))
    assert calm.after_heartbeat(3 * S, beat(status)).status == 4


def test_the_end_of_a_flight_counts_at_once_with_the_motors_off():
    assert FLYING.after_heartbeat(S, beat(8, armed=False)).status == 8


@pytest.mark.parametrize("status", [9, 255])
def test_a_state_that_does_not_exist_is_refused(status):
    with pytest.raises(WireError):
        FLYING.after_heartbeat(S, beat(status))


def test_the_time_of_its_disarming_is_kept():
    known = FLYING.after_heartbeat(S, beat(4)).after_heartbeat(2 * S, beat(3, armed=False))
    assert known.disarmed_ns == 2 * S
    assert known.after_heartbeat(3 * S, beat(3, armed=False)).disarmed_ns == 2 * S
