"""Summary of safety: one word and its reason, from alarms and states."""

from dataclasses import replace

import pytest
from monitor_world import CAST, NOW, S, World
from msgspec.structs import replace as replaced

from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.api import Received
from groundstation.bus.keys import Key
from groundstation.monitor.alarms import alarms_of
from groundstation.monitor.safety import Level, Safety, safety_of
from groundstation.monitor.state import Cast, MonitorState


def judged(world: World) -> Safety:
    world.text()
    return safety_of(world.state, alarms_of(world.state, NOW))


def both(world: World, mode: str = "TRACK", **more: object) -> None:
    for name in ("drone_1", "drone_2"):
        world.vehicle(name, mode, **more)


def test_it_is_safe_while_nothing_is_wrong_and_the_reason_says_how_long(world: World) -> None:
    both(world)
    world.vehicle("drone_2", battery=0.65)
    world.estimate()
    reason = "No alarms. All who fly are heard, nobody is lost; the first must land for its battery in ~6 min."
    assert judged(world) == Safety(Level.SAFE, reason)


def checks(world: World, *findings: m.PreflightFinding, age_s: float = 0.0) -> None:
    world.say(t.PREFLIGHT, m.Preflight(header=world.header("team", age_s), findings=findings))


def test_it_asks_for_an_act_as_long_as_a_check_forbids_the_first_take_off(world: World) -> None:
    lost = m.PreflightFinding("MUST", "cameras", "no sensor fixed in the world sends anything", "check their power")
    text = "team: before take-off: cameras: no sensor fixed in the world sends anything"
    told = m.Event(header=world.header("team", 9.0), severity=m.Severity.ERROR, text=text, remedy=lost.remedy)
    world.say(t.EVENT, told)
    both(world, "LANDED", flight_state=m.FlightState.LANDED)
    checks(world, lost, m.PreflightFinding("SHOULD", "drone_1", "battery 30%", "charge it"))
    assert judged(world) == Safety(Level.ACT, f"{text}. To do: check their power")
    world.say(t.EVENT, replaced(told, header=world.header("team", 1.0)))
    world.text()
    assert [one.text for one in alarms_of(world.state, NOW)] == [text], "its event is the same alarm"
    world.state.events.clear()
    checks(world, lost, age_s=11.0)
    assert judged(world).level is Level.SAFE, "nobody knows whether an old list holds"
    checks(world, lost)
    both(world)
    world.estimate()
    assert judged(world).level is Level.SAFE
    both(world, "LANDED", flight_state=m.FlightState.LANDED)
    assert judged(world).level is Level.SAFE, "after a flight the card of the checks says it"


def test_landing_drones_are_ignored_in_the_battery_forecast(world: World) -> None:
    both(world)
    world.vehicle("drone_1", battery=0.65)
    world.vehicle("drone_2", "LANDING", battery=0.4, flight_state=m.FlightState.LANDING)
    assert judged(world).reason.endswith("; the first must land for its battery in ~6 min.")


def test_how_long_batteries_last_is_left_out_where_it_is_not_known(world: World) -> None:
    both(world)
    world.state.cast = replace(CAST, flight_times_s={"drone_1": 720.0})
    assert judged(world).reason == "No alarms. All who fly are heard, nobody is lost."


def test_nobody_is_said_to_stand_who_was_ordered_up(world: World) -> None:
    ordered = {"mode": "TAKING_OFF", "flight_state": m.FlightState.LANDED}
    world.vehicle("drone_1", "LANDED", flight_state=m.FlightState.LANDED)
    world.vehicle("drone_2", **ordered)
    assert judged(world).reason.startswith("No alarms. All who fly are heard, nobody is lost")
    world.vehicle("drone_2", age_s=3.0, **ordered)
    left = "Nothing to do: it hovers, then lands. Stops are sent to it."
    assert judged(world) == Safety(Level.WATCH, f"drone_2: nothing heard for 3 s. {left}")
    world.estimate(age_s=0.5)
    world.text()
    (silent,) = (alarm for alarm in alarms_of(world.state, NOW) if alarm.about == "tracker silent")
    assert silent.advice == "Nothing to do now: nobody is known to fly."


def test_it_is_safe_while_nobody_flies(world: World) -> None:
    both(world, "LANDED", flight_state=m.FlightState.LANDED)
    assert judged(world) == Safety(Level.SAFE, "No alarms. Nobody flies.")


UNKNOWN = m.FlightState.UNKNOWN


@pytest.mark.parametrize(
    ("modes", "words"),
    [
        (("CONNECTING",) * 2, "Not every drone has been heard yet: it is not known whether drone_1 and drone_2 fly."),
        (("HOVER", "LANDED"), "It is not known whether drone_1 flies."),
        (("CONNECTING", "TRACK"), "Not every drone has been heard yet: it is not known whether drone_1 flies."),
    ],
)
def test_it_is_not_safe_while_nobody_knows_whether_a_drone_flies(
    world: World, modes: tuple[str, str], words: str
) -> None:
    other = {"CONNECTING": UNKNOWN, "LANDED": m.FlightState.LANDED, "TRACK": m.FlightState.FLYING}[modes[1]]
    world.vehicle("drone_1", modes[0], battery=None, flight_state=UNKNOWN)
    world.vehicle("drone_2", modes[1], battery=0.8 if other is not UNKNOWN else None, flight_state=other)
    assert judged(world) == Safety(Level.WATCH, words)


def test_it_is_not_safe_while_nobody_knows_where_a_flying_drone_is(world: World) -> None:
    both(world, age_s=5.0)
    judged(world)
    both(world)
    assert judged(world) == Safety(Level.WATCH, "It is not known where drone_1 and drone_2 are.")
    world.estimate(drone_2=None)
    assert judged(world) == Safety(Level.WATCH, "It is not known where drone_2 is.")
    world.estimate(drone_2={"contradicted": True})
    assert judged(world) == Safety(Level.WATCH, "It is not known where drone_2 is.")
    world.vehicle("drone_2", "LANDED", flight_state=m.FlightState.LANDED)
    assert judged(world).level is Level.SAFE


def test_a_drone_that_climbs_or_just_has_need_not_be_estimated_yet(world: World) -> None:
    world.estimate(drone_2=None)
    both(world, age_s=5.0, flight_state=m.FlightState.TAKING_OFF)
    judged(world)
    both(world, age_s=0.9)
    judged(world)
    both(world)
    assert judged(world).level is Level.SAFE


def test_a_drone_never_heard_makes_the_safety_level_watch(world: World) -> None:
    world.vehicle("drone_1")
    assert judged(world) == Safety(Level.WATCH, "Not every drone has been heard yet.")


@pytest.mark.parametrize(
    ("trouble", "level"),
    [
        ({"lands_in_s": 6.0, "detail": "no camera has seen it"}, Level.WATCH),
        ({"braked": True, "detail": "hovers: its velocity is stuck"}, Level.WATCH),
        ({"battery": 0.28}, Level.WATCH),
        ({"battery": 0.13, "flight_state": m.FlightState.LANDING}, Level.WATCH),
        ({"battery": 0.18}, Level.ACT),
        ({"link_quality": 0.31}, Level.ACT),
        ({"flight_state": m.FlightState.EMERGENCY}, Level.ACT),
    ],
)
def test_trouble_is_to_be_watched_or_acted_on(world: World, trouble: dict[str, object], level: Level) -> None:
    both(world)
    world.vehicle("drone_1", **trouble)
    said = judged(world)
    assert said.level is level
    assert ("To do: " in said.reason) is (level is Level.ACT) and said.reason.startswith("drone_1")


def test_an_alarm_that_needs_an_act_decides_over_graver_ones(world: World) -> None:
    both(world)
    world.vehicle("drone_1", link_quality=0.5)
    world.vehicle("drone_2", age_s=4.0)
    said = judged(world)
    assert said.level is Level.ACT and "weak link" in said.reason


def test_a_drone_in_the_air_whose_driver_starts_anew_and_does_not_hear_it_is_lost(world: World) -> None:
    both(world)
    judged(world)
    world.vehicle("drone_1", "CONNECTING", battery=None, flight_state=m.FlightState.UNKNOWN)
    said = judged(world)
    assert said.level is Level.ACT and "drone_1: its driver no longer hears it" in said.reason
    world.vehicle("drone_1", "LANDED", flight_state=m.FlightState.LANDED)
    world.vehicle("drone_2", "LANDED", flight_state=m.FlightState.LANDED)
    assert judged(world).level is Level.SAFE


def test_a_drone_that_is_switched_off_after_its_landing_asks_for_nothing(world: World) -> None:
    both(world)
    world.vehicle("drone_1", "LANDED", battery=None, flight_state=m.FlightState.LOST)
    assert judged(world) == Safety(
        Level.WATCH,
        "drone_1: not heard any more, it stood until then. Nothing to do now: switch it on before it flies again.",
    )


@pytest.mark.parametrize(
    ("state", "mode", "advice"),
    [
        (m.FlightState.LOST, "HOVER", "Nothing to do: drones hover, then land."),
        (m.FlightState.LOST, "TAKING_OFF", "Nothing to do now: nobody is known to fly."),
        (m.FlightState.LOST, "LANDED", "Nothing to do now: nobody flies."),
        (m.FlightState.LOST, "CUT", "Nothing to do now: nobody flies."),
        (m.FlightState.LANDED, "LANDED", "Nothing to do now: nobody flies."),
    ],
)
@pytest.mark.parametrize("battery", [0.8, None])
def test_a_drone_that_was_lost_in_the_air_before_one_listened_flies(
    world: World, state: m.FlightState, mode: str, advice: str, battery: float | None
) -> None:
    world.vehicle("drone_1", mode, battery=battery, flight_state=state)
    world.estimate(age_s=0.5)
    world.text()
    (silent,) = (alarm for alarm in alarms_of(world.state, NOW) if alarm.about == "tracker silent")
    assert silent.advice == advice


def test_stamps_that_lie_ahead_hide_no_silence() -> None:
    state, ahead_ns = MonitorState(Cast("lab", {"drone_1": 0.15})), NOW + 3600 * S
    head = m.Header(ahead_ns, "here", "drone_1", "drone_1", 1)
    status = m.VehicleStatus(header=head, flight_state=m.FlightState.FLYING, mode="TRACK", battery=0.8, rate_hz=200.0)
    estimate = m.Estimate(header=replaced(head, entity="team", source="tracker"), entities=(), epoch=1)
    for topic, said in ((t.VEHICLE_STATUS, status), (t.ESTIMATE, estimate)):
        key = Key("lab", said.header.entity, topic, said.header.source)
        state.ingest([Received(key, said.header, said, b"", arrived_ns=NOW)])
    about = [(one.about, one.text) for one in alarms_of(state, NOW)]
    text = "process {0}: dates its messages 3600 s ahead"
    assert about == [(f"process {one} ahead", text.format(one)) for one in ("drone_1", "tracker")]
    assert safety_of(state, alarms_of(state, NOW)).level is Level.WATCH
    later = [one.about for one in alarms_of(state, NOW + 100 * S)]
    assert later == ["drone_1 silent", "tracker silent"], "of clocks of the silent nothing is known"
