"""MAVLink telemetry logs from recorded datagrams, for MAVProxy, Mission Planner or QGroundControl."""

import struct
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from drivers.datagrams import unpack
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.frames import split
from drivers.mavlink.wire.signature import MAGIC, MAGIC_1
from drivers.mavlink.wire.verification import Verifier, old_sender
from groundstation.bus.topics import RAW_RX, RAW_TX
from groundstation.errors import MessageError
from groundstation.recording.compatibility import RecordingError
from groundstation.recording.outputs import new_file, require_absent
from groundstation.recording.reader import payload
from groundstation.recording.run import RecordedRun

_MAGICS = (bytes([MAGIC]), bytes([MAGIC_1]))
_STAMP = struct.Struct(">Q")


@dataclass(slots=True)
class Log:
    """The verified frames of one vehicle with their UNIX times [ns]; refused: counts of all other bytes, by reason."""

    frames: list[tuple[int, bytes]] = field(default_factory=list)
    refused: Counter[str] = field(default_factory=Counter)

    def add(self, stamp_ns: int, datagram: bytes, verifier: Verifier) -> None:
        """Take the frames of a datagram; those that cannot be verified are counted."""
        try:
            for frame in split(datagram, old=True):
                try:
                    if frame[0] == MAGIC_1:
                        old_sender(frame)
                    else:
                        verifier.verify(frame)
                    self.frames.append((stamp_ns, frame))
                except WireError as error:
                    self.refused[error.reason] += 1
        except WireError as error:
            self.refused[error.reason] += 1


def write_tlogs(run: RecordedRun, folder: Path) -> dict[Path, Log]:
    """Write one new .tlog for each MAVLink vehicle of a run; returns their paths and logs.

    Only frames with the right checksum are written, those of MAVLink 1 as well; signatures are not checked, because
    keys are not recorded. An empty log gets no file. Raises RecordingError if all are empty, or a file exists.
    WIRE (.tlog, as pymavlink reads it): UNIX time [us], 8 bytes, big-endian, before each frame.
    """
    logs = _logs(run)
    if not any(log.frames for log in logs.values()):
        why = "it has no MAVLink vehicle, or recording.raw_datagrams is off"
        raise RecordingError(f"{run.paths[0].parent}: no MAVLink frames are recorded there: {why}")
    targets = {folder / f"{entity}.tlog": log for entity, log in sorted(logs.items())}
    for path in targets:
        require_absent(path)
    for path, log in targets.items():
        if log.frames:
            _write(path, log)
    return targets


def _write(path: Path, log: Log) -> None:
    with new_file(path) as partial, partial.open("wb") as file:
        for stamp_ns, frame in sorted(log.frames, key=lambda pair: pair[0]):
            file.write(_STAMP.pack(max(0, stamp_ns) // 1000) + frame)


def _logs(run: RecordedRun) -> dict[str, Log]:
    logs: dict[str, Log] = {}
    verifier = Verifier()
    for record in run.records_from(run.start_ns, lambda topic: topic in (RAW_RX, RAW_TX)):
        try:
            batch = unpack(payload(record)[1])
        except (MessageError, ValueError):
            continue  # damaged inside: its content cannot be distinguished from noise
        if not any(datagram[:1] in _MAGICS for _, datagram in batch):
            continue  # another kind of vehicle
        # The message is stamped as its first datagram; the others follow on the same boot clock.
        offset_ns = record.log_time_ns - batch[0][0]
        log = logs.setdefault(record.key.entity, Log())
        for stamp_ns, datagram in batch:
            log.add(stamp_ns + offset_ns, datagram, verifier)
    return logs
