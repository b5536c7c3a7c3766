"""A file of another program is identified, with the program that opens it; nothing is written from it."""

from pathlib import Path

import pytest

from groundstation.cli.main import run
from groundstation.recording.foreign import kind_of_content

# The first bytes of each format, assembled by hand from its description.
FILES = {
    "lab.pcap": (b"\xd4\xc3\xb2\xa1\x02\x00\x04\x00" + bytes(16), "a network capture; Wireshark opens it"),
    "lab_ns.pcap": (b"\x4d\x3c\xb2\xa1\x02\x00\x04\x00" + bytes(16), "a network capture"),
    "lab.pcapng": (b"\x0a\x0d\x0d\x0a\x1c\x00\x00\x00\x4d\x3c\x2b\x1a" + bytes(16), "a network capture"),
    "flight.ulg": (b"ULog\x01\x12\x35\x01" + bytes(8), "a log of PX4 (ULog)"),
    "00000012.BIN": (b"\xa3\x95\x80\x80\x59FMT\x00BBnNZ", "a log of ArduPilot (DataFlash)"),
    "00000012.log": (b"FMT, 128, 89, FMT, BBnNZ, Type,Length\n", "a log of ArduPilot (DataFlash)"),
    "flight.tlog": ((1_700_000_000_000_000).to_bytes(8) + b"\xfd\x09\x00\x00", "a telemetry log (.tlog)"),
    "day.bag": (b"#ROSBAG V2.0\nE\x00\x00\x00", "a ROS bag"),
    "day_0.db3": (b"SQLite format 3\x00" + bytes(84), "an SQLite database, as in a ROS bag"),
    "flight.rrd": (b"RRF2\x00", "a recording of Rerun"),
    "runs.zip": (b"PK\x03\x04" + bytes(26), "a packed file: unpack it first"),
}


@pytest.mark.parametrize("name", FILES)
def test_a_file_of_another_program_is_named(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    content, what = FILES[name]
    path = tmp_path / name
    path.write_bytes(content)
    for command in (["recording", "info"], ["recording", "recover"], ["replay"], ["export", "--csv"], ["report"]):
        assert run([*command, str(path)]) == 2
        told = capsys.readouterr().err
        assert f"this is {what}" in told and name in told, command
    assert [one.name for one in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("command", [["recording", "info"], ["replay"], ["export", "--csv"]])
def test_a_folder_of_a_bag_is_named(command: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    assert run([*command, str(tmp_path)]) == 2
    assert "this is a ROS bag" in capsys.readouterr().err


def test_a_truncated_file_signature_is_not_identified() -> None:
    assert kind_of_content(b"ULo") == kind_of_content(b"") == kind_of_content(bytes(16)) == ""


def test_a_picture_is_not_taken_of_a_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "flight.ulg"
    path.write_bytes(FILES["flight.ulg"][0])
    assert run(["camera", "view", str(path), "--frames", "1"]) == 4
    assert f"{path}: is no video, picture file or folder of pictures" in capsys.readouterr().err


def test_a_file_that_is_no_field_file_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("lab.pcap").write_bytes(FILES["lab.pcap"][0])
    assert run(["config", "check", "lab.pcap"]) == 2
    said = capsys.readouterr()
    assert "lab.pcap: is a file, but no field file: those end in .yaml" in said.out + said.err
