"""What a drone's card says of it while it lands."""

from typing import Any

import pytest
from page_modules import needs_node

pytestmark = needs_node


@pytest.mark.parametrize(
    ("detail", "words"),
    [
        ("battery below its limit", "Lands: battery below its limit"),
        ("it does not come down: it rises at 0.9 m/s", "It does not come down: it rises at 0.9 m/s"),
        ("it stands on the floor with running motors: CUT MOTORS stops them", "It stands on the floor with running "),
    ],
)
def test_one_that_is_to_land_and_does_not_is_not_said_to(said: Any, detail: str, words: str) -> None:
    script = f"""
    const {{ dutyOf }} = await import("./duty.js");
    store.s.vehicles = {{ drone_1: {{ mode: "LANDING", flight: "LANDING", battery: 0.8, battery_min: 0.15,
      at: performance.now(), detail: "{detail}", lands_in_s: null, braked: false }} }};
    const result = dutyOf("drone_1");
    """
    assert said(script).startswith(words)
