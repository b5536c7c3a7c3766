"""A run on one host with its drones' drivers and cameras on another: two namespaces, a link with delay and loss.

Run in a network namespace of its own, as root there: `unshare --user --map-root-user --net python two_hosts.py ...`.
The clock of the other host is 895 s ahead. Prints the result as a line of JSON.
"""

import json
import math
import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from far_link import FarLink, Namespace, ip
from sitl_run import COMMAND, SitlRun

from groundstation.bus.messages import ClockOffset
from groundstation.bus.topics import CLOCK
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.supervisor import site

AHEAD_S = 895
# A hovering drone drifts, and swings at a stop command.
HOVERS_M_S = 0.3
HERE, THERE = "10.77.0.1", "10.77.0.2"
HOST = "lab_pc_2"
DEVICES = ("drones.drone_1", "drones.drone_2", "cameras.ceiling")


class TwoHosts:
    """This namespace is the run's host; the other host is in its own, with its own clock."""

    def __init__(self, folder: Path, delay_s: float, loss: float) -> None:
        ip("link set lo up")
        self.beyond = Namespace()
        self.link = FarLink(self.beyond, (HERE, THERE), delay_s, loss)
        # Devices are near their host: a link of its own, without delay.
        ip(f"link add near type veth peer name near netns {self.beyond.path}")
        for last in (1, 11, 12, 50, 51, 52):
            ip(f"addr add 10.78.0.{last}/24 dev near")
        ip("link set near up")
        with self.beyond.entered():
            ip("addr add 10.78.0.2/24 dev near")
            ip("link set near up")
        self.folder = folder
        os.environ["XDG_CONFIG_HOME"] = str(folder / "config")
        os.environ["XDG_RUNTIME_DIR"] = str(folder)
        site.found("lab")
        site.admit("lab", HOST, f"tls/{HERE}:4717", folder / "admission")
        site.join(folder / "admission")

    def start_host(self) -> "subprocess.Popen[bytes]":
        """Start the one command on the other host."""
        (self.folder / "there").mkdir(exist_ok=True)
        clock = ["unshare", "--time", "--monotonic", str(AHEAD_S), "--"]
        with self.beyond.entered(), (self.folder / "host.txt").open("ab") as sink:
            return subprocess.Popen(
                [*clock, *COMMAND, "host", "--one-run"],
                stdin=subprocess.DEVNULL,
                stdout=sink,
                stderr=subprocess.STDOUT,
                cwd=self.folder / "there",
                start_new_session=True,
            )

    def start(self, order: dict[str, Any]) -> "tuple[subprocess.Popen[bytes], SitlRun]":
        """Start the other host and the run; if one fails, end both."""
        host = self.start_host()
        try:
            return host, self.start_run(order)
        except BaseException:
            end(host.pid)
            raise

    def start_run(self, order: dict[str, Any]) -> SitlRun:
        """Start the demo, with the listed devices on the other host."""
        settings = [f"{device}.host={HOST}" for device in order.get("devices", DEVICES)] + [f"bus.listen={HERE}"]
        options = [part for setting in settings for part in ("--set", setting)]
        figures = ("--duration", str(order["duration_s"]), "--seed", str(order.get("seed", 1)))
        return SitlRun(self.folder, "demo", *figures, "--network", "10.78.0.0/24", *options)


def fly(two: TwoHosts, order: dict[str, Any]) -> dict[str, Any]:
    """Fly the demo to its end and return the report's figures, and the measured clock offset."""
    host, run = two.start(order)
    try:
        offsets = bus_of(run).subscribe([CLOCK])
        code = run.wait(order["duration_s"] + 120.0)
        heard = [one.message for one in offsets.drain() if isinstance(one.message, ClockOffset)]
        return {
            "code": code,
            "host_code": host.wait(30.0),
            "offset_s": heard[-1].offset_ns / 1e9,
            "error_s": heard[-1].error_ns / 1e9,
            "lost": two.link.lost / two.link.carried,
            "report": json.loads((run.run_dir / "report.json").read_text()),
        }
    finally:
        run.close()
        end(host.pid)


def kill(two: TwoHosts, order: dict[str, Any]) -> dict[str, Any]:
    """Break something in flight; return when the drones stopped and how they had flown [s, m].

    kill: the victim; signal: "SIGKILL", or "SIGSTOP" for one that freezes; resume: give RESUME at the end.
    """
    host, run = two.start(order)
    victims = {"liaison": lambda: [run.pid(f"liaison_{HOST}")], "supervisor": lambda: [run.process.pid]}
    victims |= {"host": lambda: [host.pid], "driver": lambda: [named(host.pid)["drone_1"]]}
    # Except the processes that simulate the drones, and the bus for observation here.
    spared = ("sim_bridge", "router")
    victims["run"] = lambda: [run.process.pid] + [p.pid for p in run.record.processes if p.name not in spared]
    victims["all"] = lambda: [host.pid, *named(host.pid).values()]
    try:
        run.until_tracking()
        rest(run, 3.0)
        before = {name: run.truth(name)[-1][1].position_m for name in run.record.drones}
        children = named(host.pid)
        if order["kill"] == "link":
            two.link.cut.set()
        else:
            pids = victims[order["kill"]]()
            # None of them sees another one end: drivers send within a millisecond of their supervisor's death.
            for number in (signal.SIGSTOP, signal.Signals[order.get("signal", "SIGKILL")]):
                for pid in pids:
                    os.kill(pid, number)
        killed_s, landed_s = time.monotonic(), dict[str, float]()
        while time.monotonic() - killed_s < order.get("watch_s", 25.0) and len(landed_s) < len(before):
            rest(run, 0.05)
            for name in before:
                if name not in landed_s and run.on_ground(name):
                    landed_s[name] = time.monotonic() - killed_s
        after = {name: run.truth(name)[-1][1].position_m for name in before}
        rest(run, order.get("settle_s", 3.0))
        return {
            "landed_s": landed_s,
            "went_m": {name: math.dist(before[name][:2], after[name][:2]) for name in before},
            "stopped_s": {name: stopped_s(run, name, killed_s) for name in before},
            "modes": {name: run.mode(name) for name in before},
            "resumed": resumed(run) if order.get("resume") else [],
            "left": [name for name, pid in children.items() if Path(f"/proc/{pid}").exists()],
            "events": [event for event in run.events() if "INFO" not in event],
        }
    finally:
        with suppress(AssertionError):
            run.close()
        end(host.pid)


def resumed(run: SitlRun) -> list[str]:
    """Give RESUME from a shell of the run's host; return the modes of its drones a second later."""
    subprocess.run([*COMMAND, "resume"], cwd=run.folder, check=True, stdout=subprocess.DEVNULL, timeout=20.0)
    rest(run, 1.0)
    return [run.mode(name) for name in run.record.drones]


def stopped_s(run: SitlRun, drone: str, since: float) -> float:
    """Return the last time at which a drone flew faster than a hovering one [s after]; for judging only."""
    flown = ((at - since, math.hypot(*m.velocity_m_s[:2])) for at, m in run.truth(drone) if at > since)
    return max((after_s for after_s, speed_m_s in flown if speed_m_s > HOVERS_M_S), default=0.0)


def bus_of(run: SitlRun) -> ZenohBus:
    """Return the bus on which a run is observed."""
    assert run._bus is not None
    return run._bus


def rest(run: SitlRun, seconds: float) -> None:
    """Listen for a while."""
    deadline_s = time.monotonic() + seconds
    while time.monotonic() < deadline_s:
        run.listen()
        time.sleep(0.02)


def named(pid: int) -> dict[str, int]:
    """Return the child processes of a process by their start-up names."""
    pids = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return {Path(f"/proc/{one}/cmdline").read_text().split("\0")[3]: int(one) for one in pids}


def end(pid: int) -> None:
    """End the other host's command, and its child processes."""
    with suppress(OSError):
        children = named(pid).values()
        os.kill(pid, signal.SIGKILL)
        for child in children:
            os.kill(child, signal.SIGKILL)


def main() -> None:
    """Read the flight's specification as JSON, fly, print the result as JSON."""
    order = json.loads(sys.argv[1])
    folder = Path(order.get("folder") or tempfile.mkdtemp(prefix="two-hosts-"))
    two = TwoHosts(folder, order.get("delay_s", 0.02), order.get("loss", 0.01))
    result = kill(two, order) if "kill" in order else fly(two, order)
    texts = {"text": (folder / "output.txt").read_text(), "host_text": (folder / "host.txt").read_text()}
    print(json.dumps(result | texts))


if __name__ == "__main__":
    main()
