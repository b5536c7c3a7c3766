"""A vehicle in a mode that is not ours: a return is landed, its speed stays limited; a pilot's sticks stay free."""

import pytest

from drivers.mavlink.wire.names import CopterMode, Flavour, Px4Auto, Px4Main, px4_mode
from groundstation.bus.messages import Verb

_RETURNS = [
    ("px4", px4_mode(Px4Main.AUTO, Px4Auto.RETURN)),
    ("ardupilot", CopterMode.RTL),
    ("ardupilot", CopterMode.SMART_RTL),
    ("ardupilot", CopterMode.AUTO_RTL),
]


@pytest.mark.parametrize(("flavour", "mode"), _RETURNS)
def test_a_return_is_landed_at_once(rig_of, flavour, mode):
    rig = rig_of(flavour)
    rig.track_on()
    rig.emulator.firmware.enter(mode)
    rig.until(lambda: rig.mode == "LANDING", 1.2)
    assert "flies home" in rig.host.watchdog.reason
    rig.until(lambda: rig.emulator.firmware.mode == rig.emulator.firmware.landing, 0.2)
    rig.order(Verb.RESUME)
    rig.until(lambda: rig.mode == "LANDED", 15.0)


def test_a_return_on_the_floor_is_no_reason_to_land(rig):
    rig.connect()
    returns = CopterMode.RTL if rig.flavour is Flavour.ARDUPILOT else px4_mode(Px4Main.AUTO, Px4Auto.RETURN)
    rig.emulator.firmware.enter(returns)
    rig.run(2.0)
    assert rig.mode == "LANDED"
