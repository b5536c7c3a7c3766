"""Alarms of the monitor and the console, and their severity."""

import pytest
from monitor_world import NOW, S, World

from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.monitor.alarms import alarms_of
from groundstation.monitor.safety import Level, safety_of


def _alarms(world: World) -> list[str]:
    world.text()
    return [alarm.text for alarm in alarms_of(world.state, NOW)]


def test_nothing_wrong_raises_no_alarm(world: World) -> None:
    world.vehicle("drone_1")
    world.estimate()
    world.status("tracker")
    assert _alarms(world) == []


@pytest.mark.parametrize("text", ["is not found", "drone_1 is not found"])
def test_an_error_names_whom_it_is_about_once(world: World, text: str) -> None:
    world.say(t.EVENT, m.Event(header=world.header("drone_1", 1.0), severity=m.Severity.ERROR, text=text))
    (alarm,) = _alarms(world)
    assert alarm in {"drone_1: is not found", "drone_1 is not found"} and alarm.count("drone_1") == 1
    assert alarm in world.text()


def test_an_alarm_keeps_what_it_is_about_while_its_figures_change(world: World) -> None:
    for silence_s in (2.0, 4.0):
        world.vehicle("drone_1", age_s=silence_s)
        world.estimate(target_age_s=silence_s + 4.0)
        world.text()
        assert {alarm.about for alarm in alarms_of(world.state, NOW)} == {"drone_1 silent", "turtlebot lost"}


def test_alarms_that_need_an_act_come_first_then_grave_ones(world: World) -> None:
    world.vehicle("drone_1", battery=0.18)
    world.vehicle("drone_2", age_s=4.0)
    world.estimate(target_age_s=6.0, age_s=0.5)
    world.status("recorder", m.Lifecycle.DEGRADED, detail="disk full")
    world.status("ceiling", age_s=5.0)
    assert _alarms(world) == [
        "drone_1: battery 18%, good for < 1 min",
        "drone_2: nothing heard for 4 s",
        "tracker: no estimate for 0.5 s",
        "process ceiling: silent for 5 s",
        "turtlebot is lost: not seen for 6 s",
        "process recorder: disk full",
    ]
    assert "nothing heard for 4 s" in world.text()


def test_a_failsafe_hover_or_landing_is_an_alarm_with_its_consequence(world: World) -> None:
    world.vehicle("drone_1", detail="not seen by any camera for too long", lands_in_s=6.2, braked=True)
    world.vehicle("drone_2", detail="hovers: its velocity is stuck", braked=True)
    world.text()
    first, second = alarms_of(world.state, NOW)
    assert (first.text, first.grave) == ("drone_1 starts to land in 6 s: not seen by any camera for too long", True)
    assert "HOLD does not stop it" in first.advice
    assert (second.text, second.grave) == ("drone_2 hovers: its velocity is stuck", False)


@pytest.mark.parametrize(("share", "grave"), [(0.61, None), (0.59, False), (0.29, True), (None, None)])
def test_a_weak_link_is_an_alarm(world: World, share: float | None, grave: bool | None) -> None:
    world.vehicle("drone_1", link_quality=share)
    world.text()
    assert [alarm.grave for alarm in alarms_of(world.state, NOW)] == ([] if grave is None else [grave])


def test_a_weak_link_needs_no_act_of_who_stands_or_is_not_heard_any_more(world: World) -> None:
    world.vehicle("drone_1", link_quality=0.2, flight_state=m.FlightState.LANDED, mode="LANDED")
    world.vehicle("drone_2", link_quality=0.2, battery=0.18, age_s=600.0)
    assert _alarms(world) == ["drone_2: nothing heard for 600 s"]


def test_a_silent_driver_of_a_drone_that_stands_is_said_to_have_stood(world: World) -> None:
    world.vehicle("drone_1", age_s=600.0, flight_state=m.FlightState.LANDED, mode="LANDED")
    world.vehicle("drone_2", age_s=600.0, flight_state=m.FlightState.UNKNOWN, mode="CONNECTING")
    world.estimate(age_s=0.5)
    world.text()
    found = {alarm.text: alarm for alarm in alarms_of(world.state, NOW)}
    stood = found["drone_1: nothing heard for 600 s, it stood until then"]
    assert not stood.grave and "hover" not in stood.advice
    assert "it hovers, then lands" in found["drone_2: nothing heard for 600 s"].advice
    assert found["tracker: no estimate for 0.5 s"].advice == "Nothing to do now: nobody is known to fly."


def test_a_drone_that_falls_silent_in_its_landing_lands(world: World) -> None:
    for mode, state in (("LANDING", m.FlightState.FLYING), ("TRACK", m.FlightState.LANDING)):
        world.vehicle("drone_1", mode, age_s=2.0, flight_state=state)
        world.text()
        (silent,) = alarms_of(world.state, NOW)
        assert silent.advice == "Nothing to do: it lands. Stops are sent to it."


@pytest.mark.parametrize("others", [m.FlightState.FLYING, m.FlightState.LANDED])
def test_motors_that_were_cut_ask_to_stay_away_while_others_fly(world: World, others: m.FlightState) -> None:
    """A MAVLink vehicle whose motors were cut reports that it stands."""
    world.vehicle("drone_1", flight_state=others)
    world.vehicle("drone_2", flight_state=m.FlightState.LANDED, mode="CUT")
    world.text()
    asked = [alarm for alarm in alarms_of(world.state, NOW) if alarm.asks]
    assert [alarm.text for alarm in asked] == (
        ["drone_2: its motors were cut"] if others is m.FlightState.FLYING else []
    )
    assert safety_of(world.state, alarms_of(world.state, NOW)).level is (Level.ACT if asked else Level.SAFE)


def test_an_unknown_battery_is_an_alarm_once_the_vehicle_speaks(world: World) -> None:
    world.vehicle("drone_1", battery=None, flight_state=m.FlightState.UNKNOWN)
    world.vehicle("drone_2", battery=None, flight_state=m.FlightState.LANDED)
    assert _alarms(world) == ["drone_2: battery unknown"]


@pytest.mark.parametrize(
    ("mode", "state"), [("TRACK", m.FlightState.LANDING), ("LANDING", m.FlightState.FLYING)]
)  # after the command to land, it reports landing a moment later
def test_a_low_battery_that_lands_its_drone_is_no_grave_alarm_any_more(
    world: World, mode: str, state: m.FlightState
) -> None:
    world.vehicle("drone_1", mode, battery=0.13, flight_state=state)
    world.text()
    (alarm,) = alarms_of(world.state, NOW)
    assert alarm.text == "drone_1: battery 13%, it lands" and not alarm.grave


@pytest.mark.parametrize(
    ("level", "text", "asks"),
    [(0.29, "good for ~1 min", False), (0.21, "good for < 1 min", True), (0.14, "good for < 1 min", True)],
)
def test_a_battery_asks_for_a_landing_in_the_last_minute(world: World, level: float, text: str, asks: bool) -> None:
    world.vehicle("drone_1", battery=level)
    world.text()
    (alarm,) = alarms_of(world.state, NOW)
    assert alarm.text == f"drone_1: battery {level:.0%}, {text}"
    assert (alarm.asks, alarm.grave) == (asks, level < 0.15)


def test_a_drone_that_stands_with_a_low_battery_asks_for_nothing_now(world: World) -> None:
    world.vehicle("drone_1", "LANDED", battery=0.1, flight_state=m.FlightState.LANDED)
    world.text()
    (alarm,) = alarms_of(world.state, NOW)
    assert (alarm.text, alarm.asks) == ("drone_1: battery 10%", False)


def test_a_drone_lost_in_flight_precedes_a_standing_drones_battery(world: World) -> None:
    world.vehicle("drone_2", "LANDED", battery=0.1, flight_state=m.FlightState.LANDED)
    world.vehicle("drone_1")
    world.estimate(drone_age_s=4.0)
    assert _alarms(world) == ["drone_1 is lost: not seen for 4 s", "drone_2: battery 10%"]
    advice = "Nothing to do: it lands by itself within 26 s, unless it is seen."
    assert alarms_of(world.state, NOW)[0].advice == advice


def test_a_battery_that_lands_its_drone_within_seconds_asks_for_nothing(world: World) -> None:
    world.vehicle("drone_1", battery=0.14, detail="battery below its limit", lands_in_s=2.0)
    world.text()
    alarms = alarms_of(world.state, NOW)
    assert [alarm.text for alarm in alarms] == [
        "drone_1 starts to land in 2 s: battery below its limit", "drone_1: battery 14%, it lands",
    ]  # fmt: skip
    assert not any(alarm.asks for alarm in alarms)


def test_the_battery_of_a_drone_that_is_not_heard_in_flight_is_that_of_one_that_flies(world: World) -> None:
    world.vehicle("drone_1", battery=0.18, age_s=0.5)
    world.text()
    world.vehicle("drone_1", battery=0.18, flight_state=m.FlightState.LOST)
    world.text()
    alarms = {alarm.about: alarm for alarm in alarms_of(world.state, NOW)}
    assert alarms["drone_1 battery"].asks and "press Land" in alarms["drone_1 battery"].advice


def test_a_drone_that_nobody_sees_is_lost_unless_its_landing_says_so(world: World) -> None:
    world.vehicle("drone_1")
    world.estimate(drone_age_s=4.0)
    assert _alarms(world) == ["drone_1 is lost: not seen for 4 s"]
    world.vehicle("drone_1", "LANDING", flight_state=m.FlightState.LANDING)
    world.text()
    assert [alarm.advice for alarm in alarms_of(world.state, NOW)] == ["Nothing to do: it lands."]
    world.vehicle("drone_1", detail="not seen by any camera for too long", lands_in_s=6.0)
    assert _alarms(world) == ["drone_1 starts to land in 6 s: not seen by any camera for too long"]


@pytest.mark.parametrize(
    ("unlocalised_s", "text"),
    [(2.9, None), (9.0, "drone_2: not known where it is for 9 s"), (1e6, "drone_2: not known where it is")],
)
def test_a_drone_that_is_seen_elsewhere_or_by_unlocated_ones_is_an_alarm(
    world: World, unlocalised_s: float, text: str | None
) -> None:
    world.vehicle("drone_2")
    world.estimate(drone_2={"unlocalised_s": unlocalised_s, "contradicted": True})
    assert _alarms(world) == ([text] if text else [])
    assert not any("within 0 s" in alarm.advice for alarm in alarms_of(world.state, NOW))
    world.vehicle("drone_2", "LANDED", flight_state=m.FlightState.LANDED)
    assert _alarms(world) == []


@pytest.mark.parametrize(
    ("mode", "expected_s", "text", "asks"),
    [
        ("SEARCH", 21.0, "turtlebot is lost, most likely near (1.7, -0.9)", False),
        ("SEARCH", None, "turtlebot is lost, most likely near (1.7, -0.9); no drone is free to search", True),
        ("LOST", 21.0, "turtlebot is not found: 96% of the 41% of the room that the team can see was searched", True),
    ],
)
def test_a_target_that_is_searched_for_is_one_alarm_of_its_own(
    world: World, mode: str, expected_s: float | None, text: str, asks: bool
) -> None:
    floor = "the 41% of the room that the team can see"
    search = m.TargetSearch("turtlebot", mode, 5.0, (1.7, -0.9), 0.96, expected_s, "in words", floor)
    world.estimate(4.0, 0.0, search)
    world.text()
    (alarm,) = alarms_of(world.state, NOW)
    assert (alarm.about, alarm.text, alarm.asks) == ("turtlebot lost", text, asks)


def test_a_camera_without_pictures_raises_an_alarm(world: World) -> None:
    world.camera("ceiling", connected=False)
    assert _alarms(world) == ["ceiling: no pictures"]


def test_a_dark_camera_is_an_alarm_unless_its_drone_stands(world: World) -> None:
    world.vehicle("drone_1")
    world.vehicle("drone_2", "LANDED", flight_state=m.FlightState.LANDED)
    for camera, light in (("ceiling", 0.01), ("drone_1_camera", 0.06), ("drone_2_camera", 0.01), ("east", 0.4)):
        world.camera(camera, brightness=light)
    assert _alarms(world) == ["ceiling and drone_1_camera: their pictures are dark, they see nobody"]


@pytest.mark.parametrize(
    ("rate_hz", "detail", "words", "asks"),
    [
        (0.0, "its velocity is stuck", "its driver no longer hears it", True),
        (199.7, "landing for operator", "what it says is not believed", False),
        (199.7, "its velocity is stuck", "its velocity is stuck", False),
    ],
)
def test_a_drone_that_is_heard_and_not_believed_is_not_called_silent(
    world: World, rate_hz: float, detail: str, words: str, asks: bool
) -> None:
    world.vehicle("drone_1", "LANDING", flight_state=m.FlightState.LOST, rate_hz=rate_hz, detail=detail)
    world.text()
    (alarm,) = alarms_of(world.state, NOW)
    assert (alarm.text, alarm.grave, alarm.asks) == (f"drone_1: {words}", True, asks)


def test_a_crashed_drones_alarm_says_stay_away_while_others_fly(world: World) -> None:
    world.vehicle("drone_1", "CUT", flight_state=m.FlightState.EMERGENCY)
    world.estimate()
    world.text()
    (alarm,) = alarms_of(world.state, NOW)
    assert alarm.text == "drone_1: EMERGENCY, its motors are off"
    assert alarm.asks and "stay away until all have landed (LAND ALL)" in alarm.advice


def test_each_alarm_says_first_whether_there_is_anything_to_do(world: World) -> None:
    world.vehicle("drone_1", battery=0.18, link_quality=0.5, detail="hovers: its velocity is stuck", braked=True)
    world.vehicle("drone_2", age_s=4.0, flight_state=m.FlightState.LOST)
    world.estimate(6.0, 0.5)
    world.text()
    alarms = alarms_of(world.state, NOW)
    assert len(alarms) == 7 and {alarm.asks for alarm in alarms} == {True, False}
    assert all(alarm.advice.startswith(("Nothing to do", "To do")) for alarm in alarms), alarms


def test_a_suspected_figure_stands_until_it_is_withdrawn(world: World) -> None:
    world.vehicle("drone_1")
    world.vehicle("drone_2")
    world.estimate()
    figure = m.SuspectedFigure("drone_1", "drone_1's camera looks 3 deg lower", "fix the mounting", NOW - 60 * S)
    world.say(t.SUSPICION, m.Suspicion(header=world.header("diagnosis", 60.0), cause="x", figures=(figure,)))
    world.text()
    (alarm,) = alarms_of(world.state, NOW)
    assert alarm.text == "Suspected: drone_1's camera looks 3 deg lower" and alarm.told_ns == NOW - 60 * S
    assert not alarm.grave and not alarm.asks and "When all have landed: fix the mounting." in alarm.advice
    assert safety_of(world.state, [alarm]).level is Level.WATCH
    world.say(t.SUSPICION, m.Suspicion(header=world.header("diagnosis"), cause=""))
    assert _alarms(world) == []


def test_two_figures_that_are_suspected_at_once_are_two_alarms(world: World) -> None:
    figures = tuple(
        m.SuspectedFigure("drone_1", f"drone_1's {which} is wrong", "calibrate", NOW - 60 * S, f"drone_1 {which}")
        for which in ("pan", "delay")
    )
    world.say(t.SUSPICION, m.Suspicion(header=world.header("diagnosis"), cause="x", figures=figures))
    world.text()
    assert len({alarm.about for alarm in alarms_of(world.state, NOW)}) == 2


MOVED = "Nothing to do: they are moved apart; if that does not help, one lands."


@pytest.mark.parametrize(
    ("modes", "to_do"),
    [
        (("TRACK", "HOVER"), MOVED),
        (("HOVER", "HOLD"), MOVED),
        (("HOVER", "LANDING"), "Nothing to do: it lands."),
    ],
)
def test_drones_that_fly_nearer_than_allowed_are_told(world: World, modes: tuple[str, str], to_do: str) -> None:
    for name, mode in zip(("drone_1", "drone_2"), modes, strict=True):
        world.vehicle(name, mode)
    for x_m, told in ((0.61, False), (0.55, True)):
        places = {"drone_1": (0.0, 0.0, 1.0, 0.0), "drone_2": (x_m, 0.0, 1.0, 1.0)}
        still = ((0.0,) * 16, (0.0,) * 3, True, 0.2)
        entities = tuple(m.EntityEstimate(name, "robot", mean, *still) for name, mean in places.items())
        world.say(t.ESTIMATE, m.Estimate(header=world.header("team"), entities=entities, epoch=1))
        world.text()
        near = [(one.text, one.advice) for one in alarms_of(world.state, NOW)]
        assert near == ([("drone_1 and drone_2 are 0.55 m apart, at least 0.6 m is allowed", to_do)] if told else [])
    world.vehicle("drone_2", "LANDED", flight_state=m.FlightState.LANDED)
    assert _alarms(world) == []
