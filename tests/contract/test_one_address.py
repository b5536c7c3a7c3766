"""Vehicles with the same address, each behind its own network adapter: in network namespaces, at the wire."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

PROGRAM = Path(__file__).with_name("one_address.py")
ALONE = ["unshare", "--user", "--map-root-user", "--net"]


def why_impossible() -> str:
    """Return why this machine cannot connect network namespaces by adapters, or ""."""
    missing = [name for name in ("unshare", "ip") if shutil.which(name) is None]
    if missing:
        return f"{' and '.join(missing)} not installed"
    pair = ["ip", "link", "add", "w1", "type", "veth", "peer", "name", "far"]
    tried = subprocess.run([*ALONE, *pair], capture_output=True, text=True)
    return f"no network namespaces here: {tried.stderr.strip()}" if tried.returncode else ""


@pytest.fixture(scope="module")
def told() -> dict[str, Any]:
    if why := why_impossible():
        pytest.skip(why)
    done = subprocess.run(
        [*ALONE, sys.executable, str(PROGRAM)], capture_output=True, text=True, timeout=120, env=os.environ
    )
    assert done.returncode == 0, done.stderr
    told: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return told


@pytest.mark.slow
def test_by_route_only_one_of_two_is_ever_met(told: dict[str, Any]) -> None:
    assert told["by_route"] == told["versions"]["w1"] == "2.3.3"
    assert told["versions"]["w2"] == told["probed"] == "2.4.8", "files and probe come through the adapter"


@pytest.mark.slow
def test_each_driver_hears_and_flies_its_own_vehicle(told: dict[str, Any]) -> None:
    flown = told["ardrones"]
    assert flown["ready"] and flown["heard"] == pytest.approx({"w1": 0.9, "w2": 0.5}, abs=0.02)
    assert flown["aloft"] == {"w1": False, "w2": True}, "only the one that was sent up"
    assert flown["shown"] == {"w1": "192.168.1.1%w1", "w2": "192.168.1.1%w2"}
    assert told["tellos"] == {"ready": True, "heard": pytest.approx({"w1": 0.9, "w2": 0.5}, abs=0.02)}
    assert told["systems"] == {"w1": [1], "w2": [2]}


@pytest.mark.slow
def test_the_guardian_lands_the_one_behind_its_adapter(told: dict[str, Any]) -> None:
    assert told["ardrones"]["landed"]


@pytest.mark.slow
def test_videos_come_through_the_adapter(told: dict[str, Any]) -> None:
    assert told["videos"] == {"w1": True, "w2": True}
