"""Pictures of a recorded camera, for commands that look through cameras."""

from collections.abc import Iterator

from drivers.camera.calibration.feed import SourcePicture, decoded
from groundstation.bus.topics import IMAGE
from groundstation.errors import GroundStationError, MessageError
from groundstation.recording.reader import payload
from groundstation.recording.run import RecordedRun
from groundstation.time_units import NS_PER_S


def recorded_pictures(run: RecordedRun, camera: str) -> Iterator[SourcePicture]:
    """Yield each picture of a camera, oldest first; raises GroundStationError if the recording has none."""
    count = 0
    for record in run.records_from(0, lambda topic: topic is IMAGE):
        if record.key.entity != camera:
            continue
        try:
            _, jpeg = payload(record)
        except MessageError:
            continue
        if (grey := decoded(jpeg)) is not None:
            yield SourcePicture(f"{count:05d}", grey, (record.log_time_ns - run.start_ns) / NS_PER_S)
            count += 1
    if not count:
        raise GroundStationError("no picture of it is in the recording (name the run's folder)")
