"""`groundstation ardrone probe` against a drone on loopback: its output, and the commands that it must never send."""

import json
import time

import click
import pytest
from click.testing import CliRunner

from groundstation.cli.ardrone import ardrone

FLY, DEMO, COM_WATCHDOG, VBAT_LOW = 1 << 0, 1 << 10, 1 << 30, 1 << 15


def probe(*arguments):
    return CliRunner().invoke(ardrone, ["probe", *arguments], standalone_mode=False)


def test_a_standing_drone_tells_everything(drone_alone):
    drone = drone_alone("2.4.8")
    drone.config = {
        "control:altitude_max": "3000",
        "control:euler_angle_max": "2.0943999e-01",
        "general:com_watchdog": "60",
    }
    result = probe(drone.address, "--json")
    assert result.return_value == 0, result.output
    facts = json.loads(result.output)
    assert (facts["model"], facts["firmware"], facts["serial"]) == ("AR.Drone 2.0", "2.4.8", "PS721000AB2L01234")
    assert facts["battery"] == 0.8 and facts["phase"] == "LANDED"
    assert facts["config"]["control:altitude_max"] == {"value": "3000", "category": "common"}
    assert facts["config"]["control:euler_angle_max"]["category"] == "profiles"
    assert facts["config"]["control:accs_gains"]["value"] == "{ 1.0000000e+00 0.0000000e+00 0.0000000e+00 }"
    assert facts["navdata"][-1]["rate_hz"] > 100 and facts["navdata"][-1]["link_quality"] == 1.0
    assert any("access point of its own" in hint for hint in facts["hints"])
    assert any("flies on for 60 s before it lands" in hint for hint in facts["hints"])
    assert {name for name, _, _ in drone.lines} <= {"COMWDG", "CTRL", "CONFIG"}
    assert {key for key in drone.said("CONFIG") if "navdata_demo" not in key} == set()
    assert drone.config["general:navdata_demo"] == "FALSE"


def test_a_drone_in_the_air_hears_no_command_at_all(drone_alone):
    drone = drone_alone("2.3.3", state=FLY | VBAT_LOW)
    result = probe(drone.address)
    assert result.return_value == 0 and drone.lines == [], "not even its watchdog is fed"
    assert "flying" in result.output and "BATTERY TOO LOW" in result.output
    assert "hint: in flight" in result.output and "hint: charge" in result.output
    assert "firmware 2.3.3" in result.output, "over FTP, which touches no flight"


def test_a_drone_that_somebody_uses_keeps_its_kind_of_navdata(drone_alone):
    drone = drone_alone(state=DEMO)
    result = probe(drone.address, "--json")
    facts = json.loads(result.output)
    assert [stream["mode"] for stream in facts["navdata"]] == ["demo"] and drone.said("CONFIG") == []
    assert "its control port (TCP 5559) gives no configuration" in facts["hints"]


@pytest.mark.parametrize("address", ["nonsense", "192.168.1", "300.1.1.1", "::1", ""])
def test_a_bad_address_is_a_mistake_of_the_operator(address):
    result = probe(address)
    assert isinstance(result.exception, click.BadParameter) and "no IPv4 address" in str(result.exception)


def test_silence_is_named_within_3_s():
    began = time.monotonic()
    result = probe("127.9.9.9")
    assert result.return_value == 4 and time.monotonic() - began < 3.0
    assert "no AR.Drone answers at 127.9.9.9" in result.output and "Traceback" not in result.output
