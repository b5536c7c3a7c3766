"""A vehicle that leaves the fence, whoever moved it, is stopped by its driver; slowly, below every limit of speed."""

import pytest

from drivers.mavlink.wire.flight import command_to
from drivers.mavlink.wire.frames import FrameEncoder
from drivers.mavlink.wire.names import CopterMode, Flavour, MavCmd, Px4Auto, Px4Main, px4_mode
from groundstation.bus.messages import Verb

GROUND = ("127.0.0.1", 14999)
FENCE = {"fence_m": ((-1.5, 1.5), (-1.5, 1.5), (0.0, 1.6))}
_HOLDS = {Flavour.PX4: px4_mode(Px4Main.AUTO, Px4Auto.HOLD), Flavour.ARDUPILOT: CopterMode.AUTO}
_STICKS = {Flavour.PX4: px4_mode(Px4Main.POSITION), Flavour.ARDUPILOT: CopterMode.POSHOLD}


@pytest.fixture
def fenced(flavour, rig_of):
    return rig_of(flavour, safety=FENCE)


def beyond(rig):
    """Return how far it truly is outside [m; negative: inside]."""
    return max(abs(rig.body.x) - 1.5, abs(rig.body.y) - 1.5, rig.body.z - 1.6)


def flown(rig, mode, velocity, seconds):
    """Have others fly it in a mode; return how far outside it was when its driver landed it, or None."""
    firmware = rig.emulator.firmware
    for _ in range(round(seconds / 0.01)):
        if rig.mode == "LANDING":
            return beyond(rig)
        if firmware.mode == mode:
            rig.copter.fly(velocity, 0.0)
        rig.run(0.01)
    return None


@pytest.mark.parametrize(
    ("velocity", "where"), [((0.0, 0.0, 0.5), "above"), ((0.5, 0.0, 0.0), "outside"), ((0.0, 0.4, 0.0), "outside")]
)
def test_one_that_another_station_sends_out_is_landed(fenced, velocity, where):
    rig = fenced
    rig.track_on()
    mode = _HOLDS[rig.flavour]
    if rig.flavour is Flavour.PX4:
        order = command_to(11, MavCmd.DO_SET_MODE, 1.0, float(Px4Main.AUTO), float(Px4Auto.HOLD))
    else:
        order = command_to(11, MavCmd.DO_SET_MODE, 1.0, float(mode))
    rig.emulator.take(FrameEncoder(250, 190).encode(order), GROUND)
    if rig.emulator.firmware.mode != mode:
        rig.emulator.firmware.enter(mode)  # as PX4 does with an origin, which this one lacks
    landed_m = flown(rig, mode, velocity, 15.0)
    assert landed_m is not None and 0.1 < landed_m < 0.5
    assert rig.host.watchdog.reason.endswith(f"m {where} the fence, not by our orders")
    assert rig.emulator.firmware.mode == rig.emulator.firmware.landing
    rig.until(lambda: rig.mode == "LANDED", 15.0)
    assert beyond(rig) < 0.9


def test_one_that_another_station_moves_inside_is_left_alone(fenced):
    rig = fenced
    rig.track_on()
    mode = _HOLDS[rig.flavour]
    rig.emulator.firmware.enter(mode)
    for velocity in ((0.0, 0.0, 0.3), (0.0, 0.0, -0.3), (0.3, 0.0, 0.0), (-0.3, 0.0, 0.0)):
        assert flown(rig, mode, velocity, 1.5) is None
    assert rig.mode == "TRACK"


def take_sticks(rig, transmitter):
    """Let a pilot take a tracking vehicle by the sticks; transmitter: whether it is heard. Returns the mode."""
    rig.emulator.firmware.parameters.values["FS_THR_ENABLE"] = 3
    rig.track_on()
    rig.emulator.firmware.transmitter = transmitter
    rig.run(1.0)
    rig.emulator.firmware.enter(_STICKS[rig.flavour])
    return _STICKS[rig.flavour]


@pytest.mark.parametrize("transmitter", [True, False])
def test_a_pilot_may_fly_it_out_while_a_transmitter_is_heard(fenced, transmitter):
    rig, mode = fenced, take_sticks(fenced, transmitter)
    landed_m = flown(rig, mode, (0.4, 0.0, 0.0), 6.0)
    assert (landed_m is None) is transmitter and beyond(rig) > 0.1


def test_one_that_a_pilot_let_go_of_outside_may_settle_before_it_is_landed(fenced):
    rig, mode = fenced, take_sticks(fenced, True)
    assert flown(rig, mode, (0.4, 0.0, 0.0), 6.0) is None and beyond(rig) > 0.1
    rig.emulator.firmware.enter(_HOLDS[rig.flavour])
    assert flown(rig, _HOLDS[rig.flavour], (0.0, 0.0, 0.0), 1.4) is None
    assert flown(rig, _HOLDS[rig.flavour], (0.0, 0.0, 0.0), 1.2) is not None


def test_our_own_orders_that_lead_out_end_in_a_hover_and_a_landing(fenced):
    """As those of a tracker whose limiter fails."""
    rig = fenced
    rig.track_on()
    rig.wanted = ((0.3, 0.0, 0.0), 0.0)
    rig.until(lambda: rig.mode == "HOVER", 15.0)
    assert rig.host.watchdog.failsafe == "outside" and 0.1 < beyond(rig) < 0.6
    assert rig.host.watchdog.reason.endswith("outside the fence; RESUME is needed")
    rig.until(lambda: rig.mode == "LANDING", 2.5)
    rig.until(lambda: rig.mode == "LANDED", 15.0)
    assert beyond(rig) < 0.8


def test_one_on_hold_above_the_fence_comes_down_into_it(fenced):
    """It holds its height by itself: the tracker leads it back sideways only."""
    rig = fenced
    rig.track_on()
    rig.body.z = 2.0
    rig.run(0.3)
    rig.order(Verb.HOLD)
    rig.run(0.5)
    assert beyond(rig) > 0.1
    rig.run(5.0)
    assert rig.mode == "HOLD" and -0.3 < beyond(rig) < -0.1


def test_one_that_was_pushed_out_is_brought_back_by_our_orders(fenced):
    rig = fenced
    rig.track_on()
    rig.body.z = 2.5
    rig.wanted = ((0.0, 0.0, -0.3), 0.0)
    rig.run(1.5)
    assert beyond(rig) > 0.2
    rig.run(2.5)
    assert rig.mode == "TRACK" and beyond(rig) < 0.0
