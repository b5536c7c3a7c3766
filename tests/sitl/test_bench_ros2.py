"""The bench of the view for ROS 2 shows a whole flight: one that shows less costs less."""

import pytest

pytest.importorskip("rosbags")
from groundstation.bench.ros2 import measure

pytestmark = [pytest.mark.sitl, pytest.mark.slow]


def test_every_topic_is_shown_at_its_rate() -> None:
    figures = measure(4.0)
    # Poses and odometry of three bodies 20 times a second, and 10 pictures of markers.
    assert figures["topics"] >= 20 and 150 < figures["messages_per_s"] < 400
    assert 0.0 < figures["cpu_percent_of_core"] < 100.0
