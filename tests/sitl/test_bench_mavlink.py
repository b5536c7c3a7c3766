"""The bench of many MAVLink vehicles really flies them; if the driver landed them, it would measure something else."""

import pytest

from groundstation.bench.mavlink import measure

pytestmark = pytest.mark.slow


def test_its_vehicles_stay_in_track_and_each_setpoint_goes_out_at_once():
    figures = measure("pymavlink", count=2, seconds=2.0)
    assert figures["frames_per_s"] > 200
    # A setpoint delayed to the next turn of 50 ms would be 25 ms old in the median.
    assert figures["setpoint_to_wire_ms"]["p50"] < 15.0
