"""The notebooks of the documentation run, each in its own process, and print the promised results."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
NOTEBOOKS = ROOT / "docs" / "notebooks"


def code_of(path):
    cells = json.loads(path.read_text())["cells"]
    return ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]


def ended(name, tmp_path, folder=NOTEBOOKS):
    """Return the end of a notebook that is opened in a folder."""
    script = tmp_path / "notebook.py"
    script.write_text("\n\n".join(code_of(NOTEBOOKS / name)))
    env = {key: value for key, value in os.environ.items() if key != "RUN"} | {"PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, str(script)], cwd=folder, env=env, capture_output=True, text=True, timeout=110, check=False
    )


def run(name, tmp_path):
    result = ended(name, tmp_path)
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_notebooks_are_kept_without_outputs():
    for path in NOTEBOOKS.glob("*.ipynb"):
        cells = json.loads(path.read_text())["cells"]
        assert not [cell for cell in cells if cell.get("outputs")], path.name


def test_each_keeps_its_compiled_kernels():
    """Without a cache one that compiled nothing new took over a minute."""
    for path in NOTEBOOKS.glob("*.ipynb"):
        first = [line for line in code_of(path)[0].splitlines() if line][:2]
        assert first[0] == "from groundstation.process import numba_cache", path.name
        assert first[1].startswith("numba_cache.activate()"), path.name


def test_a_recording_that_is_missing_is_asked_for(tmp_path):
    result = ended("judge-a-recording.ipynb", tmp_path, tmp_path)
    assert result.returncode == 1 and result.stderr.endswith("FileNotFoundError: set RUN to the folder of a run\n")


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
