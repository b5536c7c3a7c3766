"""Ten situations of a flight that an operator must understand at a glance, as a run would show them."""

from collections.abc import Callable

from fake_flight import TARGET, FakeFlight

from groundstation.bus.messages import Severity


def all_is_well(flight: FakeFlight) -> None:
    flight.modes = dict.fromkeys(flight.drones, "TRACK")
    flight.battery = dict.fromkeys(flight.drones, 0.71)
    flight.link, flight.rate_hz, flight.detail = {}, {}, {}
    flight.lands_in_s, flight.unseen_s = {}, {}
    flight.braked, flight.frozen = set(), False
    flight.mute, flight.dark, flight.states = set(), False, {}


def one_lands_for_its_battery(flight: FakeFlight) -> None:
    flight.modes["drone_2"], flight.battery["drone_2"] = "LANDING", 0.13
    flight.detail["drone_2"] = "battery below its limit"
    flight.event(Severity.WARNING, "drone_2 lands: battery below its limit", "drone_2")


def all_are_held(flight: FakeFlight) -> None:
    flight.modes = dict.fromkeys(flight.drones, "HOLD")


def one_is_unseen_and_will_land(flight: FakeFlight) -> None:
    flight.unseen_s["drone_1"] = 4.0
    flight.lands_in_s["drone_1"] = 6.0
    flight.detail["drone_1"] = "not seen by any camera for too long"


def the_tracker_is_silent(flight: FakeFlight) -> None:
    flight.frozen = True
    flight.braked = set(flight.drones)
    flight.detail = dict.fromkeys(flight.drones, "hovers: the tracker sends it no velocity")
    flight.lands_in_s = dict.fromkeys(flight.drones, 1.4)


def one_has_a_stuck_sensor(flight: FakeFlight) -> None:
    flight.braked.add("drone_2")
    flight.detail["drone_2"] = "hovers: its sensors cannot be believed: reported velocity stuck at 0.27 m/s"


def all_land(flight: FakeFlight) -> None:
    flight.modes = dict.fromkeys(flight.drones, "LANDING")


def one_has_a_weak_link(flight: FakeFlight) -> None:
    flight.link["drone_1"], flight.rate_hz["drone_1"] = 0.31, 62.0


def one_stands_with_an_unknown_battery(flight: FakeFlight) -> None:
    flight.modes["drone_2"], flight.battery["drone_2"] = "LANDED", None
    flight.detail["drone_2"] = "landed (its battery is unknown)"
    flight.battery["drone_1"] = 0.19


def the_target_is_lost(flight: FakeFlight) -> None:
    flight.unseen_s[TARGET] = 7.0


SITUATIONS: dict[str, Callable[[FakeFlight], None]] = {
    made.__name__: made
    for made in (
        all_is_well,
        all_are_held,
        one_is_unseen_and_will_land,
        the_tracker_is_silent,
        one_has_a_stuck_sensor,
        all_land,
        one_has_a_weak_link,
        one_stands_with_an_unknown_battery,
        the_target_is_lost,
        one_lands_for_its_battery,  # the last one, because its event stays in the list
    )
}
