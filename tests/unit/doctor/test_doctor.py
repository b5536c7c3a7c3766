"""Findings of the doctor on deficient machines."""

import json
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from groundstation.cli.doctor import doctor
from groundstation.doctor import load, network, processor, storage
from groundstation.doctor.finding import Level

CONFIG = Path(__file__).parents[3] / "config"


def test_one_core_is_too_few_and_two_are_few(monkeypatch: pytest.MonkeyPatch) -> None:
    for count, level in ((1, Level.MUST), (2, Level.SHOULD), (8, Level.OK)):
        monkeypatch.setattr("os.sched_getaffinity", lambda _pid, n=count: set(range(n)))
        assert processor.cores().level is level


def test_a_load_is_told_with_the_busiest_programs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.sched_getaffinity", lambda _pid: {0, 1})
    with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as busy:
        try:
            for mean, level in ((9.0, Level.SHOULD), (0.1, Level.OK)):
                monkeypatch.setattr("os.getloadavg", lambda m=mean: (m, 0.0, 0.0))
                finding = load.load()
                assert finding.level is level and finding.found.startswith(f"{mean} on 2 cores; busiest now: ")
        finally:
            busy.kill()
    monkeypatch.setattr(load, "_used_s", lambda: {1: 0.0})
    assert load.load(lambda _s: None).found == "0.1 on 2 cores"


def test_a_missing_right_is_named_with_its_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processor, "go_first", lambda: False)
    finding = processor.real_time_right()
    assert finding.level is Level.SHOULD and "rtprio" in finding.remedy
    monkeypatch.setattr(processor, "go_first", lambda: True)
    assert processor.real_time_right().remedy == ""


def test_clock_and_governor_are_read_where_there_are_any(tmp_path: Path) -> None:
    said = tmp_path / "said"
    assert processor.clock_source(said) is None and processor.governor(said) is None
    said.write_text("hpet\n")
    slow = processor.clock_source(said)
    assert slow is not None and slow.level is Level.SHOULD
    said.write_text("powersave\n")
    saving = processor.governor(said)
    assert saving is not None and "performance" in saving.remedy


def test_a_full_disk_must_be_mended(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for free, level in ((5e8, Level.MUST), (2e9, Level.SHOULD), (9e9, Level.OK)):
        monkeypatch.setattr(storage, "free_bytes", lambda _folder, n=free: int(n))
        assert storage.room(tmp_path / "not" / "there").level is level


def test_recordings_need_a_folder_not_a_file(tmp_path: Path) -> None:
    file, dangling = tmp_path / "runs", tmp_path / "link"
    file.write_text("")
    dangling.symlink_to(tmp_path / "unplugged")
    for place, named in ((file, file), (file / "of" / "lab", file), (dangling, dangling)):
        finding = storage.room(place)
        assert finding.level is Level.MUST and finding.found.startswith(f"{named} is no folder") and finding.remedy


def test_the_probe_of_the_disk_leaves_nothing_behind(tmp_path: Path) -> None:
    assert "MB/s" in storage.speed(tmp_path / "runs").found
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_refuses_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def refuse(_path: Path) -> float:
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(storage, "_write", refuse)
    finding = storage.speed(tmp_path)
    assert finding.level is Level.MUST and "Read-only file system" in finding.found


def test_a_port_in_use_is_named() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        number = server.getsockname()[1]
        taken = network.port(number, "console")
    assert taken.level is Level.SHOULD and f"{number}" in taken.remedy
    assert network.port(number, "console").level is Level.OK


@pytest.mark.parametrize(
    ("script", "level", "found"),
    [
        ("echo 'Power save: on'", Level.SHOULD, "power saving on"),
        ("echo 'Power save: off'", Level.OK, "power saving off"),
        (
            "echo 'command failed: No such device (-19)' >&2; exit 237",
            Level.SHOULD,
            "not known: command failed: No such",
        ),
        ("echo 'Power save: off'; exit 1", Level.SHOULD, "not known"),
        ("exit 0", Level.SHOULD, "not known: iw ends with 0"),
        ("echo 'Usage: iw [options] command'", Level.SHOULD, "not known: Usage"),
    ],
)
def test_each_adapter_that_sleeps_or_may_is_named(tmp_path: Path, script: str, level: Level, found: str) -> None:
    (tmp_path / "wlan7" / "wireless").mkdir(parents=True)
    (tmp_path / "eth0").mkdir()
    program = tmp_path / "iw"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    (asleep,) = network.power_saving(tmp_path, str(program))
    assert asleep.level is level and found in asleep.found
    assert asleep.remedy == ("" if level is Level.OK else "iw dev wlan7 set power_save off")
    (unknown,) = network.power_saving(tmp_path, str(tmp_path / "no-iw"))
    assert "not installed" in unknown.found


def test_the_command_prints_findings_and_fails_on_a_must(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(storage, "free_bytes", lambda _folder: 10)
    result = CliRunner().invoke(doctor, ["lab", "--json"], standalone_mode=False)
    found = {entry["subject"]: entry for entry in json.loads(result.output)}
    assert result.return_value == 1 and found["disk"]["level"] == "MUST" and found["disk"]["remedy"]


def test_ports_at_which_drivers_wait_for_their_vehicles_are_tried(tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        place = taken.getsockname()
        held = network.datagram_port(place, "drone_2")
        assert held.level is Level.SHOULD and held.subject == "port of drone_2" and "ss -lunp" in held.remedy
    assert network.datagram_port(place, "drone_2").level is Level.OK


def test_router_and_waiting_drivers_of_the_field_are_listed(tmp_path: Path) -> None:
    text = (CONFIG / "mixed-team.yaml").read_text()
    waits = text.replace(
        "{flavour: ardupilot,", "{flavour: ardupilot, listen: true, local_address: 127.0.0.1, port: 14559,"
    )
    (tmp_path / "team.yaml").write_text(waits)
    (tmp_path / "cameras").symlink_to(CONFIG / "cameras")
    answer = CliRunner().invoke(doctor, [str(tmp_path / "team.yaml"), "--json"])
    told = {one["subject"]: one["found"] for one in json.loads(answer.output)}
    assert "is free" in told["port of drone_3"] and told["port of drone_3"].startswith("14559")
    assert "port of the router" in told and "port of drone_2" not in told
