"""The layouts for RViz and Foxglove name the topics of a flight in the shipped field, with the right types."""

import json
from collections.abc import Iterator
from typing import Any

import pytest
from ruamel.yaml import YAML

pytest.importorskip("rosbags")
from groundstation.bench.console import field_of
from groundstation.bus import codec as bus_codec
from groundstation.bus import keys
from groundstation.engineering_views.ros2 import LAYOUTS
from groundstation.engineering_views.ros2.codec import Ros2Codec
from groundstation.engineering_views.ros2.scene import SHOWN, Ros2Scene
from groundstation.recording.synthetic import DRONES, SyntheticRun

RVIZ = {
    "MarkerArray": "visualization_msgs/msg/MarkerArray",
    "Odometry": "nav_msgs/msg/Odometry",
    "Image": "sensor_msgs/msg/CompressedImage",
}
FOXGLOVE = {
    "imageTopic": "sensor_msgs/msg/CompressedImage",
    "calibrationTopic": "sensor_msgs/msg/CameraInfo",
    "DiagnosticSummary": "diagnostic_msgs/msg/DiagnosticArray",
    "RosOut": "rcl_interfaces/msg/Log",
    "Plot": "sensor_msgs/msg/BatteryState",
}


@pytest.fixture(scope="module")
def said() -> dict[str, str]:
    """Return the type by topic of all messages of a synthetic run."""
    scene, found = Ros2Scene(Ros2Codec(), field_of(DRONES, 8765)), dict[str, str]()
    for stamp_ns, sample in SyntheticRun().samples(0.0, 1.0):
        key = keys.parse(sample.key)
        if key.topic not in SHOWN:
            continue
        if key.topic.type is None:
            messages = scene.take_picture(stamp_ns, key.entity, sample.payload)
        else:
            messages = scene.take(stamp_ns, bus_codec.decode(key, sample.payload))
        found.update((message.topic, message.type) for message in messages)
    return found


def test_rviz_shows_topics_as_what_they_are(said: dict[str, str]) -> None:
    layout = YAML(typ="safe").load(LAYOUTS / "skein.rviz")
    manager = layout["Visualization Manager"]
    assert manager["Global Options"]["Fixed Frame"] == "world"
    shown = [one for one in manager["Displays"] if "Topic" in one]
    assert len(shown) >= 6
    for display in shown:
        assert said[display["Topic"]["Value"]] == RVIZ[display["Class"].rpartition("/")[2]]


def shown_by(name: str, panel: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield (topic, type) of a panel's content."""
    kind = name.partition("!")[0]
    yield from ((topic, FOXGLOVE[role]) for role, topic in panel.get("imageMode", {}).items())
    if "topicToRender" in panel:
        yield panel["topicToRender"], FOXGLOVE[kind]
    for path in panel.get("paths", ()):
        yield path["value"].partition(".")[0], FOXGLOVE[kind]


def places(node: Any) -> Iterator[str]:
    """Yield the panels of a layout's tree."""
    if isinstance(node, str):
        yield node
    else:
        yield from places(node["first"])
        yield from places(node["second"])


def test_foxglove_shows_topics_as_what_they_are(said: dict[str, str]) -> None:
    layout = json.loads((LAYOUTS / "skein.foxglove.json").read_text(encoding="utf-8"))
    panels = layout["configById"]
    assert sorted(places(layout["layout"])) == sorted(panels)
    for name, panel in panels.items():
        assert set(panel.get("topics", ())) <= set(said)
        for topic, kind in shown_by(name, panel):
            assert said[topic] == kind
