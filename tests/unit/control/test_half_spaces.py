"""The nearest velocity that half-spaces permit, in cases worked out by hand."""

import numpy as np
import pytest

from groundstation.control.half_spaces import TOLERANCE_M_S, project

NORMALS = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def test_an_allowed_velocity_is_unchanged() -> None:
    wanted = np.array([0.1, -0.2, 0.7])
    found, met = project(wanted, NORMALS, np.array([0.2, 0.2, 0.0]))
    assert found.tolist() == wanted.tolist() and met == []
    at_the_wall, met = project(wanted, NORMALS, np.array([0.1 - TOLERANCE_M_S / 2, 0.2, 0.0]))
    assert at_the_wall.tolist() == wanted.tolist() and met == []


def test_the_worst_is_met_first_and_each_is_named() -> None:
    found, met = project(np.array([0.5, 0.4, 0.1]), NORMALS, np.array([0.2, 0.0, 0.3]))
    assert found == pytest.approx((0.2, 0.3, 0.1), abs=1e-12) and met == [0, 2]


def test_a_wall_that_pushes_is_obeyed_where_there_is_room() -> None:
    found, met = project(np.array([0.5, 0.0, 0.0]), NORMALS, np.array([-0.2, 0.3, 0.3]))
    assert found == pytest.approx((-0.2, 0.0, 0.0), abs=1e-12) and met == [0]


@pytest.mark.parametrize(("pushes", "leaves"), [(0.2, 0.07), (0.2, 0.11), (0.9, 0.4)])
def test_where_there_is_too_little_room_as_little_as_it_takes_is_let_off(pushes: float, leaves: float) -> None:
    found, met = project(np.array([0.5, 0.4, 0.1]), NORMALS, np.array([-pushes, leaves, 0.3]))
    assert -leaves - TOLERANCE_M_S <= found[0] <= -leaves + pushes / 256 + TOLERANCE_M_S
    assert found[1:] == pytest.approx((0.3, 0.1)) and met[0] == 0


def test_two_that_push_at_each_other_let_one_stand() -> None:
    found, _ = project(np.array([0.5, 0.4, 0.1]), NORMALS, np.array([-0.2, -0.1, 0.3]))
    assert found == pytest.approx((0.0, 0.3, 0.1), abs=TOLERANCE_M_S)


def test_a_wedge_that_pushes_out_is_obeyed_in_its_edge() -> None:
    """Four walls: the two that push meet in a line, and the other two bound it from above and below."""
    slant = np.array([[0.6, 0.8, 0.0], [0.6, -0.8, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    found, _ = project(np.array([1.0, 0.0, 0.5]), slant, np.array([-0.3, -0.3, 0.2, 0.2]))
    assert found == pytest.approx((-0.5, 0.0, 0.2), abs=1e-9)
