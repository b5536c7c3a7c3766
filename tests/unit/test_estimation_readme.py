"""The library examples of the estimation README run as they stand."""

import os
import re
from pathlib import Path

import numpy as np
import pytest

README = Path(__file__).parents[2] / "groundstation" / "estimation" / "README.md"
DATA = Path(os.environ.get("GROUNDSTATION_DATA", Path(__file__).parents[3] / "shared" / "data"))


def run_example(number: int) -> dict[str, object]:
    examples = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.S)
    names: dict[str, object] = {}
    exec(compile(examples[number], str(README), "exec"), names)
    return names


def test_the_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    belief = run_example(0)["belief"]
    rover, drone = belief.mean_of("rover"), belief.mean_of("drone")
    # The camera looks 45 degrees down and has the rover 0.757 m ahead of it.
    np.testing.assert_allclose(drone[:2], (0.52, 0.0), atol=0.05)
    np.testing.assert_allclose(rover[:2], (drone[0] + 0.09 + 0.757, 0.0), atol=0.15)
    assert "ACCEPTED" in capsys.readouterr().out


def test_the_example_on_real_data_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    if not (DATA / "mrclam7").is_dir():
        pytest.skip(f"no data at {DATA / 'mrclam7'}; set GROUNDSTATION_DATA")
    monkeypatch.setenv("GROUNDSTATION_DATA", str(DATA))
    assert max(run_example(1)["errors_m"]) < 0.3
