"""A Foxglove WebSocket server on loopback with a recording's channels and the scene. Extra [foxglove]."""

import foxglove

from groundstation.bus import codec, keys
from groundstation.bus.api import Sample
from groundstation.engineering_views.foxglove_scene import FoxgloveScene, scene_schema
from groundstation.engineering_views.scene import DRAWN
from groundstation.engineering_views.watch import LiveView
from groundstation.errors import MessageError, OperatorMistake
from groundstation.field.resolved import ResolvedField
from groundstation.recording.capture import Capture, Entry
from groundstation.recording.derived import ViewerChannels
from groundstation.recording.timeline import Timeline
from groundstation.recording.viewers import SCENE_CHANNEL

HOST = "127.0.0.1"
# Largest number of messages that wait for one slow viewer; beyond it the oldest are dropped for this viewer.
_BACKLOG = 512
_DRAWN = frozenset(topic.name for topic in DRAWN)


class FoxgloveView(LiveView):
    """Serves until closed; viewers come and go. It takes no orders: no services, nothing can be published to it."""

    def __init__(self, name: str, field: ResolvedField | None, timeline: Timeline, port: int) -> None:
        self._context = foxglove.Context()
        self._channels: dict[str, foxglove.Channel] = {}
        self._capture = Capture(timeline)
        self._viewers = ViewerChannels(field)
        self._scene = FoxgloveScene(field)
        self._scene_channel = foxglove.Channel(
            SCENE_CHANNEL, schema=scene_schema(), message_encoding="protobuf", context=self._context
        )
        try:
            self._server = foxglove.start_server(
                name=name, host=HOST, port=port, capabilities=[], context=self._context, message_backlog_size=_BACKLOG
            )
        except (RuntimeError, OSError) as error:
            raise OperatorMistake(f"port {port} cannot be served ({error}): choose another with --port") from error

    @property
    def address(self) -> str:
        """Return the address for the viewer's connection dialogue."""
        return f"ws://{HOST}:{self._server.port}"

    @property
    def alive(self) -> bool:
        """Return whether viewers can still connect."""
        return True

    def take(self, sample: Sample, now_ns: int) -> None:
        """Forward a sample that arrived at a boot-clock time."""
        entry = self._capture.entry(sample, now_ns)
        if entry is None:
            return
        self._say(entry)
        for derived in self._viewers.derived(entry):
            self._say(derived)
        if entry.facts["topic"] in _DRAWN:
            self._draw(entry)

    def _say(self, entry: Entry) -> None:
        channel = self._channels.get(entry.channel)
        if channel is None:
            described = entry.description
            schema = foxglove.Schema(
                name=described.schema_name, encoding=described.schema_encoding, data=described.schema
            )
            channel = self._channels[entry.channel] = foxglove.Channel(
                entry.channel,
                schema=schema,
                message_encoding=described.message_encoding,
                context=self._context,
                metadata=entry.facts,
            )
        channel.log(bytes(entry.data), log_time=entry.log_time_ns)

    def _draw(self, entry: Entry) -> None:
        try:
            update = self._scene.take(entry.log_time_ns, codec.decode(keys.parse(entry.channel), entry.data))
        except MessageError:
            return
        if update is not None:
            self._scene_channel.log(update, log_time=entry.log_time_ns)

    def close(self) -> None:
        """Disconnect all viewers."""
        self._server.stop()
