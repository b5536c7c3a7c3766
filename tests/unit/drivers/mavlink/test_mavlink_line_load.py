"""Serial speeds by what the vehicle of each firmware sends and is sent."""

from unittest.mock import Mock

import pytest

from drivers.mavlink import line_load
from drivers.mavlink.driver import Fleet
from drivers.mavlink.settings import LinkSettings, MavlinkDriverSettings, VehicleSettings, VisionFeedback
from groundstation.errors import DriverError, SettingsError
from groundstation.settings.load import cautions_of, load_field


def settings_of(flavour, target, vision_hz=30.0, key_file=""):
    return MavlinkDriverSettings(
        link=LinkSettings(target=target, key_file=key_file),
        vehicles=(VehicleSettings(name="drone_1", system_id=1, flavour=flavour),),
        vision=VisionFeedback(rate_hz=vision_hz),
    )


def judged(*facts, **more):
    settings = settings_of(*facts, **more)
    return line_load.fault(settings), line_load.caution(settings)


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.parametrize("target", ["udpout:127.0.0.1:14550", "serial:/dev/ttyUSB0:230400", "serial:/dev/x:921600"])
def test_networks_and_fast_lines_are_sound(flavour, target):
    assert judged(flavour, target) == ("", "")


def test_a_line_that_carries_less_than_a_px4_is_sent_is_a_fault():
    fault, caution = judged("px4", "serial:/dev/ttyUSB0:57600")
    assert "9.0 kB/s are 156 %" in fault and "a faster line, or a lower vision_hz" in fault and caution == ""


@pytest.mark.parametrize(
    "flavour, baud, vision_hz, share",
    [("px4", 115200, 30.0, "78 %"), ("px4", 57600, 15.0, "150 %"), ("ardupilot", 57600, 30.0, "112 %")],
)
def test_a_line_with_little_to_spare_is_a_caution(flavour, baud, vision_hz, share):
    fault, caution = judged(flavour, f"serial:/dev/ttyUSB0:{baud}", vision_hz)
    assert fault == "" and share in caution and caution.endswith("take a faster line")
    what = "cannot carry its telemetry" if int(share.split()[0]) > 100 else "leaves little room"
    assert caution.startswith(f"{what}: ")


def test_a_lower_rate_is_advised_where_it_helps():
    assert "or a lower vision_hz" in judged("ardupilot", "serial:/dev/ttyUSB0:115200", 50.0)[1]


def test_signatures_count():
    assert judged("ardupilot", "serial:/dev/ttyUSB0:115200")[1] == ""
    assert "72 %" in judged("ardupilot", "serial:/dev/ttyUSB0:115200", key_file="key")[1]


def on_line(baud, *more):
    return "config/mixed-team.yaml", (f"drones.drone_2.mavlink.serial=/dev/ttyUSB0:{baud}", *more)


def test_a_field_with_too_slow_a_line_is_refused():
    with pytest.raises(SettingsError, match=r"drone_2\.mavlink\.serial: carries less than is sent: 9.0 kB/s are 156 %"):
        load_field(*on_line(57600))


def test_a_field_with_a_slow_line_is_warned_of():
    told = [line for line in cautions_of(*on_line(115200)) if "serial" in line]
    assert len(told) == 1 and "drone_2.mavlink.serial: leaves little room: 9.0 kB/s are 78 % of it" in told[0]
    assert not any("serial" in line for line in cautions_of(*on_line(921600)))


def test_a_line_that_is_wrong_otherwise_is_told_so():
    with pytest.raises(SettingsError, match="MAVSDK cannot sign"):
        load_field(*on_line(57600, "drones.drone_2.mavlink.link=mavsdk", "drones.drone_2.mavlink.key_file=/tmp/key"))


def test_a_driver_does_not_start_on_too_slow_a_line():
    with pytest.raises(DriverError, match="serial:/dev/ttyUSB0:57600 carries less than is sent"):
        Fleet(Mock(), settings_of("px4", "serial:/dev/ttyUSB0:57600"))
