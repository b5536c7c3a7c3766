"""`groundstation export`: recordings in the formats of other programs."""

import base64
import json
import struct
from pathlib import Path

import click

from groundstation.cli.exits import ExitCode
from groundstation.errors import GroundStationError

_MAGIC = 0xFD
_STAMP = struct.Struct(">Q")


@click.command(
    epilog="\b\nExample:\n  groundstation export --tlog runs/20261120T120000Z-mixed-team\n"
    "writes drone_2.tlog, ... beside the recording, for MAVProxy, Mission Planner or QGroundControl."
)
@click.argument("run_dir", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option("--tlog", is_flag=True, help="MAVLink telemetry logs, one for each MAVLink vehicle, both directions.")
def export(run_dir: Path, tlog: bool) -> int:
    """Write what was recorded in RUN_DIR in another format."""
    if not tlog:
        raise click.UsageError("say which format: --tlog")
    written = write_tlogs(run_dir)
    for path, count in written.items():
        click.echo(f"{path}: {count} datagrams")
    if not written:
        raise GroundStationError(f"{run_dir}: no MAVLink datagrams are recorded there (recording.raw_datagrams)")
    return ExitCode.OK


def write_tlogs(run_dir: Path) -> dict[Path, int]:
    """Write one .tlog for each MAVLink vehicle of a run; returns the files and how many datagrams each holds.

    WIRE (.tlog, as pymavlink reads it): UNIX time [us], 8 bytes, big-endian, before each frame.
    """
    from drivers.datagrams import unpack
    from groundstation.bus.topics import RAW_RX, RAW_TX
    from groundstation.recording.reader import open_recording, parts

    frames: dict[str, list[tuple[int, bytes]]] = {}
    for part in parts(run_dir, "raw"):
        recording = open_recording(part)
        for record in recording.raw_records(lambda topic: topic in (RAW_RX, RAW_TX)):
            batch = unpack(base64.b64decode(json.loads(record.data)["data"]))
            if not batch or not batch[0][1] or batch[0][1][0] != _MAGIC:
                continue
            # The message is stamped as its first datagram; the others follow on the same boot clock.
            offset_ns = record.log_time_ns - batch[0][0]
            held = frames.setdefault(record.key.entity, [])
            held += [(stamp_ns + offset_ns, data) for stamp_ns, data in batch]
    written = {}
    for entity, held in sorted(frames.items()):
        path = run_dir / f"{entity}.tlog"
        with path.open("wb") as file:
            for stamp_ns, data in sorted(held, key=lambda pair: pair[0]):
                file.write(_STAMP.pack(max(0, stamp_ns) // 1000) + data)
        written[path] = len(held)
    return written
