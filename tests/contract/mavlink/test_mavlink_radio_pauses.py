"""A vehicle whose telemetry pauses hovers, and goes on by itself unless it has left our mode meanwhile."""

import pytest

from drivers.failsafe_table import Condition
from drivers.mavlink.wire.flight import CommandLong
from drivers.mavlink.wire.names import CopterMode, Flavour, Px4Auto, Px4Main, px4_mode

FORWARD = ((0.3, 0.0, 0.0), 0.0)
SET_MODE = 176


def unheard(rig, seconds):
    """Lose what it sends; what it is sent arrives: else its own failsafe would land it."""
    heard = rig.link.receive
    rig.link.receive = lambda: rig.link.lose() or []
    rig.run(seconds)
    rig.link.receive = heard


# After 2 s a new session with it begins.
@pytest.mark.parametrize("silent_s", [1.4, 2.4])
def test_it_goes_on_by_itself(rig, silent_s):
    rig.track_on()
    unheard(rig, silent_s)
    rig.link.sent.clear()
    rig.wanted = FORWARD
    rig.run(1.0)
    assert rig.host.watchdog.braked and abs(rig.body.vx) + abs(rig.body.vy) < 0.1
    rig.run(2.0)
    assert rig.mode == "TRACK" and not rig.host.watchdog.braked
    assert abs(rig.body.vx) + abs(rig.body.vy) > 0.2
    assert not [m for _, m in rig.sent(CommandLong) if m.command == SET_MODE], "no order asked for its mode"


def test_who_takes_it_over_meanwhile_keeps_it(rig):
    rig.track_on()
    firmware = rig.emulator.firmware
    firmware.enter(px4_mode(Px4Main.AUTO, Px4Auto.HOLD) if rig.flavour == Flavour.PX4 else CopterMode.BRAKE)
    unheard(rig, 1.5)
    rig.link.sent.clear()
    rig.run(5.0)
    assert (rig.mode, rig.host.watchdog.failsafe) == ("HOVER", Condition.BACK_IN_DOUBT)
    assert firmware.mode != firmware.guided
    assert not [m for _, m in rig.sent(CommandLong) if m.command == SET_MODE]
