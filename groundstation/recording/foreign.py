"""Recognises files of other programs by their first bytes, and names the program that opens them.

WIRE: the marks are those of pcap and pcapng (IETF drafts opsawg-pcap, opsawg-pcapng), ULog (PX4 user guide),
ArduPilot's DataFlash (AP_Logger), rosbag 2.0 and SQLite.
"""

from pathlib import Path

LONGEST = 16
_CAPTURE = "a network capture; Wireshark opens it. A run records its vehicles' datagrams (recording.raw_datagrams)"
_DATAFLASH = "a log of ArduPilot (DataFlash); UAV Log Viewer and mavlogdump.py open it"
_BAG = "a ROS bag; PlotJuggler and Foxglove open it. `groundstation export --rosbag2` makes one of a run"
_PACKED = "a packed file: unpack it first"
_FORMS: tuple[tuple[bytes, str], ...] = (
    *(
        (magic, _CAPTURE)
        for magic in (b"\xd4\xc3\xb2\xa1", b"\xa1\xb2\xc3\xd4", b"\x4d\x3c\xb2\xa1", b"\xa1\xb2\x3c\x4d")
    ),
    (b"\x0a\x0d\x0d\x0a", _CAPTURE),
    (b"ULog\x01\x12\x35", "a log of PX4 (ULog); PX4's Flight Review and PlotJuggler open it"),
    (b"\xa3\x95\x80", _DATAFLASH),
    (b"FMT, ", _DATAFLASH),
    (b"#ROSBAG V", _BAG),
    (b"SQLite format 3\x00", f"an SQLite database, as in {_BAG}"),
    (b"RRF", "a recording of Rerun; `rerun FILE` opens it"),
    *(
        (magic, _PACKED)
        for magic in (b"\x1f\x8b", b"PK\x03\x04", b"BZh", b"\xfd7zXZ\x00", b"\x28\xb5\x2f\xfd", b"7z\xbc\xaf")
    ),
)
_TLOG = "a telemetry log (.tlog); Mission Planner, QGroundControl and mavlogdump.py open it"
# UNIX time [us] of the years 2001 to 2100.
_TLOG_TIMES = (978_307_200_000_000, 4_102_444_800_000_000)


def kind_of_content(start: bytes) -> str:
    """Return a file's kind and the program that opens it, by its first LONGEST bytes; "" if it is not known."""
    for mark, what in _FORMS:
        if start.startswith(mark):
            return what
    # WIRE (.tlog): UNIX time [us], 8 bytes, big-endian, before each frame of MAVLink 1 (FE) or 2 (FD).
    if start[8:9] in (b"\xfe", b"\xfd") and _TLOG_TIMES[0] <= int.from_bytes(start[:8]) <= _TLOG_TIMES[1]:
        return _TLOG
    return ""


def kind_of_folder(folder: Path) -> str:
    """Return the kind of a folder without a recording, or "" if it is not known."""
    # WIRE (rosbag2): beside its parts, a bag's folder has this file.
    return _BAG if (folder / "metadata.yaml").is_file() else ""


def kind_of_file(path: Path) -> str:
    """Return a file's kind and the program that opens it, or "" if it is not known or cannot be read."""
    try:
        with path.open("rb") as stream:
            return kind_of_content(stream.read(LONGEST))
    except OSError:
        return ""
