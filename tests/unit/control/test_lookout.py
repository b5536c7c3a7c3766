"""Operator notices about searches and missing robots."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.bus.messages import (
    FlightState,
    Header,
    RelativeObservation,
    SearchedPicture,
    Severity,
    VehicleStatus,
)
from groundstation.control.lookout import Lookout
from groundstation.control.parameters import control_from_field
from groundstation.control.search_parameters import search_from_field
from groundstation.control.search_state import SearchMode
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, TARGET_CORE, EntityKind, StateLayout
from groundstation.sensing.from_field import sensors_from_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

LAB = resolved_field(load_field(Path(__file__).parents[3] / "config/lab.yaml"))


def belief(stamp_s: float) -> JointBelief:
    layout = StateLayout().with_entity("drone_1", EntityKind.ROBOT, ROBOT_CORE)
    layout = layout.with_entity("turtlebot", EntityKind.TARGET, TARGET_CORE)
    mean, variances = np.array([0.0, 0.0, 1.6, 0.0, 1.0, 0.0, 0.0, 0.0]), [0.03**2] * 4 + [0.1**2] * 4
    return JointBelief(mean, np.diag(variances), layout, round(stamp_s * 1e9))


def driver_in(mode: str, *, braked: bool = False) -> VehicleStatus:
    header = Header(0, "c", "drone_1", "driver", 1)
    return VehicleStatus(header=header, flight_state=FlightState.FLYING, mode=mode, braked=braked)


def sighting(observer: str, stamp_s: float) -> RelativeObservation:
    header = Header(round(stamp_s * 1e9), "c", observer, f"{observer}_camera", 1)
    covariance = tuple((0.01 * np.eye(4)).ravel().tolist())
    return RelativeObservation(
        header=header, observer=observer, subject="turtlebot", camera=f"{observer}_camera", position_m=(0.0, 0.0, 1.5),
        yaw_rad=0.0, covariance=covariance, margin=2.0, roll_rad=0.0, pitch_rad=0.0,
    )  # fmt: skip


def lookout_of_the_lab() -> Lookout:
    return Lookout(
        search_from_field(LAB), control_from_field(LAB), sensors_from_field(LAB), ("drone_1",), ("turtlebot",)
    )


def look_in_vain(lookout: Lookout, unmeasured: tuple[str, ...] = (), free: tuple[str, ...] = ("drone_1",)) -> None:
    """Take 2.8 s of pictures without the target, longer than an occlusion may last.

    unmeasured: whom they may show; free: robots that can search.
    """
    for tick in range(1, 140):
        now_s = 0.02 * (tick + 1)
        header = Header(round(now_s * 1e9), "c", "drone_1", "drone_1_camera", tick)
        if tick % 5 == 0:
            camera = "drone_1_camera"
            lookout.take(SearchedPicture(header=header, observer="drone_1", camera=camera, unmeasured=unmeasured))
        lookout.advance(belief(now_s), {"drone_1": 0.1, "turtlebot": now_s}, {"drone_1": 0.1})
        lookout.stands(free, lookout.missing, belief(now_s))


def test_a_loss_is_told_at_once_with_where_it_is_searched_and_so_is_its_end() -> None:
    lookout = lookout_of_the_lab()
    lookout.take(driver_in("TRACK"))
    lookout.advance(belief(0.02), {"drone_1": 0.1, "turtlebot": 0.1}, {"drone_1": 0.1})
    lookout.take_notices()
    assert lookout.searches(0) == ()
    look_in_vain(lookout)
    unseen, notice = lookout.take_notices()
    assert unseen.text == "turtlebot is not seen for 0.6 s: it may be hidden near (1.0, 0.0)"
    assert (unseen.severity, unseen.entity) == (Severity.WARNING, "turtlebot")
    assert notice.severity is Severity.WARNING
    assert notice.entity == "turtlebot"
    assert "searches around" in notice.text
    (search,) = lookout.searches(round(2.8e9))
    assert (search.target, search.mode) == ("turtlebot", "SEARCH")
    assert 0.0 < search.since_s < 1.6
    assert 0.0 < search.searched < 0.5
    assert search.expected_s is not None
    assert math.hypot(search.place_m[0] - 1.0, search.place_m[1]) > 0.2
    assert "of the room done" in search.text
    assert lookout.maps()["turtlebot"].chances.sum() == pytest.approx(1.0)
    lookout.advance(belief(2.9), {"drone_1": 0.1, "turtlebot": 0.1}, {"drone_1": 0.1})
    assert [notice.text for notice in lookout.take_notices()] == ["turtlebot is found"]
    assert lookout.searches(round(2.9e9)) == ()
    assert lookout.maps() == {}


def test_a_loss_that_no_robot_is_free_to_search_for_is_told_as_that() -> None:
    lookout = lookout_of_the_lab()
    lookout.take(driver_in("TRACK"))
    lookout.advance(belief(0.02), {"drone_1": 0.1, "turtlebot": 0.1}, {"drone_1": 0.1})
    lookout.take_notices()
    look_in_vain(lookout, free=())
    _, notice = lookout.take_notices()
    assert notice.text == "turtlebot is not where it was expected, and no drone is free to search"
    assert "check its marker" in notice.remedy
    assert lookout.searches(round(2.8e9))[0].expected_s is None


def test_pictures_with_a_board_that_may_be_the_targets_are_no_evidence_that_it_is_elsewhere() -> None:
    """The map was emptied just where the target stood, with glare on its bar or a spare print beside it."""
    chances = []
    for unmeasured in ((), ("turtlebot",)):
        lookout = lookout_of_the_lab()
        lookout.take(driver_in("TRACK"))
        lookout.advance(belief(0.02), {"drone_1": 0.1, "turtlebot": 0.1}, {"drone_1": 0.1})
        look_in_vain(lookout, unmeasured)
        room = lookout.targets["turtlebot"].room
        assert room is not None
        chances.append(room.mass_near(np.array([1.0, 0.0]), 0.01 * np.eye(2), 2.0, 0.5))
    assert chances[0] < 0.3 < 0.6 < chances[1]


def test_floor_that_nobody_can_see_is_told_and_not_counted() -> None:
    search = replace(search_from_field(LAB), fence_x_m=(-1.0, 1.0), fence_y_m=(-0.8, 0.8))
    lookout = Lookout(search, control_from_field(LAB), sensors_from_field(LAB), ("drone_1",), ("turtlebot",))
    lookout.take(driver_in("TRACK"))
    lookout.advance(belief(0.02), {"drone_1": 0.1, "turtlebot": 0.1}, {"drone_1": 0.1})
    look_in_vain(lookout)
    (told,) = lookout.searches(round(2.8e9))
    assert re.fullmatch(r"the \d\d% of the room that the team can see", told.floor)
    assert f"% of {told.floor} done" in told.text


def test_a_target_that_comes_into_view_again_is_said_to_be_seen() -> None:
    lookout = lookout_of_the_lab()
    lookout.take(driver_in("TRACK"))
    told = []
    for tick, unseen_s in enumerate((0.1, 0.59, 0.61, 0.9, 0.1, 0.2), 1):
        lookout.advance(belief(0.02 * tick), {"drone_1": 0.1, "turtlebot": unseen_s}, {"drone_1": 0.1})
        told.append([notice.text for notice in lookout.take_notices()])
    hidden = "turtlebot is not seen for 0.6 s: it may be hidden near (1.0, 0.0)"
    assert told == [["turtlebot is found"], [], [hidden], [], ["turtlebot is seen again"], []]


def test_a_picture_that_shows_a_target_elsewhere_hides_it_from_nobody() -> None:
    """The filter may refuse the observation; the target is seen all the same."""
    lookout = lookout_of_the_lab()
    lookout.take(driver_in("TRACK"))
    lookout.advance(belief(0.02), {"drone_1": 0.1, "turtlebot": 0.1}, {"drone_1": 0.1})
    lookout.take_notices()
    for stamp_s, seen_s in ((0.9, 0.5), (2.9, 2.5), (4.9, 4.5)):
        lookout.see(sighting("drone_1", seen_s))
        lookout.advance(belief(stamp_s), {"drone_1": 0.1, "turtlebot": stamp_s}, {"drone_1": 0.1})
        assert lookout.take_notices() == []
        assert lookout.targets["turtlebot"].mode is SearchMode.TRACK


def test_a_search_begins_as_late_as_the_last_sighting_and_not_as_the_last_searched_picture() -> None:
    """That picture may be a second older, or just have come: the search for a displaced target then began later."""
    lookout = lookout_of_the_lab()
    lookout.take(driver_in("TRACK"))
    lookout.see(sighting("drone_1", 0.5))
    header = Header(round(0.5e9), "c", "drone_1", "drone_1_camera", 1)
    lookout.take(SearchedPicture(header=header, observer="drone_1", camera="drone_1_camera", found=("turtlebot",)))
    for stamp_s, doubted in ((1.05, False), (1.15, True)):
        lookout.advance(belief(stamp_s), {"drone_1": 0.1, "turtlebot": stamp_s - 0.5}, {"drone_1": 0.1})
        assert (lookout.targets["turtlebot"].room is not None) is doubted


def test_observations_by_cameras_that_must_not_observe_targets_are_ignored() -> None:
    lookout = lookout_of_the_lab()
    lookout.take(driver_in("TRACK"))
    lookout.advance(belief(0.02), {"drone_1": 0.1, "turtlebot": 0.1}, {"drone_1": 0.1})
    lookout.see(sighting("ceiling", 0.8))
    lookout.advance(belief(0.9), {"drone_1": 0.1, "turtlebot": 0.8}, {"drone_1": 0.1})
    assert lookout.targets["turtlebot"].room is not None


def test_nobody_is_said_to_search_who_lands_or_holds() -> None:
    lookout = lookout_of_the_lab()
    lookout.take(driver_in("TRACK"))
    lookout.advance(belief(0.02), {"drone_1": 0.1, "turtlebot": 0.1}, {"drone_1": 0.1})
    assert [notice.text for notice in lookout.take_notices()] == ["turtlebot is found"]
    lookout.take(driver_in("LANDING"))
    look_in_vain(lookout)
    assert lookout.missing == ("turtlebot",)
    assert lookout.take_notices() == []
    assert lookout.searches(round(2.8e9)) == ()
    lookout.take(driver_in("TRACK"))
    lookout.advance(belief(2.84), {"drone_1": 0.1, "turtlebot": 2.8}, {"drone_1": 0.1})
    (notice,) = lookout.take_notices()
    assert "the team searches around" in notice.text
    assert [search.target for search in lookout.searches(round(2.84e9))] == ["turtlebot"]


def test_a_robot_that_follows_no_setpoints_is_held_while_another_does() -> None:
    two = Lookout(
        search_from_field(LAB), control_from_field(LAB), sensors_from_field(LAB), ("drone_1", "drone_2"), ("turtlebot",)
    )
    two.take(driver_in("HOVER"))
    assert (two.unsteered, two.held) == (("drone_1",), frozenset({"drone_1"}))
    alone = lookout_of_the_lab()
    alone.take(driver_in("HOVER"))
    assert (alone.unsteered, alone.held) == (("drone_1",), frozenset())


def test_a_robot_that_a_failsafe_brakes_is_steered_but_not_moved() -> None:
    lookout = lookout_of_the_lab()
    lookout.take(driver_in("TRACK", braked=True))
    assert (lookout.unsteered, lookout.unmoved) == ((), frozenset({"drone_1"}))
    lookout.take(driver_in("TRACK"))
    assert lookout.unmoved == frozenset()
    lookout.take(driver_in("HOVER"))
    assert lookout.unmoved == frozenset({"drone_1"})
