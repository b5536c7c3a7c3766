"""`groundstation ardrone join` and `setup` against a drone on loopback: settings written, and refusals."""

import click
import pytest
from click.testing import CliRunner

from drivers.ardrone.network_setup import membership, own_hardware_address, pairing
from groundstation.cli.ardrone import ardrone
from groundstation.errors import DriverError

FLY = 1 << 0
OWNER = "02:1a:2b:3c:4d:5e"


def run(*arguments):
    return CliRunner().invoke(ardrone, list(arguments), standalone_mode=False)


def test_a_drone_is_paired_and_its_setting_read_back(drone_alone):
    drone = drone_alone("2.4.8")
    result = run("setup", drone.address, "--owner", OWNER.upper())
    assert result.return_value == 0, result.output
    assert drone.config["network:owner_mac"] == OWNER
    assert f"network:owner_mac {OWNER}: was 00:00:00:00:00:00" in result.output
    assert {name for name, _, _ in drone.lines} <= {"COMWDG", "CTRL", "CONFIG"}, "nothing that moves it"
    again = run("setup", drone.address, "--owner", OWNER)
    assert again.return_value == 0 and "as it was" in again.output
    assert run("setup", drone.address, "--unpair").return_value == 0
    assert drone.config["network:owner_mac"] == "00:00:00:00:00:00"


def test_a_drone_joins_a_network_and_becomes_an_access_point_again(drone_alone):
    drone = drone_alone("2.4.8")
    result = run("join", drone.address, "LAB 2")
    assert result.return_value == 0, result.output
    assert (drone.config["network:ssid_single_player"], drone.config["network:wifi_mode"]) == ("LAB 2", "2")
    assert "off and on again" in result.output
    assert run("join", drone.address, "--access-point").return_value == 0
    assert drone.config["network:wifi_mode"] == "0"


def test_a_setting_that_is_not_taken_is_named(drone_alone):
    drone = drone_alone("2.4.8")
    drone.deaf_to = {"network:owner_mac"}
    result = run("setup", drone.address, "--owner", OWNER)
    assert result.return_value == 1 and "NOT TAKEN" in result.output


def test_a_drone_in_the_air_is_left_alone(drone_alone):
    drone = drone_alone("2.4.8", state=FLY)
    result = run("setup", drone.address, "--owner", OWNER)
    assert result.return_value == 4 and "land it first" in result.output and drone.lines == []


def test_a_drone_without_a_control_port_is_not_changed(drone_alone):
    drone = drone_alone()
    result = run("join", drone.address, "LAB")
    assert result.return_value == 4 and "nothing was changed" in result.output and drone.said("CONFIG") == []


@pytest.mark.parametrize("name", ['a"b', "a,b", "x" * 33, "\r"])
def test_a_network_whose_name_would_break_the_command_is_refused(name):
    with pytest.raises(DriverError, match="cannot be set"):
        membership(name)


def test_a_hardware_address_is_checked_and_loopback_has_none():
    with pytest.raises(DriverError, match="no hardware address"):
        pairing("00:11")
    with pytest.raises(DriverError, match="no hardware address"):
        own_hardware_address("127.0.0.1")


@pytest.mark.parametrize(
    "arguments",
    [("setup", "127.0.0.1"), ("setup", "127.0.0.1", "--pair", "--unpair"), ("join", "127.0.0.1"),
     ("join", "127.0.0.1", "LAB", "--access-point")],
)  # fmt: skip
def test_one_wish_at_a_time(arguments):
    assert isinstance(run(*arguments).exception, click.UsageError)


def test_a_drone_is_trimmed_where_it_stands_and_nowhere_else(drone_alone):
    drone = drone_alone("2.4.8")
    result = run("trim", drone.address)
    assert result.return_value == 0, result.output
    assert len(drone.said("FTRIM")) == 3 and {name for name, _, _ in drone.lines} == {"FTRIM"}
    flying = drone_alone("2.4.8", state=FLY)
    result = run("trim", flying.address)
    assert result.return_value == 4 and "land it first" in result.output and flying.lines == []
