"""A third-party ROS 2 client over Zenoh sees a flight, and the view does not disturb ROS 2's own nodes.

Nobody can move a drone through the view: its session on the bus has the role VIEW, to which the access list gives no
right to publish (tests/contract/test_guarded_bus.py), and its session on the side of ROS 2 subscribes to nothing.
"""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "sitl"))  # for its measure of idle time
from spare_time import ENOUGH, SpareTime

HERE = Path(__file__).parent
ALONE = ["unshare", "--user", "--map-root-user", "--net"]

pytestmark = [pytest.mark.slow, pytest.mark.interop, pytest.mark.timeout(560)]


@pytest.fixture
def alone(absent: Callable[[str], NoReturn]) -> list[str]:
    """Return the command that makes a network namespace; skips the test on a machine without namespaces."""
    if shutil.which("unshare") is None or shutil.which("ip") is None:
        absent("no network namespaces here: unshare or ip is not installed")
    tried = subprocess.run([*ALONE, "ip", "link", "set", "lo", "up"], capture_output=True, text=True)
    if tried.returncode:
        pytest.skip(f"no network namespaces here: {tried.stderr.strip()}")
    return ALONE


@pytest.fixture
def told(alone: list[str], interpreter: Callable[[str], Path], tmp_path: Path) -> dict[str, Any]:
    command = [*alone, sys.executable, str(HERE / "ros2_flight.py"), str(interpreter("zenoh_ros2")), str(tmp_path)]
    spare = SpareTime()
    # Longer than all of its own limits together: if killed, it would leave its flight behind.
    done = subprocess.run(command, capture_output=True, text=True, timeout=540, env=os.environ)
    assert done.returncode == 0, done.stdout + done.stderr
    told: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return told | {"idle": spare.share}


def test_a_foreign_client_decodes_each_topic_and_nodes_still_find_each_other(told: dict[str, Any]) -> None:
    listed = set(told["listed"])
    assert len(listed) >= 16, "our topics, and the chatter of the nodes"
    missing = listed - set(told["decoded"])
    if missing and told["idle"] < ENOUGH:
        pytest.skip(f"the machine was full ({told['idle']:.0%} idle) and drones landed: nothing comes on {missing}")
    assert not missing and set(told["decoded"]) == listed
    ours = {f"/skein/{name}" for name in ("markers", "ceiling/camera_info", "drone_1/odom")}
    assert {"/tf", "/tf_static", "/rosout", *ours} <= listed
    # Ten a second for two seconds; a busy machine may be late.
    assert min(told["before"], told["during"], told["after"]) >= 10, told
    assert told["code"] == 0 and "ROS 2 domain 0" in told["view"][0]
