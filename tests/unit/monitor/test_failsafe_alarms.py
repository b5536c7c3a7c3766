"""Alarms on what failsafes do with a drone: whether an order helps, and which."""

import pytest
from monitor_world import NOW, World

from groundstation.bus.messages import FlightState
from groundstation.monitor.alarms import alarms_of
from groundstation.monitor.safety import Level, safety_of

STOOD = "this driver stood still for 0.7 s; RESUME is needed"


@pytest.mark.parametrize(
    ("lands_in_s", "text"),
    [
        (None, "drone_1 hovers: this driver stood still for 0.7 s"),
        (26.8, "drone_1 starts to land in 27 s: this driver stood still for 0.7 s"),
    ],
)
def test_a_hover_that_only_an_order_ends_asks_for_one(world: World, lands_in_s: float | None, text: str) -> None:
    world.vehicle("drone_1", "HOVER", failsafe="driver_stood", detail=STOOD, lands_in_s=lands_in_s)
    world.text()
    (alarm,) = alarms_of(world.state, NOW)
    assert (alarm.about, alarm.text, alarm.asks, alarm.grave) == ("drone_1 waits", text, True, True)
    assert alarm.advice == "To do: press RESUME, or HOLD to keep it there; otherwise it lands by itself."


def test_a_hover_outside_the_fence_asks_for_the_order_that_leads_it_back(world: World) -> None:
    why = "it is 0.3 m outside the fence"
    world.vehicle("drone_1", "HOVER", failsafe="outside", detail=why, lands_in_s=1.9)
    world.text()
    (alarm,) = alarms_of(world.state, NOW)
    assert (alarm.text, alarm.asks, alarm.grave) == (f"drone_1 starts to land in 2 s: {why}", True, True)
    assert alarm.advice == "To do: press RESUME: the tracker leads it back; otherwise it lands by itself."
    world.vehicle("drone_1", "TRACK", detail=why, lands_in_s=2.4)
    world.text()
    assert [(one.text, one.asks) for one in alarms_of(world.state, NOW)] == [
        (f"drone_1 starts to land in 2 s: {why}", False)
    ]


def test_a_landing_that_no_order_stops_asks_for_none(world: World) -> None:
    why = "no telemetry from the vehicle"
    world.vehicle("drone_1", "HOVER", failsafe="telemetry_silent", detail=why, lands_in_s=1.2)
    world.text()
    (alarm,) = alarms_of(world.state, NOW)
    assert (alarm.text, alarm.asks) == (f"drone_1 starts to land in 1 s: {why}", False)


@pytest.mark.parametrize(
    ("mode", "failsafe", "detail", "lands_in_s"),
    [
        ("CUT", "", "it flies although its motors were cut", 1.2),
        ("CUT", "emergency", "it flies although its motors were cut", 1.2),
        ("LANDING", "cut_ignored", "it flies although its motors were cut", None),
    ],
)
def test_one_that_flies_although_its_motors_were_cut_asks_to_stay_away(
    world: World, mode: str, failsafe: str, detail: str, lands_in_s: float | None
) -> None:
    world.vehicle("drone_1", mode, failsafe=failsafe, detail=detail, lands_in_s=lands_in_s)
    world.text()
    alarms = alarms_of(world.state, NOW)
    assert [alarm.text for alarm in alarms] == ["drone_1 flies although its motors were cut"]
    assert alarms[0].grave and "stay away" in alarms[0].advice
    assert safety_of(world.state, alarms).level is Level.ACT
    world.vehicle("drone_1", "LANDED", flight_state=FlightState.LANDED)
    world.text()
    assert alarms_of(world.state, NOW) == []


@pytest.mark.parametrize(("mode", "looks"), [("TRACK", True), ("HOLD", False), ("LANDING", False)])
def test_nobody_is_said_to_look_for_a_target_while_no_drone_tracks(world: World, mode: str, looks: bool) -> None:
    world.vehicle("drone_1", mode)
    world.estimate(target_age_s=6.0)
    world.text()
    (alarm,) = (one for one in alarms_of(world.state, NOW) if one.about == "turtlebot lost")
    assert (alarm.advice == "Nothing to do: the drones look for it.") == looks and not alarm.asks


def test_one_that_stands_with_running_motors_is_not_said_to_fall(world: World) -> None:
    why = "it stands on the floor with running motors: CUT MOTORS stops them"
    world.vehicle("drone_1", "LANDING", failsafe="stands_running", detail=why, battery=0.05)
    world.text()
    (alarm,) = alarms_of(world.state, NOW)
    assert alarm.text == f"drone_1 {why.removeprefix('it ')}"
    assert alarm.grave and "CUT MOTORS" in alarm.advice and "fall" not in alarm.advice


@pytest.mark.parametrize("failsafe", ["flies_away", "landing_overdue"])
def test_one_that_does_not_come_down_asks_to_cut_its_motors(world: World, failsafe: str) -> None:
    why = "it does not come down: it rises at 0.9 m/s"
    world.vehicle("drone_1", "LANDING", failsafe=failsafe, detail=why, battery=0.05)
    world.text()
    (alarm,) = alarms_of(world.state, NOW)
    assert (alarm.about, alarm.text) == ("drone_1 not down", f"drone_1 {why.removeprefix('it ')}")
    assert alarm.asks and alarm.grave and "CUT MOTORS" in alarm.advice
    assert safety_of(world.state, [alarm]).level is Level.ACT
