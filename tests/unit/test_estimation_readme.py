"""The library example of the estimation README runs as it stands."""

import re
from pathlib import Path

import numpy as np
import pytest

README = Path(__file__).parents[2] / "groundstation" / "estimation" / "README.md"


def test_the_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    (example,) = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.S)
    names: dict[str, object] = {}
    exec(compile(example, str(README), "exec"), names)
    belief = names["belief"]
    rover, drone = belief.mean_of("rover"), belief.mean_of("drone")
    # The camera looks 45 degrees down and has the rover 0.757 m ahead of it.
    np.testing.assert_allclose(drone[:2], (0.52, 0.0), atol=0.05)
    np.testing.assert_allclose(rover[:2], (drone[0] + 0.09 + 0.757, 0.0), atol=0.15)
    assert "ACCEPTED" in capsys.readouterr().out
