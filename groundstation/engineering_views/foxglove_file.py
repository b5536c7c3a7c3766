"""A copy of a recording with the scene that Foxglove's and Lichtblick's 3D panel draws."""

from pathlib import Path

from mcap.records import Channel, Schema

from groundstation.engineering_views.extras import require_foxglove
from groundstation.engineering_views.field import field_of
from groundstation.engineering_views.scene import DRAWN
from groundstation.errors import MessageError
from groundstation.recording.copies import Copied, CopyWriter, messages_of, new_copy, preamble_copy
from groundstation.recording.reader import decode, open_recording
from groundstation.recording.rerun import rerun_of
from groundstation.recording.run import RecordedRun
from groundstation.recording.viewers import SCENE_CHANNEL


def write_with_scene(run: RecordedRun, path: Path) -> tuple[int, list[str]]:
    """Write all parts of a run into one new file, with a scene ten times a second; returns the number of scenes.

    The second value names data that could not be decoded. Raises OperatorMistake if the extra is missing or the path
    is wrong or taken, OutputError when the disk refuses.
    """
    require_foxglove()
    opened = open_recording(run.paths[0])
    unread: dict[str, None] = {}
    with new_copy(path, preamble_copy(opened, {"scene": {"channel": SCENE_CHANNEL}})) as writer:
        for index in run.indexes:
            for message in messages_of(index):
                writer.write(message)
        copied = writer.written
        _add_scenes(run, writer, unread)
    return writer.written - copied, list(unread)


def _add_scenes(run: RecordedRun, writer: CopyWriter, unread: dict[str, None]) -> None:
    from groundstation.engineering_views.foxglove_scene import FoxgloveScene, scene_schema

    described = scene_schema()
    schema = Schema(1, described.data, described.encoding, described.name)
    channel = Channel(1, SCENE_CHANNEL, "protobuf", {"derived": "for viewers"}, 1)
    rerun = rerun_of(run.metadata)
    scene = FoxgloveScene(field_of(run.attachments), rerun.mark if rerun else "")
    for raw in run.records_from(run.start_ns, DRAWN.__contains__):
        try:
            update = scene.take(raw.log_time_ns, decode(raw).message)
        except MessageError as error:
            unread[str(error)] = None
            continue
        if update is not None:
            writer.write(Copied(channel, schema, raw.sequence, raw.log_time_ns, raw.publish_time_ns, update))
