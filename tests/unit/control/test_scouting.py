"""Which robot is spared to search for a missing target, and that nobody who tracks loses sight of the room by it."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.control.flight_mode import FlightMode
from groundstation.control.moment import Moment, Sight
from groundstation.control.parameters import control_from_field
from groundstation.control.scouting import scout_of
from groundstation.control.setpoints import HOVER, Setpoint
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, TARGET_CORE, EntityKind, StateLayout
from groundstation.sensing.from_field import sensors_from_field
from groundstation.sensing.topology import Topology
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field
from groundstation.tracker import tracker_from_field

LAB = resolved_field(load_field(Path(__file__).parents[3] / "config/lab.yaml"))
SENSORS, CONTROL = sensors_from_field(LAB), control_from_field(LAB)
Place = tuple[float, float]


def moment(
    places: Sequence[Place], searching: tuple[str, ...] = (), target: Place = (0.5, 0.0), speed_m_s: float = 0.0
) -> Moment:
    """Return a moment with robots `a`, `b`, ... at these places, and two targets of which one is missing."""
    layout, mean = StateLayout(), []
    names = "abcd"[: len(places)]
    for name, place in zip(names, places, strict=True):
        layout = layout.with_entity(name, EntityKind.ROBOT, ROBOT_CORE)
        mean += [*place, 1.4, 0.0]
    layout = layout.with_entity("turtlebot", EntityKind.TARGET, TARGET_CORE)
    mean += [*target, speed_m_s, 0.0]
    belief = JointBelief(np.array(mean), 0.01 * np.eye(len(mean)), layout, 0)
    sensors = replace(SENSORS, marker_height_m={**SENSORS.marker_height_m, **dict.fromkeys(names, 0.08)})
    return Moment(
        belief,
        tuple(names),
        CONTROL,
        sensors,
        Sight(0.1, missing=("other",), before=dict.fromkeys(searching, FlightMode.SEARCH)),
    )


def scout(topology: str, now: Moment) -> str | None:
    return scout_of(now.robots, Topology.parse(topology), now)


@pytest.mark.parametrize(
    ("topology", "places", "spared"),
    [
        ("a,b", [(0.2, 0.5), (-0.6, -0.5)], "b"),
        ("a/b", [(-0.6, 0.5), (0.2, -0.5)], "a"),
        ("a/b", [(0.3, 0.5), (2.5, 0.0)], None),
        ("a,b", [(0.3, 0.5), (2.5, 0.0)], None),
        ("a,b/c", [(-0.4, 0.5), (0.3, -0.5), (2.5, 0.0)], "a"),
        ("a/b/c", [(-0.4, 0.5), (2.0, 0.0), (3.0, 0.0)], None),
        ("a/b,c", [(-0.4, 0.5), (1.7, 0.5), (3.0, 0.0)], "b"),
    ],
    ids=[
        "all in view",
        "levels in view",
        "relay",
        "outside before the plan has a relay",
        "two relays",
        "chain",
        "fork",
    ],
)
def test_the_farthest_robot_is_spared_on_which_no_other_depends(
    topology: str, places: list[Place], spared: str | None
) -> None:
    target = (2.5, 0.3) if max(x for x, _ in places) > 1.0 else (0.5, 0.0)
    assert scout(topology, moment(places, target=target)) == spared


@pytest.mark.parametrize(("farther_m", "expected"), [(0.4, "a"), (0.6, "b")])
def test_one_that_searches_goes_on_unless_another_is_much_farther(farther_m: float, expected: str) -> None:
    places = [(0.5, 0.6), (-0.1 - farther_m, 0.0)]
    assert scout("a,b", moment(places)) == "b"
    assert scout("a,b", moment(places, searching=("a",))) == expected
    assert scout("a,b", moment(places, searching=("a", "b"))) == "b"


def test_a_robot_at_the_border_of_the_view_calls_no_scout_back_again_and_again() -> None:
    (view,) = SENSORS.root_views(1.48)
    for outside_m, sent, goes_on in ((-0.1, "b", "b"), (0.1, None, "b"), (0.4, None, None)):
        places = [(view.x_m[1] + outside_m, 0.0), (-1.2, 0.0)]
        assert scout("a,b", moment(places)) == sent
        assert scout("a,b", moment(places, searching=("b",))) == goes_on


@pytest.mark.parametrize(("speed_m_s", "spared"), [(0.0, "b"), (-0.3, "b"), (0.3, None)])
def test_a_scout_is_called_back_in_time_before_the_target_leads_the_others_out_of_the_view(
    speed_m_s: float, spared: str | None
) -> None:
    """In a corridor it was two metres behind when its team needed it between the target and the fixed camera."""
    places = [(0.9, 0.0), (-0.9, 0.0)]
    assert scout("a,b", moment(places, ("b",), (1.7, 0.0), speed_m_s)) == spared


def test_the_tracker_remembers_who_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    sights: list[Sight] = []

    def searching(*inputs: Any) -> dict[str, Setpoint]:
        sights.append(inputs[-1])
        return {"drone_1": replace(HOVER, phase=FlightMode.SEARCH)}

    monkeypatch.setattr("groundstation.tracker.setpoints_from_plan", searching)
    tracker = tracker_from_field(LAB, "c", 1)
    for now_ns in (10**9, 10**9 + 20_000_000):
        tracker.setpoints(now_ns)
    assert [dict(sight.before) for sight in sights] == [{}, {"drone_1": FlightMode.SEARCH}]


def test_a_robot_whose_pictures_stay_away_is_not_spared_to_search() -> None:
    now = moment([(0.2, 0.5), (-0.6, -0.5), (-0.4, 0.6)])
    assert scout("a,b,c", now) == "b"
    assert scout("a,b,c", replace(now, sight=replace(now.sight, blind={"b"}))) == "c"
