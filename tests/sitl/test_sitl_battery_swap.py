"""A drone lands for a new battery and returns, while the other flies on."""

import json
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from sitl_run import COMMAND, SitlRun

from groundstation.bus.messages import FlightState

pytestmark = [pytest.mark.sitl, pytest.mark.slow, pytest.mark.exhaustive, pytest.mark.timeout(300)]
# A drone without battery is silent; the battery is out by then, and the new one is in before the flight ends.
OFF_S, ON_S = 45.0, 57.0


def order(run: SitlRun, *words: str) -> None:
    """Give a command as a lab engineer does, and keep listening during its execution."""
    with subprocess.Popen([*COMMAND, *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as shell:
        run.until(lambda: shell.poll() is not None, 60.0, " ".join(words))
        assert shell.returncode == 0, shell.communicate()[0]


def says(run: SitlRun, state: FlightState) -> bool:
    status = run.status("drone_2")
    return status is not None and status.flight_state is state


def test_a_battery_is_swapped_while_the_other_drone_tracks_on(sitl: Callable[..., SitlRun], tmp_path: Path) -> None:
    off = {"entity": "drone_2", "start_s": OFF_S, "end_s": ON_S}
    faults = [{"kind": kind, **off} for kind in ("navdata_silent", "at_deaf")]
    scenario = tmp_path / "swap.yaml"
    scenario.write_text(json.dumps({"schema_version": 1, "cameras": {"fps": 6}, "faults": faults}))
    run = sitl("--scenario", str(scenario))
    run.until_tracking()
    since = time.monotonic()
    order(run, "land", "drone_2")
    run.until(lambda: run.on_ground("drone_2"), 30.0, "drone_2 stands")
    run.until(lambda: says(run, FlightState.LOST), 60.0, "its battery is out")
    run.until(lambda: says(run, FlightState.LANDED), 60.0, "the new one is in")
    order(run, "takeoff", "drone_2")
    order(run, "track", "drone_2")
    tracks_s = run.until(lambda: run.mode("drone_2") == "TRACK", 30.0, "drone_2 tracks again")
    run.until(lambda: time.monotonic() > tracks_s + 5.0, 10.0)
    assert set(run.modes_since("drone_1", since)) == {"TRACK"}
    assert not run.on_ground("drone_2") and run.mode("drone_2") == "TRACK"
