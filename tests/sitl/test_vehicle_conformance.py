"""Our kinds against the conformance kit: flights of one real driver process and its emulator, in real time.

Some flights for each kind, so that each flight is flown once; all of them: `groundstation vehicle check KIND`.
"""

import subprocess
import sys

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.sitl, pytest.mark.timeout(300)]


@pytest.mark.parametrize(
    ("kind", "options", "flights"),
    [
        ("tello", [], "stand,kind"),
        pytest.param("ardrone", [], "killed", marks=pytest.mark.exhaustive),
        pytest.param("mavlink", [], "epochs", marks=pytest.mark.exhaustive),
        ("mavlink", ["--with", "mavlink.flavour=ardupilot"], "limits"),
        pytest.param("mavlink", ["--with", "mavlink.flavour=ardupilot"], "orphaned", marks=pytest.mark.exhaustive),
        pytest.param("tello", [], "square,cut,stranger", marks=pytest.mark.exhaustive),
        pytest.param("ros2", [], "killed,square", marks=pytest.mark.exhaustive),
        pytest.param("ros2", ["--with", "ros2.orders=services"], "cut", marks=pytest.mark.exhaustive),
        pytest.param("ardrone", [], "silence", marks=pytest.mark.exhaustive),
        pytest.param("mavlink", [], "unheard", marks=pytest.mark.exhaustive),
        pytest.param("ardrone", [], "damaged", marks=pytest.mark.exhaustive),
        pytest.param("mavlink", [], "lossy", marks=pytest.mark.exhaustive),
        pytest.param("mavlink", ["--with", "mavlink.flavour=ardupilot"], "damaged_aloft", marks=pytest.mark.exhaustive),
    ],
)
def test_our_kinds_keep_the_contract(kind, options, flights):
    command = [sys.executable, "-m", "groundstation", "vehicle", "check", kind, "--only", flights, *options]
    result = subprocess.run(command, capture_output=True, text=True, timeout=280, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
