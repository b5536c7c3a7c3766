"""A drone with frozen telemetry does not take off, or lands again, and the operator gets the reason."""

import time

from drivers.host import VehicleHost
from drivers.watchdog_types import WatchdogLimits
from groundstation.bus.messages import Verb
from groundstation.bus.topics import COMMAND_ACK, VEHICLE_STATUS


def test_one_that_froze_on_its_pad_does_not_take_off_and_the_operator_reads_why(rig):
    rig.connect()
    rig.fake.lie = "frozen"
    rig.until(lambda: not rig.host.watchdog.vehicle.fresh)
    rig.messages(VEHICLE_STATUS)
    rig.order(Verb.TAKEOFF)
    rig.until(lambda: any("all values repeat" in text for _, text, _ in rig.process.events))
    refusal = [ack.reason for ack in rig.messages(COMMAND_ACK) if ack.stage == "REFUSED"]
    assert rig.decision.mode == "LANDED" and len(refusal) == 1 and "all values repeat" in refusal[0]
    assert "all values repeat" in rig.messages(VEHICLE_STATUS)[-1].detail


def test_one_that_freezes_as_it_is_to_take_off_lands_as_if_silent(new_rig):
    rig = new_rig()
    rig.host = VehicleHost(rig.process, rig.drone, WatchdogLimits(land_after_s=1.3))
    rig.connect()
    obey = rig.fake.obey
    rig.fake.obey = lambda name, *rest: None if name == "REF" else obey(name, *rest)  # it repeats LANDED for ever
    rig.fake.lie = "frozen"
    rig.order(Verb.TAKEOFF)
    began = time.monotonic()
    rig.until(lambda: rig.decision.action == "TAKE_OFF")
    rig.until(lambda: rig.decision.action == "LAND")
    assert time.monotonic() - began <= 3.0 and "all values repeat" in rig.host.watchdog.reason
