"""The whole ground station as real processes: it flies, lands on request, and survives faults."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress

import pytest

pytestmark = [pytest.mark.sitl, pytest.mark.timeout(240)]
Start = Callable[..., "SitlRun"]  # type: ignore[name-defined]  # noqa: F821 - the class lives in conftest.py

FAULTS = pytest.mark.slow


def cli(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "groundstation", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def test_short_flight_lands_and_leaves_nothing(sitl: Start) -> None:
    run = sitl("--duration", "5")
    run.until_tracking()
    assert all(run.height(name) > 0.3 for name in run.record.drones)
    run.wait(120)
    assert all(run.on_ground(name) for name in run.record.drones)
    run.until_gone(5)
    report = json.loads((run.run_dir / "report.json").read_text())
    assert report["landed"] is True
    assert report["tracked_s"] >= 4.5
    for name in ("state.mcap", "raw.mcap", "resolved.yaml", "trajectories.png"):
        assert (run.run_dir / name).is_file()


@FAULTS
def test_other_shells_hold_resume_and_land_a_run_that_had_to_take_other_ports(sitl: Start) -> None:
    with ExitStack() as others:
        router = others.enter_context(
            socket.create_server(("::", 0), family=socket.AF_INET6, dualstack_ipv6=True)
        ).getsockname()[1]
        with suppress(OSError):  # a web server may use it already
            others.enter_context(socket.create_server(("0.0.0.0", 8080)))
        run = sitl("--set", f"bus.port={router}")
        run.until_tracking()
        name = run.record.name
        assert not run.record.endpoint.endswith(f":{router}")
        state = cli("monitor", "--run", name, "--json")
        assert set(json.loads(state.stdout)["vehicles"]) == set(run.record.drones), state.stderr
        for verb in ("hold", "resume", "land"):
            result = cli(verb, "--run", name, "--json")
            assert result.returncode == 0, result.stdout + result.stderr
            answers = json.loads(result.stdout)
            assert answers["confirmed"]
            assert verb == "resume" or set(answers["drones"]) == set(run.record.drones)
            if verb == "hold":
                run.until(lambda: all(run.mode(drone) == "HOLD" for drone in run.record.drones), 2, "all in HOLD")
            elif verb == "resume":
                run.until_tracking(5)
        run.until_landed(5)
        assert run.wait(30) == 0


@FAULTS
@pytest.mark.exhaustive
def test_ctrl_c_lands_first(sitl: Start) -> None:
    run = sitl()
    run.until_tracking()
    run.process.send_signal(signal.SIGINT)
    run.until_landed(20)
    run.wait(30)
    run.until_gone(5)


@FAULTS
@pytest.mark.exhaustive
def test_second_ctrl_c_stops_at_once_but_for_the_guardian(sitl: Start) -> None:
    """Its drones still fly, without drivers: they are sent hover for 1 s, then LAND for 10 s."""
    run = sitl()
    run.until_tracking()
    run.process.send_signal(signal.SIGINT)
    time.sleep(0.8)
    run.process.send_signal(signal.SIGINT)
    deadline = time.monotonic() + 6.0
    while len(run.survivors()) > 2:  # supervisor and guardian
        assert time.monotonic() < deadline, run.survivors()
        time.sleep(0.05)
    run.wait(20)
    run.until_gone(5)


@FAULTS
@pytest.mark.exhaustive
def test_two_runs_at_once(sitl: Start) -> None:
    """One flies, the other has met its drones: two flights are too much for two cores in real time."""
    flying = sitl()
    flying.until_tracking()
    standing = sitl()
    assert standing.record.endpoint != flying.record.endpoint
    standing.until(lambda: all(standing.status(name) for name in standing.record.drones), 120, "its drones are heard")
    assert "several ground stations" in cli("land").stderr
    assert cli("land", "--run", flying.record.name).returncode == 0
    flying.until_landed(10)
    assert flying.wait(150) == 0, "its report has what the other run's start leaves"
    standing.until_tracking(120)
    assert cli("land", "--run", standing.record.name).returncode == 0
    assert standing.wait(60) == 0


@FAULTS
def test_end_of_the_simulator_ends_the_run_with_its_name(sitl: Start) -> None:
    run = sitl()
    run.until_tracking()
    os.kill(run.pid("sim_bridge"), signal.SIGKILL)
    assert run.wait(40) == 4
    assert "sim_bridge killed by SIGKILL" in run.text
    run.until_gone(5)
