"""The nearest velocity that half-spaces permit, in cases worked out by hand."""

import numpy as np
import pytest
from scipy.optimize import linprog

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


@pytest.mark.parametrize("floor", [-0.05, 0.05])
@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 2, 1, 0), (1, 0, 3, 2)])
def test_a_wall_without_part_in_a_conflict_pushes_on(order: tuple[int, ...], floor: float) -> None:
    """A room with too little height for the deviation of a height, and a drift towards one of its walls."""
    rows = list(order)
    normals = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])[rows]
    found, _ = project(np.array([0.3, 0.1, 0.0]), normals, np.array([-0.2, -0.15, floor, 0.3])[rows])
    assert found == pytest.approx((-0.2, 0.1, -max(0.0, floor)), abs=1e-3)


def test_nothing_is_relaxed_more_than_all_together_would_be() -> None:
    rng = np.random.default_rng(8)
    for _ in range(200):
        normals = rng.normal(size=(8, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        most = rng.uniform(-0.2, 0.1, 8)
        found, _ = project(rng.normal(size=3) * 0.3, normals, most)
        excess = (normals @ found - most)[most < 0.0]
        eased, capped = (
            np.column_stack((normals, np.where(most < 0.0, -1.0, 0.0))),
            np.column_stack((normals, np.zeros(8))),
        )
        limits = np.concatenate((most, np.maximum(most, 0.0)))
        least = linprog(
            (0, 0, 0, 1), np.concatenate((eased, capped)), limits, bounds=[(None, None)] * 3 + [(0, None)]
        ).fun
        assert excess.max(initial=0.0) <= least + 0.2 / 256 + 1e-6
        assert (normals @ found - np.maximum(most, 0.0)).max() <= 1e-6


def test_a_wedge_that_pushes_out_is_obeyed_in_its_edge() -> None:
    """Four walls: the two that push meet in a line, and the other two bound it from above and below."""
    slant = np.array([[0.6, 0.8, 0.0], [0.6, -0.8, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    found, _ = project(np.array([1.0, 0.0, 0.5]), slant, np.array([-0.3, -0.3, 0.2, 0.2]))
    assert found == pytest.approx((-0.5, 0.0, 0.2), abs=1e-9)
