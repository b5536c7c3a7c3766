"""A vehicle that its pilot lands, and whose landing detector has not noticed yet, is not made to fly on."""

import pytest

from drivers.mavlink.wire.flight import CommandLong
from drivers.mavlink.wire.names import CopterMode, Flavour, Landed, MavCmd, Px4Main, px4_mode
from drivers.mavlink.wire.telemetry import LocalPositionNed
from groundstation.bus.messages import AckStage, Verb
from groundstation.bus.topics import COMMAND_ACK

_PLACES = {Flavour.PX4: px4_mode(Px4Main.POSITION), Flavour.ARDUPILOT: CopterMode.LOITER}


def claims(rig) -> int:
    return sum(m.command == MavCmd.DO_SET_MODE for _, m in rig.sent(CommandLong))


def answer(rig, verb):
    """Order, and return the answer and its reason."""
    number = rig.order(verb)
    rig.run(0.1)
    acks = [ack for ack in rig.messages(COMMAND_ACK) if ack.command_id == number]
    return next(ack.stage for ack in acks if ack.stage is not AckStage.RECEIVED), acks[-1].reason


@pytest.fixture
def sinking(rig, monkeypatch):
    """Return a function that has its pilot sink a tracking vehicle to a height [m]."""
    rig.track_on()
    firmware = rig.emulator.firmware
    monkeypatch.setattr(type(firmware), "landed", property(lambda self: Landed.IN_AIR if self.armed else 1))
    monkeypatch.setattr(type(firmware), "disarm_after_s", lambda self: 10.0)
    firmware.transmitter = rig.lingers = True
    firmware.enter(_PLACES[rig.flavour])
    rig.until(lambda: rig.vehicle.orders.yields, 5.0)

    def sink(height_m):
        rig.copter.fly((0.0, 0.0, -0.3), 0.0)
        rig.until(lambda: rig.body.z <= height_m or rig.body.on_ground, 10.0)
        rig.link.sent.clear()
        return rig

    return sink


@pytest.mark.parametrize("height_m", [0.2, 0.05])
def test_it_is_not_taken_back_while_it_touches_down(sinking, height_m):
    rig = sinking(height_m)
    assert answer(rig, Verb.RESUME) == (AckStage.REFUSED, "it is touching down: let it land, then take off again")
    rig.run(2.0)
    assert not claims(rig) and rig.emulator.firmware.mode != rig.emulator.firmware.guided


def test_it_is_taken_back_higher_up(sinking):
    rig = sinking(0.6)
    rig.copter.fly((0.0, 0.0, 0.0), 0.0)
    assert answer(rig, Verb.RESUME)[0] is not AckStage.REFUSED
    rig.run(2.0)
    assert rig.emulator.firmware.mode == rig.emulator.firmware.guided and rig.mode == "TRACK"


def test_one_that_stays_on_the_floor_is_landed(sinking):
    """Its pilot landed it, or our claim came too late to catch it."""
    rig = sinking(0.0)
    rig.until(lambda: rig.emulator.firmware.mode == rig.emulator.firmware.landing, 0.8)
    assert rig.host.watchdog.reason == "it has come down to the floor"


def test_one_that_fell_on_the_floor_is_not_said_to_climb(sinking, monkeypatch):
    """As an ArduCopter 4.7 that another station put into STABILIZE: its estimator swung up as it hit the floor."""
    rig = sinking(0.0)
    take = rig.vehicle._take

    def swings_up(now_ns, message):
        take(now_ns, message._replace(vz=-1.1) if isinstance(message, LocalPositionNed) else message)

    monkeypatch.setattr(rig.vehicle, "_take", swings_up)
    rig.until(lambda: rig.mode == "LANDING", 0.8)
    assert rig.host.watchdog.reason == "it has come down to the floor"


def test_hold_is_obeyed_while_it_touches_down_and_takes_it_from_nobody(sinking):
    rig = sinking(0.2)
    assert answer(rig, Verb.HOLD)[0] in (AckStage.ACCEPTED, AckStage.EFFECTIVE)
    rig.run(1.0)
    assert not claims(rig) and rig.mode == "LANDING"
