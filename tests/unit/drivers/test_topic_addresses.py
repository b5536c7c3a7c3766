"""Topics in the addresses of ROS 2 sources: names, and never keys that are invalid or match other topics."""

from collections.abc import Callable
from typing import Any

import pytest

from drivers.camera.source_address import parse_source as pictures
from drivers.motion_capture.settings import parse_source as poses
from drivers.target_odometry.settings import parse_source as odometry

PARSERS = [pictures, poses, odometry]


@pytest.mark.parametrize("parse", PARSERS)
@pytest.mark.parametrize(
    "path", ["/a//b", "//a", "/a//", "/od*om", "/*", "/**", "/a/1b", "/a-b", "/$*", "/a%2Ab", "/ä"]
)
def test_what_is_no_name_of_a_topic_is_refused_with_the_rule(parse: Callable[[str], Any], path: str) -> None:
    with pytest.raises(ValueError, match="is no name of ROS 2: letters, digits and _ between single slashes"):
        parse(f"ros2://127.0.0.1{path}?domain=5")


@pytest.mark.parametrize("parse", PARSERS)
@pytest.mark.parametrize("path", ["/odom", "/odom/", "/robot_1/Wheel_2/odom"])
def test_names_of_topics_are_taken(parse: Callable[[str], Any], path: str) -> None:
    address = parse(f"ros2://127.0.0.1{path}")
    assert getattr(address, "topic", getattr(address, "path", "")) == path.strip("/")


def test_poses_may_have_no_common_prefix() -> None:
    assert poses("ros2://127.0.0.1").path == poses("ros2://127.0.0.1/").path == ""
