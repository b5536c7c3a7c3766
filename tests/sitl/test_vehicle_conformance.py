"""Our kinds against the conformance kit: flights of one real driver process and its emulator, in real time.

A few flights of each, so that each flight is flown once; all of them: `groundstation vehicle check KIND`.
"""

import subprocess
import sys

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.sitl, pytest.mark.timeout(300)]


@pytest.mark.parametrize(
    ("kind", "options", "flights"),
    [
        ("tello", [], "stand,square,cut,stranger,kind"),
        ("ardrone", [], "silence,killed,damaged"),
        ("mavlink", [], "epochs,unheard,lossy"),
        ("mavlink", ["--with", "mavlink.flavour=ardupilot"], "orphaned,limits,damaged_aloft"),
    ],
    ids=["tello", "ardrone", "px4", "ardupilot"],
)
def test_our_kinds_keep_the_contract(kind, options, flights):
    command = [sys.executable, "-m", "groundstation.cli.main", "vehicle", "check", kind, "--only", flights, *options]
    result = subprocess.run(command, capture_output=True, text=True, timeout=280, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
