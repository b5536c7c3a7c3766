"""Points where planes meet, and half-spaces that restrict nothing."""

import math

import pytest

from groundstation.control.touching import Plane, touching
from groundstation.vectors import cross, dot

X: Plane = ((1.0, 0.0, 0.0), 0.2)
Y: Plane = ((0.0, 1.0, 0.0), -0.3)
Z: Plane = ((0.0, 0.0, 1.0), 0.1)
ASKEW: Plane = ((0.6, 0.8, 0.0), 0.05)
WANTED = (0.5, 0.4, 0.7)


def test_products() -> None:
    a, b = (2.0, 3.0, 5.0), (7.0, 11.0, 13.0)
    assert dot(a, b) == 2 * 7 + 3 * 11 + 5 * 13
    assert cross(a, b) == (3 * 13 - 5 * 11, 5 * 7 - 2 * 13, 2 * 11 - 3 * 7)


@pytest.mark.parametrize(
    ("planes", "found"),
    [
        ((X,), (0.2, 0.4, 0.7)),
        ((Y,), (0.5, -0.3, 0.7)),
        ((Z,), (0.5, 0.4, 0.1)),
        ((X, Y), (0.2, -0.3, 0.7)),
        ((Z, Y), (0.5, -0.3, 0.1)),
        ((X, Y, Z), (0.2, -0.3, 0.1)),
        ((Z, X, Y), (0.2, -0.3, 0.1)),
        ((Y, X, Z), (0.2, -0.3, 0.1)),
    ],
)
def test_planes_at_right_angles(planes: tuple[Plane, ...], found: tuple[float, float, float]) -> None:
    assert touching(WANTED, planes) == pytest.approx(found, abs=1e-15)


def test_a_plane_askew_is_met_along_its_normal() -> None:
    over = 0.6 * 0.5 + 0.8 * 0.4 - 0.05
    assert touching(WANTED, (ASKEW,)) == pytest.approx((0.5 - 0.6 * over, 0.4 - 0.8 * over, 0.7))


@pytest.mark.parametrize("planes", [(ASKEW, X), (X, ASKEW)])
def test_the_nearest_point_of_a_line_keeps_what_runs_along_it(planes: tuple[Plane, ...]) -> None:
    assert touching(WANTED, planes) is None, "x = 0.2 holds nobody back who comes as near as 0.6 x + 0.8 y = 0.05"
    assert touching((0.9, 0.0, 0.7), planes) == pytest.approx((0.2, (0.05 - 0.6 * 0.2) / 0.8, 0.7))


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 2, 0), (2, 1, 0)])
def test_the_point_of_three_planes_askew(order: tuple[int, int, int]) -> None:
    planes: list[Plane] = [ASKEW, ((0.0, 0.6, 0.8), 0.1), ((0.8, 0.0, 0.6), 0.2)]
    found = touching((2.0, 2.0, 2.0), tuple(planes[i] for i in order))
    assert found is not None
    assert [dot(normal, found) for normal, _ in planes] == pytest.approx([0.05, 0.1, 0.2])


@pytest.mark.parametrize("planes", [(X,), (X, Y), (Y, X), (X, Y, Z), (Z, Y, X), (Y, Z, X)])
def test_nobody_is_pulled_to_a_plane(planes: tuple[Plane, ...]) -> None:
    assert touching((0.2, 0.4, 0.7), planes) is not None, "just on it"
    assert touching((0.1999, 0.4, 0.7), planes) is None


def _turned(angle: float) -> Plane:
    return (math.cos(angle), math.sin(angle), 0.0), 0.1


@pytest.mark.parametrize("third", [(), (Z,)])
def test_planes_that_are_parallel_meet_nowhere(third: tuple[Plane, ...]) -> None:
    assert touching((0.5, 0.0, 0.7), (_turned(0.45e-6), _turned(-0.45e-6), *third)) is None
    assert touching((0.5, 0.0, 0.7), (_turned(math.pi), _turned(0.0), *third)) is None
    assert touching((0.5, 0.0, 0.7), (_turned(0.55e-6), _turned(-0.55e-6), *third)) is not None
    assert touching((0.5, 0.0, 0.7), (*third, _turned(-0.55e-6), _turned(0.55e-6))) is not None
