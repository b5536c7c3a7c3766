"""AR.Drone settings reach its driver and its failsafe datagrams; emulator ports do not."""

import dataclasses
import json

import pytest
from pydantic import ValidationError

from drivers.ardrone.kind import KIND, ArDroneOwn
from sim_bridge.conformance.subject import subject_of


def section(index=0, **own):
    order = dataclasses.replace(subject_of("ardrone").order(index=index), sections={"ardrone": ArDroneOwn(**own)})
    return order, json.loads(KIND.processes([order])[0].section)


def test_hull_room_trim_and_ultrasound_reach_the_driver():
    _, told = section(hull="outdoor", outdoor=True, flat_trim="on_order", ultrasound_hz=25, strict_checksum=False)
    flight = told["flight"]
    assert (flight["without_shell"], flight["outdoor"], flight["flat_trim"]) == (True, True, False)
    assert flight["ultrasound_freq"] == 8 and told["strict_checksum"] is False


def test_neighbours_have_different_rates_where_nobody_says_so():
    assert [section(index)[1]["flight"]["ultrasound_freq"] for index in range(3)] == [7, 8, 7]


def test_ports_reach_the_driver_and_the_fail_safe_but_no_simulation():
    order, told = section(at_port=6556, navdata_port=6554)
    assert (told["at_port"], told["navdata_port"], told["ftp_port"]) == (6556, 6554, 5551)
    assert KIND.stop([order]).port == 6556
    assert KIND.moved("127.0.0.1", order.sections)["ardrone"]["at_port"] == 5556


@pytest.mark.parametrize("own", [{"hull": "none"}, {"ultrasound_hz": 30}, {"at_port": 0}, {"flat_trim": "never"}])
def test_settings_that_no_drone_has_are_refused(own):
    with pytest.raises(ValidationError):
        ArDroneOwn(**own)
