"""A simulated run records its scenario's expectation, by which its report is judged."""

from typing import Any

import pytest

from groundstation.cli import run as run_command
from groundstation.cli.main import run


@pytest.mark.parametrize(("scenario", "expected"), [("kidnap-3m", {"lost_s": 12}), ("realistic", None)])
def test_a_scenarios_expectation_is_passed_to_the_recorded_run(
    monkeypatch: pytest.MonkeyPatch, scenario: str, expected: Any
) -> None:
    flown: list[Any] = []

    def never_flown(*arguments: Any, **_: Any) -> int:
        flown.append(arguments[3])
        return 0

    monkeypatch.setattr(run_command, "_run", never_flown)
    assert run(["sitl", "lab", "--scenario", scenario, "--duration", "5", "--headless"]) == 0
    assert (flown[0].scenario, flown[0].expected) == (scenario, expected)
