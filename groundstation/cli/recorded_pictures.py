"""Pictures of a recorded camera, as commands take them that look through one."""

from collections.abc import Iterator

import cv2
import numpy as np

from drivers.camera.calibration.feed import SourcePicture
from groundstation.bus.topics import IMAGE
from groundstation.errors import GroundStationError, MessageError
from groundstation.recording.reader import payload
from groundstation.recording.run import RecordedRun
from groundstation.time_units import NS_PER_S


def recorded_pictures(run: RecordedRun, camera: str) -> Iterator[SourcePicture]:
    """Yield each picture of a camera, oldest first; raises GroundStationError where none is in the recording."""
    count = 0
    for record in run.records_from(0, lambda topic: topic is IMAGE):
        if record.key.entity != camera:
            continue
        try:
            _, jpeg = payload(record)
            grey = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE) if jpeg else None
        except (MessageError, cv2.error):
            continue
        if grey is not None:
            at_s = (record.log_time_ns - run.start_ns) / NS_PER_S
            yield SourcePicture(f"{count:05d}", np.asarray(grey, dtype=np.uint8), at_s)
            count += 1
    if not count:
        raise GroundStationError("no picture of it is in the recording (name the run's folder)")
