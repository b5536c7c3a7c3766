"""A recorded run as a rosbag2 folder (MCAP, profile ros2) that ROS 2 tools open."""

from pathlib import Path
from typing import Literal

from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer

from groundstation.engineering_views.field import field_of
from groundstation.engineering_views.ros2.codec import Ros2Codec, RosMessage
from groundstation.engineering_views.ros2.scene import SHOWN, Ros2Scene
from groundstation.errors import MessageError
from groundstation.recording.outputs import unmade_folder
from groundstation.recording.reader import decode, payload
from groundstation.recording.run import RecordedRun

# WIRE: Humble reads no QoS of metadata 9 (ros2/rosbag2 issue 2013); all later distributions read 8.
_VERSION: Literal[8] = 8
_DISTRIBUTION = "jazzy"
_FOR_EVER = QosTime(9223372036, 854775807)
_VOLATILE = Qos(
    QosHistory.KEEP_LAST,
    10,
    QosReliability.RELIABLE,
    QosDurability.VOLATILE,
    _FOR_EVER,
    _FOR_EVER,
    QosLiveliness.AUTOMATIC,
    _FOR_EVER,
    avoid_ros_namespace_conventions=False,
)
# WIRE: tf2 takes static frames of no other publisher (ros2/rviz issue 916); `ros2 bag play` offers these QoS.
_OFFERED = {"/tf_static": _VOLATILE._replace(depth=1, durability=QosDurability.TRANSIENT_LOCAL)}


def write_bag(run: RecordedRun, folder: Path) -> tuple[int, list[str]]:
    """Write a new folder; returns its number of ROS 2 messages, and data that could not be decoded.

    Raises OperatorMistake when the folder exists or cannot be there, OutputError when the disk refuses.
    """
    codec = Ros2Codec(_DISTRIBUTION)
    scene = Ros2Scene(codec, field_of(run.attachments))
    unread: dict[str, None] = {}
    with unmade_folder(folder), Writer(folder, version=_VERSION, storage_plugin=StoragePlugin.MCAP) as writer:
        bag = _Bag(writer, codec)
        bag.write(run.start_ns, scene.static(run.start_ns))
        for raw in run.records_from(run.start_ns, lambda topic: topic in SHOWN):
            try:
                if raw.key.topic.type is None:
                    found = scene.take_picture(raw.log_time_ns, raw.key.entity, payload(raw)[1])
                else:
                    found = scene.take(raw.log_time_ns, decode(raw).message)
            except MessageError as error:
                unread[str(error)] = None
                continue
            for message in found:
                bag.write(raw.log_time_ns, message)
    return bag.written, list(unread)


class _Bag:
    def __init__(self, writer: Writer, codec: Ros2Codec) -> None:
        self._writer, self._codec = writer, codec
        self._connections: dict[str, Connection] = {}
        self.written = 0

    def write(self, stamp_ns: int, message: RosMessage) -> None:
        """Write one message at a Unix time."""
        connection = self._connections.get(message.topic)
        if connection is None:
            connection = self._connections[message.topic] = self._writer.add_connection(
                message.topic,
                message.type,
                typestore=self._codec.store,
                offered_qos_profiles=[_OFFERED.get(message.topic, _VOLATILE)],
            )
        self._writer.write(connection, stamp_ns, message.data)
        self.written += 1
