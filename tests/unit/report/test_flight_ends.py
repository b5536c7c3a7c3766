"""A flight that nobody ended by an order is over when the last drone is on the floor."""

from collections.abc import Mapping, Sequence

import numpy as np
import pytest

from groundstation.bus import messages as m
from groundstation.field.resolved import ResolvedField
from groundstation.report.interval import tracking_spans
from groundstation.report.run_facts import RunFacts
from groundstation.report.tracks import RunData, TimedMessage, TruthTrack

HEADER = m.Header(0, "here", "team", "tester", 0)
FLYING, LANDING, LANDED = m.FlightState.FLYING, m.FlightState.LANDING, m.FlightState.LANDED
UNKNOWN, LOST = m.FlightState.UNKNOWN, m.FlightState.LOST
FLIES = [(0.0, LANDED), (2.0, FLYING)]
Told = Sequence[tuple[float, m.FlightState]]
Order = tuple[float, m.Verb, str]


def _names(letters: str) -> tuple[str, ...]:
    return tuple({"a": "drone_1", "b": "drone_2"}[letter] for letter in letters)


def _data(field: ResolvedField, told: Mapping[str, Told], orders: Sequence[Order] = ()) -> RunData:
    """Return a run of 100 s with TRACK at 5 s and after each further TRACK ordered."""
    begun = [5.0, *(at_s for at_s, verb, _ in orders if verb is m.Verb.TRACK)]
    acks = [
        m.CommandAck(header=HEADER, command_id=str(at_s), verb=m.Verb.TRACK, stage=m.AckStage.ACCEPTED)
        for at_s in begun
    ]
    commands = [
        TimedMessage(at_s, m.Command(header=HEADER, id=str(at_s), verb=verb, scope=_names(scope), issuer="me"))
        for at_s, verb, scope in orders
    ]
    vehicles = {
        _names(letter)[0]: [
            TimedMessage(at_s, m.VehicleStatus(header=HEADER, flight_state=state, mode="HOVER")) for at_s, state in said
        ]
        for letter, said in told.items()
    }
    taken = [TimedMessage(at_s, ack) for at_s, ack in zip(begun, acks, strict=True)]
    return RunData(field, RunFacts(), end_s=100.0, acks=taken, commands=commands, vehicles=vehicles)


@pytest.mark.parametrize(("told", "orders", "spans"), [
    ({"a": [*FLIES, (60.0, LANDING), (62.0, LANDED)], "b": [*FLIES, (63.8, LANDED)]}, [], ((5.0, 63.8),)),
    ({"a": [*FLIES, (62.0, LANDED)], "b": FLIES}, [], ((5.0, 100.0),)),
    ({"a": [*FLIES, (62.0, LANDED)], "b": FLIES}, [(70.0, m.Verb.LAND, "b")], ((5.0, 70.0),)),
    # One of the team never rises, or is never heard.
    ({"a": [*FLIES, (62.0, LANDED)], "b": [(0.0, LANDED)]}, [], ((5.0, 62.0),)),
    ({"a": [*FLIES, (62.0, LANDED)], "b": [(0.0, UNKNOWN), (9.0, LOST)]}, [], ((5.0, 62.0),)),
    # One that is no longer heard may still fly.
    ({"a": [*FLIES, (62.0, LANDED)], "b": [*FLIES, (63.0, LOST)]}, [], ((5.0, 100.0),)),
    # Tracking ordered before the first rises, and nothing known of any.
    ({"a": [(0.0, LANDED), (8.0, FLYING), (62.0, LANDED)], "b": [(0.0, LANDED)]}, [], ((5.0, 62.0),)),
    ({}, [(40.0, m.Verb.LAND, "a")], ((5.0, 100.0),)),
    ({}, [(40.0, m.Verb.LAND, "")], ((5.0, 40.0),)),
    (
        {"a": [*FLIES, (30.0, LANDED), (40.0, FLYING)], "b": [*FLIES, (31.0, LANDED)]},
        [(39.0, m.Verb.TAKEOFF, "a"), (45.0, m.Verb.TRACK, ""), (80.0, m.Verb.LAND, "")],
        ((5.0, 31.0), (45.0, 80.0)),
    ),
])  # fmt: skip
def test_a_flight_ends_when_each_drone_is_ordered_down_or_on_the_floor(
    lab_field: ResolvedField, told: Mapping[str, Told], orders: Sequence[Order], spans: tuple[tuple[float, float], ...]
) -> None:
    assert tracking_spans(_data(lab_field, told, orders)) == spans


@pytest.mark.parametrize(("taken_s", "begun_s"), [((), 5.5), ((5.0,), 5.0), ((5.4,), 5.4)])
def test_a_flight_begins_with_its_mode_where_the_answers_to_track_are_not_recorded(
    lab_field: ResolvedField, taken_s: tuple[float, ...], begun_s: float
) -> None:
    data = _data(lab_field, {"a": [*FLIES, (62.0, LANDED)]}, [(60.0, m.Verb.LAND, "")])
    data.acks = [TimedMessage(at_s, data.acks[0].message) for at_s in taken_s]
    hovers = data.vehicles["drone_1"]
    told = [(5.5, "TRACK"), (20.0, "HOLD"), (30.0, "TRACK"), (60.1, "TRACK")]
    tracks = [TimedMessage(at_s, m.VehicleStatus(header=HEADER, flight_state=FLYING, mode=mode)) for at_s, mode in told]
    data.vehicles["drone_1"] = [*hovers[:2], *tracks, hovers[2]]
    assert tracking_spans(data) == ((begun_s, 60.0),)


def test_a_simulator_knows_when_a_drone_that_is_not_heard_comes_down(lab_field: ResolvedField) -> None:
    data = _data(lab_field, {name: [*FLIES, (30.0, LOST)] for name in "ab"})
    times = np.arange(0.0, 100.0)
    for name, down_s in (("drone_1", 40.0), ("drone_2", 50.0)):
        on_ground = (times < 2.0) | (times >= down_s)
        data.truth[name] = TruthTrack(times, np.zeros((100, 3)), np.zeros(100), on_ground)
    assert tracking_spans(data) == ((5.0, 50.0),)
