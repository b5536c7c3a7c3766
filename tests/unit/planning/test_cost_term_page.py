"""The edits of the how-to page on terms of the cost are valid: they fit the sources, and the derivative is right."""

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs" / "how-to" / "add-a-term-of-the-cost.md"
PLANNING = ROOT / "groundstation" / "planning"
# Interpreted: to compile the kernels takes half a minute, and shows no more of the edits.
_CHECK = """
import math
import sys

import numpy as np

import groundstation.planning

groundstation.planning.__path__.insert(0, sys.argv[1])
from groundstation.planning.parameters import PlannerParameters
from groundstation.planning.problem import ProblemBuilder
from groundstation.planning.rollout import penalty
from groundstation.sensing.models import SensorSuite
from groundstation.sensing.occlusion import box_rows

sensors = SensorSuite({}, {}, {})


def options(**person):
    return ProblemBuilder(PlannerParameters(((1.2,),), **person), sensors)._options


def cost(path, of):
    gradient = np.zeros((len(path), 3))
    return float(penalty(path=path, boxes=box_rows(()), options=of, gradient=gradient)), gradient


near, nowhere = options(person_m=(0.2, -0.1)), options()
assert (near.person_weight, near.person_x, near.person_y) == (0.5, 0.2, -0.1), near
assert near._replace(person_x=math.inf, person_y=math.inf)[-3:] == nowhere[-3:]
path = np.array([[0.5, 0.1, 1.2, 0.0], [-1.4, 0.9, 1.2, 0.0]])
value, gradient = cost(path, near)
assert value - cost(path, nowhere)[0] > 0.1, "the first stands on the person"
for axis in range(2):
    step = np.zeros(path.shape)
    step[0, axis] = 1e-6
    slope = (cost(path + step, near)[0] - cost(path - step, near)[0]) / 2e-6
    assert math.isclose(slope, gradient[0, axis], rel_tol=1e-6), (axis, slope, gradient)
"""


def behind_fields(source: str, name: str) -> int:
    """Return the number of lines up to the end of a class's last field."""
    (found,) = (one for one in ast.parse(source).body if isinstance(one, ast.ClassDef) and one.name == name)
    return [one.end_lineno or 0 for one in found.body if isinstance(one, ast.AnnAssign)][-1]


def behind_arguments(source: str, name: str) -> int:
    """Return the number of lines up to the last argument of the only call of a name."""
    calls = (one for one in ast.walk(ast.parse(source)) if isinstance(one, ast.Call))
    (found,) = (one for one in calls if isinstance(one.func, ast.Name) and one.func.id == name)
    return found.args[-1].end_lineno or 0


def before_return(source: str, name: str) -> int:
    """Return the number of lines before the last statement of a function."""
    (found,) = (one for one in ast.parse(source).body if isinstance(one, ast.FunctionDef) and one.name == name)
    assert isinstance(found.body[-1], ast.Return)
    return found.body[-1].lineno - 1


@pytest.fixture
def edited(tmp_path: Path) -> Path:
    """Apply the page's edits to copies of the four files, in the order of the page."""
    # Arguments alone are marked as text: as Python the formatter makes a tuple of them.
    blocks = re.findall(r"```(?:python|text)\n(.*?)```", PAGE.read_text("utf-8"), flags=re.S)
    weight, place, fields, arguments, loop = blocks
    for name, find, what, block in (
        ("parameters.py", behind_fields, "Weights", weight),
        ("parameters.py", behind_fields, "PlannerParameters", place),
        ("records.py", behind_fields, "CostOptions", fields),
        ("problem.py", behind_arguments, "CostOptions", arguments),
        ("rollout.py", before_return, "penalty", loop),
    ):
        file = tmp_path / name
        source = (file if file.exists() else PLANNING / name).read_text("utf-8")
        lines = source.splitlines(keepends=True)
        lines.insert(find(source, what), block)
        file.write_text("".join(lines), "utf-8")
    return tmp_path


def test_the_term_of_the_page_is_added_with_its_exact_derivative(edited: Path) -> None:
    command = [sys.executable, "-c", _CHECK, str(edited)]
    env = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)}
    result = subprocess.run(command, capture_output=True, text=True, env=env, timeout=60, check=False)
    assert result.returncode == 0, result.stderr
