"""A run with drivers and cameras on another host: in network namespaces, its clock 895 s ahead, at the wire."""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

pytestmark = [pytest.mark.sitl, pytest.mark.slow, pytest.mark.timeout(300)]

PROGRAM = Path(__file__).with_name("two_hosts.py")
# In a user namespace no process has real-time priority, and a busy machine flies badly there: root needs none.
ALONE = ["unshare", *([] if os.geteuid() == 0 else ["--user", "--map-root-user"]), "--net"]
AHEAD_S = 895
LAND_S = 3.0  # safety.land_after_s of the demo
LINK_S = 0.5  # 20 ms, a repeated packet, and 0.2 s without an answer: then the host's supervisor counts as silent
AT_ONCE_S = 1.5  # a dead supervisor: brake for a second, then land
FIRMWARE_S = 2.5  # an AR.Drone's own time-out: it hovers after 2 s, and the emulated one lands
DOWN_S = 5.0  # from the order to the floor
STOPPED_S = 2.0  # hover after 0.3 s, or 0.4 s with a failsafe sender; then it brakes


def why_impossible() -> str:
    """Return why this machine cannot be two hosts, "" if it can."""
    missing = [name for name in ("unshare", "ip") if shutil.which(name) is None]
    if missing:
        return f"{' and '.join(missing)} not installed"
    adapter = ["ip", "tuntap", "add", "far", "mode", "tun"]
    for order in (adapter, ["unshare", "--time", "--monotonic", "5", "true"]):
        tried = subprocess.run([*ALONE, *order], capture_output=True, text=True)
        if tried.returncode:
            return f"no namespaces for a second host here: {tried.stderr.strip()}"
    return ""


def flown(folder: Path, **order: Any) -> dict[str, Any]:
    if why := why_impossible():
        pytest.skip(why)
    command = [*ALONE, sys.executable, str(PROGRAM), json.dumps({"folder": str(folder), **order})]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, env=os.environ)
    assert done.returncode == 0, done.stderr
    told: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return told


def test_all_drivers_and_cameras_on_another_host_behind_a_bad_link(tmp_path: Path) -> None:
    told = flown(tmp_path, duration_s=20, delay_s=0.02, loss=0.01)
    report = told["report"]
    assert told["host_code"] == 0, told["host_text"]
    assert report["landed"] and report["max_fence_violation_m"] == 0.0, told["text"]
    # One thread delays the packets of both directions: the rest is the scatter of two busy cores.
    assert told["offset_s"] == pytest.approx(-AHEAD_S, abs=0.005)
    assert 0.02 <= told["error_s"] < 0.03 and 0.005 < told["lost"] < 0.02
    if not report["valid"]:
        pytest.skip(f"{'; '.join(report['reasons'])}: no figure counts")
    assert report["target_rmse_m"] <= 0.04, told["text"]


Modes = frozenset[str]
# The last state of a driver that ends with its landing is LANDING or LANDED.
DOWN, TRACK, HOVER = frozenset({"LANDING", "LANDED"}), frozenset({"TRACK"}), frozenset({"HOVER"})


@dataclass(frozen=True)
class End:
    """A part of a host that ends; landing_s: latest time of LAND to its drones, None: never.

    concerned: the drones that it stops; modes: of drone_1 and drone_2 at the end; resumes: whether they go on after
    RESUME.
    """

    victim: str
    landing_s: float | None
    signal: str = "SIGKILL"
    modes: tuple[Modes, Modes] = (DOWN, DOWN)
    stopped_s: float = STOPPED_S
    concerned: tuple[str, ...] = ("drone_1", "drone_2")
    resumes: bool = False


ENDS = [
    End("host", AT_ONCE_S),
    End("driver", LAND_S, "SIGSTOP", (DOWN, TRACK), concerned=("drone_1",)),
    End("host", LAND_S + LINK_S, "SIGSTOP"),
    End("driver", LAND_S, modes=(DOWN, TRACK), concerned=("drone_1",)),
    End("supervisor", AT_ONCE_S + LINK_S),
    End("run", LAND_S + LINK_S),
    End("link", LAND_S + LINK_S, modes=(TRACK, TRACK)),  # no telemetry of them any more
    End("liaison", None, modes=(TRACK, TRACK), concerned=()),  # its successor starts within the drivers' time-out
    End("liaison", None, "SIGSTOP", (HOVER, HOVER), resumes=True),
    End("all", FIRMWARE_S, modes=(TRACK, TRACK), stopped_s=FIRMWARE_S + STOPPED_S),
]


@pytest.mark.exhaustive
@pytest.mark.parametrize("end", ENDS, ids=lambda end: f"{end.victim}-{end.signal}")
def test_every_end_of_a_host_ends_as_that_of_its_processes(tmp_path: Path, end: End) -> None:
    told = flown(tmp_path, duration_s=60, kill=end.victim, signal=end.signal, resume=end.resumes)
    for name in end.concerned:
        assert told["stopped_s"][name] < end.stopped_s, "it hovers before it lands"
        assert told["went_m"][name] < 1.0
    if end.landing_s is None:
        assert told["landed_s"] == {}, told["events"]
    else:
        assert set(told["landed_s"]) == set(end.concerned), told["events"]
        assert max(told["landed_s"].values()) < end.landing_s + DOWN_S, told["landed_s"]
    for mode, allowed in zip(told["modes"].values(), end.modes, strict=True):
        assert mode in allowed, told["events"]
    assert set(told["resumed"]) == ({"TRACK"} if end.resumes else set()), told["text"]
    if end.victim in ("host", "supervisor") and end.signal == "SIGKILL":
        assert told["left"] == [], "nothing of the host is left"
    if end.victim in ("host", "link", "all"):
        assert any("liaison_lab_pc_2: is silent" in event for event in told["events"])
