"""MAVLink telemetry logs from recorded datagrams, for MAVProxy, Mission Planner or QGroundControl."""

import struct
from pathlib import Path

from drivers.datagrams import unpack
from groundstation.bus.topics import RAW_RX, RAW_TX
from groundstation.errors import MessageError
from groundstation.recording.origin import RecordingError
from groundstation.recording.outputs import new_file, require_absent
from groundstation.recording.reader import payload
from groundstation.recording.run import RecordedRun

_MAGIC = 0xFD
_STAMP = struct.Struct(">Q")
_Frames = list[tuple[int, bytes]]


def write_tlogs(run: RecordedRun, folder: Path) -> dict[Path, int]:
    """Write one new .tlog for each MAVLink vehicle of a run; returns the files and how many datagrams each holds.

    Raises RecordingError when there is nothing to write, or a file exists.
    WIRE (.tlog, as pymavlink reads it): UNIX time [us], 8 bytes, big-endian, before each frame.
    """
    frames = _frames(run)
    if not frames:
        raise RecordingError(
            f"{run.paths[0].parent}: no MAVLink datagrams are recorded there (recording.raw_datagrams)"
        )
    targets = {entity: folder / f"{entity}.tlog" for entity in sorted(frames)}
    for path in targets.values():
        require_absent(path)
    for entity, path in targets.items():
        with new_file(path) as partial, partial.open("wb") as file:
            for stamp_ns, data in sorted(frames[entity], key=lambda pair: pair[0]):
                file.write(_STAMP.pack(max(0, stamp_ns) // 1000) + data)
    return {path: len(frames[entity]) for entity, path in targets.items()}


def _frames(run: RecordedRun) -> dict[str, _Frames]:
    frames: dict[str, _Frames] = {}
    for record in run.records_from(run.start_ns, lambda topic: topic in (RAW_RX, RAW_TX)):
        try:
            batch = unpack(payload(record)[1])
        except (MessageError, ValueError):
            continue  # damaged inside: nothing of it can be told from noise
        if not batch or not batch[0][1] or batch[0][1][0] != _MAGIC:
            continue
        # The message is stamped as its first datagram; the others follow on the same boot clock.
        offset_ns = record.log_time_ns - batch[0][0]
        frames.setdefault(record.key.entity, []).extend((stamp + offset_ns, data) for stamp, data in batch)
    return frames
