"""The notebooks of the documentation run, each in its own process, and print the promised results."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
NOTEBOOKS = ROOT / "docs" / "notebooks"


def run(name, tmp_path):
    cells = json.loads((NOTEBOOKS / name).read_text())["cells"]
    script = tmp_path / "notebook.py"
    script.write_text("\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"))
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    result = subprocess.run(
        [sys.executable, str(script)], cwd=ROOT, env=env, capture_output=True, text=True, timeout=110, check=False
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_notebooks_are_kept_without_outputs():
    for path in NOTEBOOKS.glob("*.ipynb"):
        cells = json.loads(path.read_text())["cells"]
        assert not [cell for cell in cells if cell.get("outputs")], path.name


@pytest.mark.slow
@pytest.mark.study
def test_a_step_is_planned(tmp_path):
    said = run("plan-a-step.ipynb", tmp_path)
    assert "drone_1" in said and "m^2" in said and "against" in said


@pytest.mark.slow
@pytest.mark.study
def test_a_study_runs_with_our_planner_and_another(tmp_path):
    assert run("run-a-study.ipynb", tmp_path).count("target_rmse_m") == 2


@pytest.mark.slow
@pytest.mark.study
def test_a_recording_is_judged(tmp_path):
    said = run("judge-a-recording.ipynb", tmp_path)
    assert "met " in said and "tracked for" in said
