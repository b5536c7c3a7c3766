"""Orders of the fault campaign that its process refuses, with what to write instead."""

import io
import json
import sys

import pytest

from sim_bridge.study.faults.command import main
from sim_bridge.study.faults.hosted_kinds import WRONG_ORDER


@pytest.mark.parametrize(
    ("kinds", "said"),
    [
        (["frozn"], "no kind of fault: frozn; there are navdata_silent,"),
        (["none", "wind"], "none flies healthy flights only: name it alone"),
    ],
)
def test_kinds_that_mean_nothing_are_refused_in_one_line(
    kinds: list[str], said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    order = {"field": {"drones": {}}, "sections": [], "scenario": {}, "seeds": [1], "seconds": 20.0, "kinds": kinds}
    monkeypatch.setattr(sys, "stdin", io.StringIO(json.dumps(order)))
    assert main() == WRONG_ORDER
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and lines[0].startswith(said)
