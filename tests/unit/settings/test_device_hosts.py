"""Devices on another host: their start, the right to publish as them, and refusals."""

import json
from pathlib import Path

import pytest

from groundstation.bus.access import publishable
from groundstation.bus.roles import Role
from groundstation.bus.topics import OBSERVATION, ODOMETRY, SETPOINT
from groundstation.errors import OperatorMistake, SettingsError
from groundstation.flight.composition import device_rows, hosts_of, members_on, process_table, simulated
from groundstation.settings.load import load_field
from groundstation.settings.schema import Field
from groundstation.supervisor import site
from groundstation.supervisor.network import Network

LAB = Path(__file__).parents[2] / "fixtures" / "field" / "lab.yaml"
LISTEN = "bus.listen=10.77.0.1"
ELSEWHERE = (LISTEN, "drones.drone_1.host=pc_2", "cameras.ceiling.host=pc_2")


@pytest.fixture
def field(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Field:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    loaded = load_field(LAB, ELSEWHERE)
    site.found(loaded.site)
    site.admit(loaded.site, "pc_2", "tls/10.77.0.1:4717", tmp_path / "admission")
    return loaded


def test_a_liaison_stands_for_the_devices_of_another_host(field: Field, tmp_path: Path) -> None:
    here = {row.name for row in process_table(field, "tls/127.0.0.1:1", tmp_path, simulation=None, monitor=False)}
    there = {row.name for row in device_rows(field, "pc_2")}
    assert there == {"drone_1", "drone_1_camera", "ceiling"} and hosts_of(field) == ("pc_2",)
    assert not there & here and {"liaison_pc_2", "drone_2", "drone_2_camera"} <= here


def test_the_other_host_makes_the_same_rows_of_the_field_that_it_is_sent(field: Field, tmp_path: Path) -> None:
    table = process_table(field, "tls/127.0.0.1:1", tmp_path, simulation=None, monitor=False)
    section = json.loads(next(row.section for row in table if row.role == "liaison"))
    sent = Field.model_validate_json(section["field"])
    assert device_rows(sent, section["host"]) == device_rows(field, "pc_2")
    assert device_rows(sent, "pc_2")[0].failsafe_datagrams is not None


def test_a_host_may_speak_as_itself_and_its_devices_and_as_nobody_else(field: Field) -> None:
    members = members_on("pc_2", field)
    assert {(member.name, member.role) for member in members} == {
        ("host-pc_2", Role.HOST),
        ("host-pc_2", Role.DRIVER),
        ("host-pc_2", Role.CAMERA),
    }
    said = {key.split("/", 3)[3] for member in members for key in publishable("lab", member)}
    assert f"drone_1/{ODOMETRY.name}/drone_1" in said and f"ceiling/{OBSERVATION.name}/ceiling" in said
    assert not any("drone_2" in key or f"/{SETPOINT.name}/" in key for key in said)


def test_a_host_that_is_not_admitted_runs_no_process(field: Field, tmp_path: Path) -> None:
    site.expel(field.site, "pc_2")
    with pytest.raises(OperatorMistake, match=r"site admit .* pc_2 10\.77\.0\.1"):
        process_table(field, "tls/127.0.0.1:1", tmp_path, simulation=None, monitor=False)


def test_emulated_devices_of_another_host_are_where_it_can_reach_them(field: Field) -> None:
    there = simulated(field, Network("127.64.9", -1, 4717, 8080, "10.78.0"))
    assert there.drones["drone_1"].address == "10.78.0.11"
    assert there.drones["drone_2"].address == "127.64.9.12"
    assert there.cameras["ceiling"].source.startswith("http://10.78.0.50:8080/")
    with pytest.raises(OperatorMistake, match="--network"):
        simulated(field, Network("127.64.9", -1, 4717, 8080))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (ELSEWHERE[1:], "host: needs bus.listen"),
        ((LISTEN, "drones.drone_1.host=drone_2"), "must not be called as a device"),
        ((LISTEN, "cameras.ceiling.host=pc_2", "cameras.ceiling.source=http://a:b@10.0.0.1/x"), "with a password"),
        ((LISTEN, "drones.drone_1.host=PC"), "drones.drone_1.host"),
    ],
)
def test_invalid_host_settings_are_refused_with_a_remedy(options: tuple[str, ...], words: str) -> None:
    with pytest.raises(SettingsError, match=words):
        load_field(LAB, options)


def test_vehicles_of_one_address_and_cameras_of_one_name_may_be_on_different_hosts() -> None:
    same = ("drones.drone_1.address=192.168.1.1", "drones.drone_2.address=192.168.1.1")
    videos = [f"drones.{name}.camera.source=ardrone://192.168.1.1" for name in ("drone_1", "drone_2")]
    loaded = load_field(LAB, (LISTEN, *same, *videos, "drones.drone_2.host=pc_2"))
    assert {drone.address for drone in loaded.drones.values()} == {"192.168.1.1"}
