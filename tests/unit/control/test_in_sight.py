"""Robots that fly on our estimate cross between views straight, at speed, and only over short gaps."""

from collections.abc import Mapping

import numpy as np
import pytest

from groundstation.control.in_sight import is_between_views, kept_in_sight
from groundstation.control.moment import Moment, Sight
from groundstation.control.parameters import ControlParameters
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, EntityKind, StateLayout
from groundstation.planning.parameters import MotionLimits
from groundstation.sensing.models import Rectangle

MOST_M_S, NARROWS = 0.6, 0.5
PARAMETERS = ControlParameters(1.5, fed=frozenset({"fed"}), limits={"fed": MotionLimits(max_speed_m_s=MOST_M_S)})
HELPED, ALONE = Sight(helped_s={"fed": 0.2}), Sight(helped_s={"fed": 0.6})
Place = tuple[float, float, float]


class Views:
    """Views that get narrower by half of the height, in each direction."""

    def __init__(self, *floor: Rectangle) -> None:
        self._floor = floor
        self.marker_height_m = {"fed": 0.0, "other": 0.0}

    def root_views(self, height_m: float) -> tuple[Rectangle, ...]:
        return tuple(view.shrunk(NARROWS * height_m) for view in self._floor)


ONE = Views(Rectangle((-3.0, 0.3), (-1.5, 1.5)))
TWO = Views(Rectangle((-3.0, 0.3), (-1.5, 1.5)), Rectangle((-0.3, 3.0), (-1.5, 1.5)))  # 0.4 m apart at 1 m of height
OVERLAPPING = Views(Rectangle((-3.0, 0.9), (-1.5, 1.5)), Rectangle((-0.9, 3.0), (-1.5, 1.5)))
THREE = Views(*TWO._floor, Rectangle((-2.5, -0.5), (1.0, 4.0)))


def moment(views: Views, place: Place, sight: Sight = ALONE, others: Mapping[str, Place] | None = None) -> Moment:
    layout, mean = StateLayout(), list[float]()
    for name, (x, y, z) in {"fed": place, **(others or {})}.items():
        layout = layout.with_entity(name, EntityKind.ROBOT, ROBOT_CORE)
        mean += [x, y, z, 0.0]
    belief = JointBelief(np.array(mean), 1e-4 * np.eye(len(mean)), layout, 0)
    return Moment(belief, layout.robots, PARAMETERS, views, sight)  # type: ignore[arg-type]


def kept(
    views: Views, place: Place, velocity: tuple[float, float], level_m: float, sight: Sight = ALONE,
    others: Mapping[str, Place] | None = None,
) -> tuple[float, float, float]:  # fmt: skip
    """Return its velocity and level."""
    now = moment(views, place, sight, others)
    return _flat(kept_in_sight("fed", velocity, level_m, 3.0 * float(np.hypot(*velocity)), now))


def _flat(found: tuple[tuple[float, float], float]) -> tuple[float, float, float]:
    (vx, vy), level_m = found
    return vx, vy, level_m


def test_it_crosses_a_short_gap_at_full_speed_and_does_not_climb() -> None:
    vx, vy, level_m = kept(TWO, (-0.3, 0.2, 1.0), (0.3, 0.0), 1.5)
    assert (vx, vy) == pytest.approx((MOST_M_S, 0.0)) and level_m < 1.0


@pytest.mark.parametrize("views", [TWO, OVERLAPPING, THREE])
def test_far_from_a_border_it_flies_its_plan(views: Views) -> None:
    assert kept(views, (-1.2, 0.2, 1.0), (0.6, 0.1), 1.2) == pytest.approx((0.6, 0.1, 1.2))


@pytest.mark.parametrize("views", [ONE, TWO, THREE])
def test_it_does_not_enter_a_gap_to_stay_there(views: Views) -> None:
    """A real PX4 entered it at 0.1 m/s."""
    assert kept(views, (-0.25, 0.2, 1.0), (0.15, 0.1), 1.0) == pytest.approx((0.05, 0.1, 1.0))


def test_without_another_view_it_is_held_at_the_border() -> None:
    assert kept(ONE, (-0.25, 0.2, 1.0), (0.6, 0.0), 1.0) == pytest.approx((0.05, 0.0, 1.0))
    assert kept(ONE, (-0.15, 0.2, 1.0), (0.6, 0.0), 1.0)[:2] == pytest.approx((-0.45, 0.0))


def test_before_a_gap_that_is_too_wide_at_its_height_it_waits_and_sinks() -> None:
    assert kept(TWO, (-0.55, 0.2, 1.5), (0.6, 0.0), 1.5) == pytest.approx((0.1, 0.0, 1.0))  # 0.9 m
    assert kept(TWO, (-0.95, 0.2, 2.2), (0.6, 0.0), 2.2) == pytest.approx((0.15, 0.0, 2.2))  # 1.6 m


@pytest.mark.parametrize(("speed", "crosses"), [(0.0, False), (0.5, True)])
def test_it_enters_a_gap_only_as_fast_as_takes_it_through_in_time(speed: float, crosses: bool) -> None:
    """A real vehicle that started at the border was out of view for up to 1.5 s."""
    moving = Sight(helped_s=ALONE.helped_s, velocities_m_s={"fed": np.array([speed, 0.0, 0.0])})
    vx, _, level_m = kept(TWO, (-0.26, 0.2, 1.1), (0.6, 0.0), 1.1, moving)  # 0.5 m wide
    assert (vx == pytest.approx(MOST_M_S)) == crosses
    assert level_m < 1.1, "it sinks to where the gap is short enough, or flies on"


def test_a_vehicle_that_follows_late_stops_before_the_border() -> None:
    """A real one, limited by its position instead of its stopping point, flew out of its view."""
    x, speed, step_s = -0.9, 0.4, 0.05
    for _ in range(round(5.0 / step_s)):
        moving = Sight(velocities_m_s={"fed": np.array([speed, 0.0, 0.0])})
        told, _, _ = kept(ONE, (x, 0.2, 1.0), (0.6, 0.0), 1.0, moving)
        speed += (told - speed) * step_s / 0.7
        x += speed * step_s
        assert x < -0.2 + 0.01
    assert x > -0.3


def test_a_robot_located_by_others_crosses_short_gaps_if_planned_halfway() -> None:
    for wanted, told in ((0.15, MOST_M_S), (0.08, 0.05)):
        assert kept(TWO, (-0.25, 0.2, 1.0), (wanted, 0.0), 1.0, HELPED)[0] == pytest.approx(told)


def test_a_robot_located_by_others_crosses_a_wide_gap_as_planned() -> None:
    assert kept(TWO, (-0.55, 0.2, 1.5), (0.2, 0.0), 1.7, HELPED) == pytest.approx((0.2, 0.0, 1.7))
    assert kept(TWO, (0.1, 0.2, 1.5), (-0.1, 0.0), 1.7, HELPED) == pytest.approx((-0.1, 0.0, 1.7))


@pytest.mark.parametrize("sight", [ALONE, HELPED])
@pytest.mark.parametrize(("moving", "across"), [(0.3, 1.0), (-0.3, -1.0)])
def test_in_the_midst_of_a_short_gap_it_goes_on_whatever_it_plans(sight: Sight, moving: float, across: float) -> None:
    """A plan reversed there, and the vehicle stood until it was landed."""
    sight = Sight(helped_s=sight.helped_s, velocities_m_s={"fed": np.array([moving, 0.0, 0.0])})
    for wanted in (0.5, 0.0, -0.5):
        vx, vy, level_m = kept(TWO, (0.02, 0.2, 1.0), (wanted, 0.1), 1.5, sight)
        assert vx * across == pytest.approx(MOST_M_S) and vy == pytest.approx(0.1)
        assert level_m < 1.0


def test_it_waits_where_its_drift_or_another_robot_would_keep_it_in_the_gap() -> None:
    against = Sight(drifts_m_s={"fed": np.array([-0.3, 0.0, 0.0])})
    assert kept(TWO, (-0.3, 0.2, 1.0), (0.6, 0.0), 1.0, against)[:2] == pytest.approx((0.1, 0.0))
    for x, vx in ((1.0, 0.1), (2.5, MOST_M_S)):
        told = kept(TWO, (-0.3, 0.2, 1.0), (0.6, 0.0), 1.0, others={"other": (x, 0.2, 1.4)})
        assert told[:2] == pytest.approx((vx, 0.0))


def test_overlapping_views_are_passed_at_the_speed_of_the_plan_and_climbed_in() -> None:
    assert kept(OVERLAPPING, (0.0, 0.2, 1.0), (0.3, 0.0), 1.2) == pytest.approx((0.3, 0.0, 1.2))


def test_into_a_third_view_it_flies_along_the_axis_that_it_is_on() -> None:
    moving = Sight(helped_s=ALONE.helped_s, velocities_m_s={"fed": np.array([0.1, 0.4, 0.0])})
    vx, vy, _ = kept(THREE, (-1.5, 0.85, 1.0), (0.1, 0.4), 1.0, moving)  # from y = 1.0 to 1.5
    assert vy > 0.58 and abs(vx) < 0.16


def test_it_climbs_only_where_there_is_a_view_higher_up_as_well() -> None:
    assert kept(TWO, (-0.4, 0.2, 1.0), (0.0, 0.0), 1.5)[2] == pytest.approx(1.5)
    assert kept(TWO, (-0.3, 0.2, 1.0), (0.0, 0.0), 1.5) == pytest.approx((-0.15, 0.0, 1.0))


def test_a_vehicle_with_its_own_position_is_not_held() -> None:
    now = moment(ONE, (-1.0, 0.0, 1.0), others={"other": (0.5, 0.2, 1.0)})
    assert _flat(kept_in_sight("other", (0.6, 0.1), 2.0, 9.0, now)) == (0.6, 0.1, 2.0)


def test_without_views_that_look_down_nobody_is_held() -> None:
    assert kept(Views(), (0.0, 0.0, 1.0), (0.6, 0.1), 2.0) == pytest.approx((0.6, 0.1, 2.0))
    assert not is_between_views("fed", moment(Views(), (0.0, 0.0, 1.0)))


def test_others_know_who_is_between_views() -> None:
    assert is_between_views("fed", moment(TWO, (0.0, 0.0, 1.0)))
    assert not is_between_views("fed", moment(TWO, (-0.5, 0.0, 1.0)))
