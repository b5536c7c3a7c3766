"""Limits of a run that depend on the size of its team."""

import pytest

from groundstation.report.criteria import max_airborne_s


@pytest.mark.parametrize(("drones", "limit_s"), [(1, 40.0), (2, 40.0), (3, 50.0), (6, 80.0), (8, 100.0)])
def test_a_larger_team_may_be_longer_on_its_way_into_the_air(drones: int, limit_s: float) -> None:
    """Drones take off one by one."""
    assert max_airborne_s(drones, compiles=False) == limit_s
    assert max_airborne_s(drones, compiles=True) == limit_s + 120.0
