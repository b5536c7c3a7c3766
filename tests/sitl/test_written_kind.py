"""The vehicle kind written on the how-to page passes the conformance kit, with its files taken from the page."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from installation import install

ROOT = Path(__file__).parents[2]
PAGE = ROOT.joinpath("docs", "how-to", "write-a-kind-of-vehicle.md")
FILE = re.compile(r"```python\n# (puffin/\w+\.py)\n(.*?)```", re.DOTALL)


@pytest.fixture
def puffin(tmp_path):
    """Environment of a shell in which the package of the page is installed."""
    (tmp_path / "puffin").mkdir()
    (tmp_path / "puffin/__init__.py").touch()
    for name, text in FILE.findall(PAGE.read_text()):
        (tmp_path / name).write_text(text)
    entry = re.findall(r'\[project\.entry-points\."(skein\.vehicles)"\]\n(.*?)```', PAGE.read_text(), re.DOTALL)[0]
    install(tmp_path, "puffin-for-skein", f"[{entry[0]}]\n{entry[1].replace(chr(34), '')}")
    return os.environ | {"PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT}"}


def checked(env, only, *settings):
    command = [sys.executable, "-m", "groundstation", "vehicle", "check", "puffin", "--only", only, *settings]
    return subprocess.run(command, env=env, capture_output=True, text=True, timeout=400, check=False)


@pytest.mark.slow
@pytest.mark.sitl
@pytest.mark.timeout(420)
def test_the_kind_of_the_page_keeps_the_contract(puffin):
    result = checked(puffin, "kind,stand,killed")
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.slow
@pytest.mark.exhaustive
@pytest.mark.sitl
@pytest.mark.timeout(600)
def test_the_kind_of_the_page_flies_the_whole_kit(puffin):
    result = checked(puffin, "")
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.slow
@pytest.mark.exhaustive
@pytest.mark.sitl
@pytest.mark.timeout(200)
def test_its_fail_safe_goes_to_the_port_of_the_field_file(puffin):
    result = checked(puffin, "killed", "--with", "puffin.port=9800")
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.slow
@pytest.mark.exhaustive
@pytest.mark.sitl
@pytest.mark.timeout(200)
def test_a_wrong_sign_is_found(puffin, tmp_path):
    driver = tmp_path / "puffin/driver.py"
    right = "-100 * y * shorter"
    assert right in driver.read_text()
    driver.write_text(driver.read_text().replace(right, right.removeprefix("-")))
    result = checked(puffin, "left_is_left")
    assert result.returncode == 1 and "FAIL  A setpoint along y flies to the left" in result.stdout


def test_the_page_s_driver_is_short():
    files = dict(FILE.findall(PAGE.read_text()))
    lines = sum(text.count("\n") for name, text in files.items() if not name.endswith("emulator.py"))
    assert set(files) == {"puffin/kind.py", "puffin/driver.py", "puffin/emulator.py"} and lines <= 300
