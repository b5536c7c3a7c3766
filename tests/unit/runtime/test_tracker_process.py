"""The tracker's loop on a bus: its messages, its journal and the replay of it, its deadlines, its watch."""

import math
from collections import Counter
from typing import Any

import msgspec
import pytest
from tracker_lab import MS, PLACES, Lab

from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import (
    Belief,
    Estimate,
    JournalEntry,
    Plan,
    VelocitySetpoint,
    Verdict,
)
from groundstation.bus.topics import (
    ODOMETRY,
)
from groundstation.control.flight_mode import FlightMode
from groundstation.field.resolved import ResolvedField
from groundstation.replay.difference import first_difference
from groundstation.replay.rerun import Rerun
from groundstation.replay.tick_log import Tick
from groundstation.runtime import tracker_loop
from groundstation.runtime.deadlines import Deadlines
from groundstation.runtime.tracker_loop import TrackerSection, Tracking
from groundstation.runtime.unseen_watch import UnseenWatch
from groundstation.runtime.warm_up import warm_up


@pytest.fixture
def lab(lab_field: ResolvedField):
    lab = Lab(lab_field)
    yield lab
    lab.tracking.close()


def test_everything_that_others_wait_for_is_published(lab: Lab) -> None:
    lab.run(60, pause_s=0.002)
    heard = lab.messages()
    estimates: list[Estimate] = heard["estimate"]
    assert len(estimates) == 60
    assert {e.name for e in estimates[-1].entities} == {"drone_1", "drone_2", "turtlebot"}
    belief: Belief = heard["belief"][-1]
    assert len(heard["belief"]) == 6
    assert len(belief.covariance_upper) == len(belief.layout) * (len(belief.layout) + 1) // 2
    setpoints: list[VelocitySetpoint] = heard["setpoint"]
    assert {m.header.entity for m in setpoints} == set(PLACES)
    assert setpoints[-1].converged and setpoints[-1].epoch == 2000
    assert setpoints[-1].lifetime_ms == 300
    assert {m.verdict for m in heard["innovation"]} <= {Verdict.ACCEPTED, Verdict.INFLATED, Verdict.UNKNOWN_ENTITY}
    plans: list[Plan] = heard["plan"]
    assert plans and plans[-1].topology in {"drone_1,drone_2", "drone_1/drone_2", "drone_2/drone_1"}
    assert {c.robot for c in plans[-1].controls} == set(PLACES)


def test_drones_hover_once_the_planner_is_silent(lab: Lab) -> None:
    lab.run(60, pause_s=0.002)
    lab.tracking.close()  # like a planner that hangs: a submitted task never returns
    lab.messages()
    lab.run(160)  # in the meantime the limiter forgets that these drones have not obeyed
    setpoints: list[VelocitySetpoint] = lab.messages()["setpoint"]
    assert any(any(m.velocity_m_s) for m in setpoints[:20]), "the last plan's controls are flown on at first"
    assert {m.velocity_m_s for m in setpoints[-20:]} == {(0.0, 0.0, 0.0)}
    told = ["no new plan for 1 s: drones that track hover"]
    assert [n.text for n in lab.tracking.notices if "new plan" in n.text] == told
    lab.run(250)
    assert [n.text for n in lab.tracking.notices if "new plan" in n.text] == 2 * told, (
        "the alarm stands as long as this"
    )


def test_without_a_planner_drones_search_and_return_on(lab: Lab) -> None:
    lab.run(60, pause_s=0.002)
    lab.tracking.close()
    lab.run(60)
    lab.sees_target = False
    lab.run(round(50 * (lab.tracking.tracker.parameters.control.lost_after_s + 1.0)))
    lab.messages()
    lab.run(10)
    assert {m.velocity_m_s for m in lab.messages()["setpoint"]} != {(0.0, 0.0, 0.0)}, "the target is searched for"
    tracker = lab.tracking.tracker
    phases = {one.setpoint.phase for one in tracker.setpoints(lab.now).values()}
    assert FlightMode.SEARCH in phases and FlightMode.TRACK not in phases
    lab.run(round(50 * (tracker.parameters.control.return_within_s + 1.0)), look=False)
    limited = tracker.setpoints(lab.now).values()
    assert {one.setpoint.phase for one in limited} == {FlightMode.RETURN}
    assert not any("stale plan" in one.limited_by for one in limited)


def test_a_replayed_journal_says_the_same_to_the_bit(lab: Lab, lab_field: ResolvedField) -> None:
    lab.run(80, pause_s=0.002)
    heard = lab.messages()
    journal: list[JournalEntry] = heard.pop("journal")
    taken = [(str(received.key), received.message) for received in lab.tape.drain()]
    tape = {(key, message.header.seq): message for key, message in taken if message is not None}
    rerun = Rerun(lab_field, "lab", journal[0], 2)
    said: dict[str, list[Any]] = {}
    for entry in journal:
        inputs = [(key, tape[key, seq]) for key, seq in entry.ingested]
        for topic, message in rerun.tick(Tick(entry, entry.now_ns, inputs=inputs)):
            said.setdefault(topic.name, []).append(message)
    assert said.pop("journal") == journal
    assert set(said) == set(heard) == {"estimate", "belief", "setpoint", "plan", "innovation"}
    for name, messages in heard.items():
        assert len(said[name]) == len(messages)
        differences = map(first_difference, messages, said[name])
        assert not [difference for difference in differences if difference], name
    assert sum(entry.plan_tick >= 0 for entry in journal) >= 3


def test_garbage_is_counted_by_reason_and_reported_once(lab: Lab) -> None:
    bus = lab.buses["drone_1"]
    for payload in (b"", b"\xff", b"{}", b'{"header":null}', b"[" * 5000):
        bus.put(ODOMETRY, "drone_1", payload, b"")
    lab.run(51)
    assert lab.tracking.inbox.refused["malformed"] == 5
    texts = [notice.text for notice in lab.tracking.notices]
    assert texts.count("messages are refused: malformed") == 1


def hurried(field: ResolvedField) -> ResolvedField:
    safety = msgspec.structs.replace(field.safety, unseen_land_after_s=2.0)
    return msgspec.structs.replace(field, safety=safety)


def unseen(lab: Lab) -> list[str]:
    return [notice.entity for notice in lab.tracking.notices if "well enough where it is" in notice.text]


def test_a_drone_that_nobody_sees_is_named_when_odometry_is_trusted_no_more(lab_field: ResolvedField) -> None:
    """However good its position still is by odometry: after three times the limit, never before twice."""
    lab = Lab(hurried(lab_field))
    lab.run(25)
    lab.run(round(4.0 * 50), look=False)
    assert unseen(lab) == []
    lab.run(round(2.6 * 50), look=False)
    lab.tracking.close()
    assert set(unseen(lab)) == {"drone_1", "drone_2"}
    assert "command" not in lab.messages()


def test_a_drone_that_was_never_seen_is_named(lab_field: ResolvedField) -> None:
    lab = Lab(hurried(lab_field))
    lab.run(95, look=False)
    assert unseen(lab) == []
    lab.run(10, look=False)
    assert set(unseen(lab)) == {"drone_1", "drone_2"}
    lab.tracking.close()


def test_an_unseen_robot_is_told_once_a_second_until_it_has_landed() -> None:
    watch = UnseenWatch(10.0)
    told = [t for t in range(0, 14_000, 100) if watch.step(t * MS, {"a": math.inf})]
    assert told == [10_000, 11_000, 12_000, 13_000]
    assert watch.step(14_000 * MS, {}) == []
    assert watch.step(14_100 * MS, {"a": math.inf}) == []
    assert watch.step(20_000 * MS, {"a": 0.1}) == []
    assert watch.step(24_200 * MS, {"a": 4.3}) == []


def test_a_robot_whose_belief_was_given_up_in_flight_has_time_to_be_seen_again() -> None:
    watch = UnseenWatch(10.0)
    assert not any(watch.step(t * MS, {"a": 0.0}) for t in range(0, 60_000, 100))
    assert not any(watch.step(t * MS, {"a": math.inf}) for t in range(60_000, 69_000, 100)), "it is seen again by then"
    assert watch.step(71_000 * MS, {"a": math.inf}) == ["a"]


def test_late_ticks_are_counted_and_not_made_up_for() -> None:
    deadlines = Deadlines(20 * MS, 0)
    deadlines.start_tick(5 * MS)
    deadlines.start_tick(31 * MS)  # 11 ms late
    assert (deadlines.ticks, deadlines.overruns) == (2, 1)
    deadlines.start_tick(140 * MS)  # 100 ms late: five ticks were missed
    assert deadlines.overruns == 1 + 6
    assert deadlines.next_ns > 140 * MS
    deadlines.start_tick(deadlines.next_ns)
    assert deadlines.overruns == 7


def test_nothing_compiles_after_the_warm_up(lab: Lab, lab_field: ResolvedField) -> None:
    from numba.core import event

    warm_up(lab_field)
    with event.install_recorder("numba:compile") as recorder:
        lab.run(30, pause_s=0.002)
    assert recorder.buffer == []


def test_no_tick_does_more_than_two_things_that_are_not_due_at_each(lab_field: ResolvedField) -> None:
    tracking = Tracking(MemoryBus(MemoryExchange(), "lab", "tracker"), TrackerSection(lab_field))
    phases = {
        "plan": (tracking._plan_every, tracker_loop._PLAN_PHASE),
        "belief": (tracking._belief_every, tracker_loop._BELIEF_PHASE),
        "map": (tracking._map_every, tracker_loop._MAP_PHASE),
        "watch": (tracking.rate_hz, tracker_loop._WATCH_PHASE),
    }
    done: Counter[str] = Counter()
    for tick in range(tracking.rate_hz):
        tracking._tick = tick
        due = [name for name, (every, phase) in phases.items() if tracking._is_due(every, phase)]
        assert len(due) <= 2, (tick, due)
        done.update(due)
    tracking.close()
    assert done == {"plan": 10, "belief": 5, "map": 2, "watch": 1}
