"""The bench of the ROS 2 view shows a whole flight; showing less would cost less."""

import pytest

pytest.importorskip("rosbags")
from groundstation.bench.ros2 import measure

pytestmark = [pytest.mark.sitl, pytest.mark.slow]


def test_every_topic_is_shown_at_its_rate() -> None:
    figures = measure(4.0)
    # Frames, and poses and odometry of three bodies, ten times a second.
    assert figures["topics"] >= 20 and 100 < figures["messages_per_s"] < 250
    assert 0.0 < figures["cpu_percent_of_core"] < 100.0
