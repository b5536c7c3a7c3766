"""A recorded run as an .rrd file for the Rerun viewer."""

from pathlib import Path

from groundstation.engineering_views.extras import require_rerun
from groundstation.engineering_views.field import field_of
from groundstation.errors import MessageError, OperatorMistake
from groundstation.recording.file_topics import is_picture
from groundstation.recording.outputs import OutputError, new_file
from groundstation.recording.part_names import shown
from groundstation.recording.reader import decode, payload
from groundstation.recording.rerun import rerun_of
from groundstation.recording.run import RecordedRun

APPLICATION = "skein"


def write_rrd(run: RecordedRun, path: Path) -> tuple[int, list[str]]:
    """Write a new .rrd file; returns the number of messages shown, and data that could not be decoded.

    Raises OperatorMistake when the extra is not installed or the place is wrong or taken, OutputError when the disk
    refuses.
    """
    require_rerun()
    if shown(path) != str(path):
        raise OperatorMistake(f"{shown(path)}: is no UTF-8 text, as Rerun asks of a file's name; name another place")
    with new_file(path) as partial:
        partial.touch()  # the library itself would only log that it cannot write
        return _write(run, partial)


def _write(run: RecordedRun, path: Path) -> tuple[int, list[str]]:
    import rerun as rr

    from groundstation.engineering_views.rerun_scene import RerunScene, blueprint

    field = field_of(run.attachments)
    unread: dict[str, None] = {}
    count = 0
    name, rerun = shown(run.paths[0].parent.name), rerun_of(run.metadata)
    stream = rr.RecordingStream(APPLICATION, recording_id=f"{name}-{run.start_ns}")
    stream.save(path, default_blueprint=blueprint(field))
    stream.send_recording_name(f"{name}: {rerun.mark}" if rerun else name)
    scene = RerunScene(stream, field, run.start_ns, rerun.mark if rerun else "")
    for raw in run.records_from(run.start_ns, lambda topic: topic.type is not None or is_picture(topic)):
        try:
            if raw.key.topic.type is None:
                scene.take_picture(raw.log_time_ns, raw.key.entity, raw.key.topic, payload(raw)[1])
            else:
                scene.take(raw.log_time_ns, decode(raw).message)
        except MessageError as error:
            unread[str(error)] = None
            continue
        count += 1
    try:
        stream.flush()
    except RuntimeError as error:  # the library names neither path nor cause
        raise OutputError(f"{path.parent}: the file cannot be written ({error}); is the disk full?") from error
    finally:
        stream.disconnect()
    return count, list(unread)
