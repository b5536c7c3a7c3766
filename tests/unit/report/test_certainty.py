"""A flight without a truth is judged by how well the tracker itself knew targets and drones."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.bus import messages as m
from groundstation.field.resolved import ResolvedField
from groundstation.report.captured_truth import captured_tracks
from groundstation.report.criteria import criteria_of
from groundstation.report.metrics import figures_of
from groundstation.report.run_facts import RunFacts
from groundstation.report.tracks import CertaintyTrack, RunData, TimedMessage

TIMES = np.arange(0.0, 30.0, 0.02)


def known(age_s: float = 0.1, unlocalised_s: float = 0.0, doubted: tuple[float, float] = (0.0, 0.0)) -> CertaintyTrack:
    """Return an entity with the same figures all the time, but doubted for a part of it."""
    time_s, nothing = TIMES, np.zeros(len(TIMES))
    in_doubt = (time_s >= doubted[0]) & (time_s < doubted[1])
    return CertaintyTrack(time_s, nothing + age_s, nothing + unlocalised_s, in_doubt)


def until(track: CertaintyTrack, end_s: float) -> CertaintyTrack:
    """Return an entity that is in no later estimate."""
    kept = track.time_s <= end_s
    return CertaintyTrack(track.time_s[kept], track.age_s[kept], track.unlocalised_s[kept], track.doubted[kept])


@pytest.fixture
def flight(lab_field: ResolvedField) -> RunData:
    """Return a good flight of two drones without a truth: in the air from 2 to 27 s, it tracks from 5 to 25 s."""
    states = ((0.0, m.FlightState.LANDED, "LANDED"), (2.0, m.FlightState.HOVERING, "HOVER"),
              (5.0, m.FlightState.FLYING, "TRACK"), (25.5, m.FlightState.LANDING, "LANDING"),
              (27.0, m.FlightState.LANDED, "LANDED"))  # fmt: skip
    header = m.Header(0, "here", "team", "tester", 0)
    said = [TimedMessage(t, m.VehicleStatus(header=header, flight_state=state, mode=mode)) for t, state, mode in states]
    began = m.CommandAck(header=header, command_id="1", verb=m.Verb.TRACK, stage=m.AckStage.ACCEPTED)
    ended = m.Command(header=header, id="2", verb=m.Verb.LAND, scope=(), issuer="me")
    names = (*lab_field.drones, *lab_field.tracked)
    return RunData(
        lab_field,
        RunFacts(mode="fly"),
        end_s=30.0,
        acks=[TimedMessage(5.0, began)],
        commands=[TimedMessage(25.0, ended)],
        vehicles=dict.fromkeys(lab_field.drones, said),
        certainties={name: known() for name in names},
    )


@pytest.mark.parametrize(("gap_s", "unplanned_s"), [(0.0, 0.0), (2.5, 1.5), (6.0, 5.0)])
def test_time_without_a_plan_is_judged(flight: RunData, gap_s: float, unplanned_s: float) -> None:
    plans = [at_s for at_s in np.arange(4.0, 26.0, 0.1) if not 10.0 < at_s < 10.0 + gap_s]
    header = m.Header(0, "here", "team", "tracker", 0)
    plan = m.Plan(header=header, topology="a", cost=0.1, controls=(), edges=(), alternatives=(), mode="multistart",
                  solver=m.SolverReport("complete", 1, 0.01, 1, 1))  # fmt: skip
    flown = replace(flight, plans=[TimedMessage(float(at_s), plan) for at_s in plans])

    def judged(data: RunData) -> list[tuple[object, bool]]:
        found = criteria_of(figures_of(data), data.resolved, data.facts)
        return [(one.value, one.ok) for one in found if one.name == "unplanned_s"]

    assert judged(flown) == [(pytest.approx(unplanned_s, abs=0.11), unplanned_s <= 2.0)]
    dead = {name: until(known(), 10.0) for name in flight.certainties}
    assert judged(replace(flown, certainties=dead)) == [(0.0, True)], "a dead tracker is no fault of the planner"


def values(data: RunData) -> dict[str, tuple[object, bool]]:
    found = criteria_of(figures_of(data), data.resolved, data.facts)
    names = ("target_unseen_s", "drone_uncertain_s")
    return {one.name: (one.value, one.ok) for one in found if one.name in names}


def test_a_flight_whose_target_and_drones_were_known_meets_both(flight: RunData) -> None:
    assert values(flight) == {"target_unseen_s": (0.0, True), "drone_uncertain_s": (0.0, True)}


@pytest.mark.parametrize(
    ("target", "unseen_s"),
    [
        (None, 20.0),
        (until(known(), 20.0), 4.5),
        (known(doubted=(10.0, 16.0)), 6.0),
        (known(doubted=(1.0, 6.0)), 1.0),
        (known(age_s=3.5), 20.0),
        (known(age_s=2.9), 0.0),
    ],
    ids=["never found", "given up", "searched for", "found soon", "unseen for longer than lost_after_s", "seen"],
)
def test_a_target_that_was_not_seen_fails_the_flight(
    flight: RunData, target: CertaintyTrack | None, unseen_s: float
) -> None:
    (name,) = flight.tracked
    del flight.certainties[name]
    if target is not None:
        flight.certainties[name] = target
    assert values(flight)["target_unseen_s"] == (pytest.approx(unseen_s, abs=0.11), unseen_s <= 2.0)


@pytest.mark.parametrize(
    ("drone", "uncertain_s"),
    [
        (None, 20.0),
        (known(unlocalised_s=3.0), 3.0),
        (known(unlocalised_s=1e6), 20.0),
        (known(doubted=(10.0, 14.0)), 4.0),
        (known(doubted=(10.0, 11.0)), 1.0),
        (known(doubted=(26.0, 30.0)), 0.0),
    ],
    ids=["never joined", "unlocalised", "never seen", "contradicted", "contradicted for a moment", "while it lands"],
)
def test_a_drone_whose_place_was_unknown_fails_the_flight(
    flight: RunData, drone: CertaintyTrack | None, uncertain_s: float
) -> None:
    del flight.certainties["drone_2"]
    if drone is not None:
        flight.certainties["drone_2"] = drone
    assert values(flight)["drone_uncertain_s"] == (pytest.approx(uncertain_s, abs=0.11), uncertain_s <= 2.0)


def test_what_motion_capture_measured_is_not_judged_by_the_estimates(flight: RunData) -> None:
    turn = (1.0, 0.0, 0.0, 0.0)
    places = {name: (float(k), 0.0, 1.0) for k, name in enumerate(flight.drones)}
    header = m.Header(0, "here", "mocap", "mocap", 0)
    bodies = tuple(m.BodyPose(name, place, turn) for name, place in places.items())
    heard = [TimedMessage(t / 10, m.BodyPoses(header=header, bodies=bodies)) for t in range(300)]
    measured = replace(flight, truth=captured_tracks(heard, flight.vehicles))
    assert values(measured).keys() == {"target_unseen_s"}
