"""Two drones with exchanged addresses: the take-off ends before anything is tracked."""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytestmark = [pytest.mark.sitl, pytest.mark.slow, pytest.mark.timeout(240)]
EXCHANGED = (sys.executable, str(Path(__file__).with_name("exchanged_drones.py")))


@pytest.mark.exhaustive
def test_exchanged_drones_land_before_anything_is_tracked(sitl: Callable[..., Any]) -> None:
    run = sitl("--duration", "20", program=EXCHANGED)
    assert run.wait(150) == 4, run.text
    assert all(run.on_ground(name) for name in ("drone_1", "drone_2"))
    assert max(state.position_m[2] for _, state in run.truth("drone_1")) > 0.5, "drone_1 flew"
    assert max(state.position_m[2] for _, state in run.truth("drone_2")) < 0.1, "drone_2 never started"
    assert not {"TRACK"} & {mode for name in ("drone_1", "drone_2") for mode in run.modes_since(name, 0.0)}
    assert "but its marker is on the floor and drone_2's marker rose: the addresses or markers of the two" in run.text
    assert "check address, system id and marker code of drone_1 and drone_2 in the field file" in run.text
    report = json.loads((run.run_dir / "report.json").read_text())
    assert report["max_fence_violation_m"] == 0.0 and report["landed"] is True
