"""The limits of a flight depend on the size of its team."""

import pytest

from groundstation.flight.flight_plan import plan_of
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field


@pytest.mark.parametrize(("name", "limit_s"), [("lab", 90.0), ("mixed-team", 120.0)])
def test_tracking_is_awaited_for_as_long_as_the_team_may_need(name: str, limit_s: float) -> None:
    """Drones take off one by one, and each may delay the next by 30 s."""
    assert plan_of(load_field(find_field(name)), 60.0, asks=False).start_tracking_limit_s == limit_s
