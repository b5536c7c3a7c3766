"""A robot is missing if a fixed camera should see it and does not; one that may be hidden is not."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.bus.messages import Header, SearchedPicture
from groundstation.control.missing_robots import MissingRobots
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, EntityKind, StateLayout
from groundstation.sensing.detection import detection
from groundstation.sensing.from_field import sensors_from_field
from groundstation.sensing.models import Box
from groundstation.sensing.visibility import camera_rows
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

SENSORS = sensors_from_field(resolved_field(load_field(Path(__file__).parents[3] / "config/lab.yaml")))
NAMES = ("drone_1", "drone_2")


def belief(first: tuple[float, ...], second: tuple[float, ...], stamp_ns: int, std_m: float = 0.05) -> JointBelief:
    layout = StateLayout()
    for name in NAMES:
        layout = layout.with_entity(name, EntityKind.ROBOT, ROBOT_CORE)
    return JointBelief(np.array([*first, *second]), std_m**2 * np.eye(8), layout, stamp_ns)


def missed(
    first: tuple[float, ...],
    second: tuple[float, ...],
    age_s: float = 2.0,
    std_m: float = 0.05,
    obstacles: tuple[Box, ...] = (),
    observer: str = "ceiling",
    found: tuple[str, ...] = ("drone_2",),
    unmeasured: tuple[str, ...] = (),
) -> tuple[list[str], MissingRobots]:
    """Return the missing robots after ten pictures without drone_1, or with the found ones."""
    said: list[str] = []
    watch = MissingRobots(replace(SENSORS, obstacles=obstacles), NAMES)
    for tick in range(1, 11):
        stamp_ns = tick * 100_000_000
        header = Header(stamp_ns, "c", observer, observer, tick)
        shown = {"found": found, "unmeasured": unmeasured}
        watch.take(SearchedPicture(header=header, observer=observer, camera=observer, **shown))
        said += watch.advance(belief(first, second, stamp_ns, std_m), {"drone_1": age_s, "drone_2": 0.1})
    return said, watch


def test_one_that_should_be_seen_is_missed_once_and_until_it_is_seen() -> None:
    said, watch = missed((0.5, 0.2, 1.6, 0.0), (-0.8, 0.0, 1.6, 0.0))
    assert said == ["drone_1"]
    assert watch.missed_s["drone_1"] == pytest.approx(0.6, abs=0.11)
    watch.advance(belief((0.5, 0.2, 1.6, 0.0), (-0.8, 0.0, 1.6, 0.0), 2_000_000_000), {"drone_1": 0.1, "drone_2": 0.1})
    assert watch.missed_s == {}


@pytest.mark.parametrize(
    ("first", "second", "age_s", "std_m"),
    [
        ((2.5, 0.2, 1.6, 0.0), (-0.8, 0.0, 1.6, 0.0), 2.0, 0.05),  # out of view
        ((0.5, 0.2, 1.1, 0.0), (0.4, 0.2, 1.9, 0.0), 2.0, 0.05),  # below another
        ((0.5, 0.2, 1.6, 0.0), (-0.8, 0.0, 1.6, 0.0), 0.3, 0.05),  # observed just now, by any camera
        ((0.9, 0.4, 1.6, 0.0), (-0.8, 0.0, 1.6, 0.0), 2.0, 0.4),  # too uncertain for a decision
    ],
)
def test_one_that_may_well_not_be_seen_is_not_missed(
    first: tuple[float, ...], second: tuple[float, ...], age_s: float, std_m: float
) -> None:
    said, watch = missed(first, second, age_s, std_m)
    assert said == []
    assert watch.missed_s == {}


def test_one_behind_a_pillar_is_not_missed() -> None:
    said, _ = missed((0.9, 0.4, 1.3, 0.0), (-0.8, 0.0, 1.6, 0.0), obstacles=(Box((0.75, 0.3), (0.3, 0.3, 3.0)),))
    assert said == []


HERE, THERE = (0.5, 0.2, 1.6, 0.0), (-0.8, 0.0, 1.6, 0.0)


@pytest.mark.parametrize(("age_s", "missed_one"), [(0.6, False), (0.61, True), (math.inf, False)])
def test_a_robot_seen_just_now_or_never_is_not_missing(age_s: float, missed_one: bool) -> None:
    assert bool(missed(HERE, THERE, age_s)[0]) is missed_one


@pytest.mark.parametrize(
    ("observer", "found", "said"),
    [("ceiling", (), ["drone_1"]), ("ceiling", NAMES, []), ("drone_2", (), [])],
    ids=["nobody", "both", "by a camera that moves"],
)
def test_only_pictures_of_fixed_cameras_without_it_count(
    observer: str, found: tuple[str, ...], said: list[str]
) -> None:
    assert missed(HERE, THERE, observer=observer, found=found)[0] == said


EYE = np.array(SENSORS.world["ceiling"].position_m)
BELOW = np.array([0.4, 0.2, 1.0])


def beside_the_line(share: float, aside_m: float) -> tuple[float, ...]:
    """Return a place on the line from the ceiling camera to BELOW, displaced sideways by this much."""
    line = BELOW - EYE
    across = np.cross(line, (0.0, 0.0, 1.0))
    return (*(EYE + share * line + aside_m * across / np.linalg.norm(across)).tolist(), 0.0)


@pytest.mark.parametrize(
    ("share", "aside_m", "said"),
    [(0.6, 0.4, []), (0.6, 0.6, ["drone_1"]), (1.3, 0.0, ["drone_1"]), (-0.2, 0.0, ["drone_1"])],
    ids=["in the line of sight", "beside it", "behind", "above the camera"],
)
def test_a_robot_possibly_hidden_by_another_is_not_missing(share: float, aside_m: float, said: list[str]) -> None:
    assert missed((*BELOW.tolist(), 0.0), beside_the_line(share, aside_m))[0] == said


def test_pictures_count_once_and_what_is_forgotten_begins_anew() -> None:
    _, watch = missed(HERE, THERE)
    assert watch.advance(belief(HERE, THERE, 1_500_000_000), {"drone_1": 2.0, "drone_2": 0.1}) == (), "told once"
    assert watch.missed_s["drone_1"] == pytest.approx(1.1, abs=0.11), "since it was first missed"
    watch.advance(belief(HERE, THERE, 1_600_000_000), {"drone_1": 0.1, "drone_2": 0.1})
    watch.advance(belief(HERE, THERE, 1_700_000_000), {"drone_1": 2.0, "drone_2": 0.1})
    assert watch.missed_s == {}, "no picture since"


EDGE = (1.15, 0.3, 1.3, 0.0)


@pytest.mark.parametrize("variances", [(0.0025, 0.01, 4.0, 9.0), (0.01, 0.0025, 4.0, 9.0)], ids=["y", "x"])
def test_pictures_weigh_by_the_chance_to_see_it_at_two_deviations_of_its_place(variances: tuple[float, ...]) -> None:
    marker = SENSORS.marker("drone_1", np.array(EDGE), is_robot=True)
    camera = camera_rows([SENSORS.world["ceiling"]], SENSORS.softness)[0]
    chance = detection(camera, np.zeros(4), 2.0 * 0.1, *marker.tolist())
    needed = math.ceil(math.log(0.02) / math.log(1.0 - chance))
    assert 10 < needed < 100, "so many that one more or less matters"
    watch = MissingRobots(SENSORS, NAMES)
    for tick in range(1, needed + 1):
        stamp_ns = tick * 100_000_000
        header = Header(stamp_ns, "c", "ceiling", "ceiling", tick)
        watch.take(SearchedPicture(header=header, observer="ceiling", camera="ceiling", found=("drone_2",)))
        now = replace(belief(EDGE, THERE, stamp_ns), covariance=np.diag(variances * 2))
        assert watch.advance(now, {"drone_1": 2.0}) == (("drone_1",) if tick == needed else ())


def test_one_that_may_be_the_unread_board_in_a_picture_is_not_missed() -> None:
    assert missed(HERE, THERE, found=(), unmeasured=("drone_1",))[0] == []


def test_one_who_does_not_fly_is_not_missed() -> None:
    said, watch = missed(HERE, THERE)
    assert said == ["drone_1"]
    watch.advance(belief(HERE, THERE, 2_000_000_000), {"drone_2": 0.1})
    assert watch.missed_s == {}
