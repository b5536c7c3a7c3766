"""Kills and freezes of all processes, alone and in pairs, at the wire: `make wire-faults PART=K/N`, needs CAP_NET_RAW.

Each case is a flight of its own. A drone that lost its sender or its tracker must receive hover within 0.5 s and LAND
within 3.5 s, and no motion after that; no process may be left. Exit code 1: a case failed. Results are printed line by
line, so that an interrupted part keeps its results.
"""

import argparse
import itertools
import json
import os
import signal
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from conftest import SitlRun
from wire_tap import WireTap

HOVER_S, LAND_S = 0.5, 3.5
PROCESSES = ("supervisor", "guardian", "router", "tracker", "drone_1", "drone_2", "recorder", "ceiling",
             "drone_1_camera", "console")  # fmt: skip
# The processes without which nothing may move the drones.
MOVERS = frozenset({"supervisor", "router", "tracker"})
KINDS = {"killed": signal.SIGKILL, "frozen": signal.SIGSTOP}
Case = tuple[tuple[str, str], ...]


def cases() -> list[Case]:
    """Return all single faults, then all pairs of different processes."""
    faults = list(itertools.product(PROCESSES, KINDS))
    pairs = [pair for pair in itertools.combinations(faults, 2) if pair[0][0] != pair[1][0]]
    return [*((fault,) for fault in faults), *pairs]


def part_of(all_cases: list[Case], part: str) -> list[Case]:
    """Return every Nth case from the Kth on, for K/N."""
    number, _, count = part.partition("/")
    return all_cases[int(number) - 1 :: int(count)]


def concerned(case: Case, drones: tuple[str, ...]) -> tuple[str, ...]:
    """Return the drones that must land."""
    names = {name for name, _ in case}
    return drones if names & MOVERS else tuple(drone for drone in drones if drone in names)


def fly(case: Case, folder: Path, tap: WireTap) -> dict[str, object]:
    """Fly one case; returns the measurements of each drone, and `wrong`: its faults."""
    run = SitlRun(folder, "sitl", "lab")
    try:
        run.until_tracking()
        drones = run.record.drones
        addresses = {drone: run.address(drone) for drone in drones}
        pids = {name: run.process.pid if name == "supervisor" else run.pid(name) for name, _ in case}
        for name, kind in case:
            os.kill(pids[name], KINDS[kind])
        broken = time.monotonic()
        down = concerned(case, drones)
        _until_down(run, tap, {drone: addresses[drone] for drone in down}, broken)
        found = {drone: measured(tap, addresses[drone], broken) for drone in drones}
        wrong = [fault for drone in down for fault in faults_of(drone, found[drone])]
        wrong += _end(run, case, pids)
        return {"drones": found, "wrong": wrong}
    finally:
        run.close()


def measured(tap: WireTap, address: str, broken: float) -> dict[str, float | None]:
    """Return the times of a drone's first stop, last motion and first LAND [s after the fault]."""
    times = {
        "hover_s": tap.first_stop(address, broken),
        "moved_s": tap.last_motion(address, broken, broken + 60.0),
        "land_s": tap.first_landing(address, broken),
    }
    return {name: None if value is None else round(value, 2) for name, value in times.items()}


def faults_of(drone: str, times: dict[str, float | None]) -> list[str]:
    """Return the late actions of a drone that must land."""
    wrong = []
    for name, limit_s in (("hover_s", HOVER_S), ("land_s", LAND_S)):
        value = times[name]
        if value is None or value > limit_s:
            wrong.append(f"{drone}: {name} {value}")
    if (times["moved_s"] or 0.0) > HOVER_S:
        wrong.append(f"{drone}: moved after {times['moved_s']} s")
    return wrong


def _until_down(run: SitlRun, tap: WireTap, addresses: dict[str, str], broken: float) -> None:
    """Wait until the drones that must land have received LAND, and landed if their telemetry shows it; 12 s at most."""
    while time.monotonic() < broken + 12.0:
        run.listen()
        told = all(tap.first_landing(address, broken) is not None for address in addresses.values())
        if time.monotonic() > broken + 4.0 and told and all(map(run.on_ground, addresses)):
            return
        time.sleep(0.05)


def _end(run: SitlRun, case: Case, pids: dict[str, int]) -> list[str]:
    """Wake frozen processes, stop the run, and return the remaining ones."""
    for name, kind in case:
        if kind == "frozen" and pids[name] in run.survivors():
            os.kill(pids[name], signal.SIGCONT)
    if run.process.poll() is None:
        run.process.send_signal(signal.SIGTERM)
        try:
            run.wait(40)
        except AssertionError:
            return ["the run did not end"]
    deadline = time.monotonic() + 30.0
    while run.survivors() and time.monotonic() < deadline:
        time.sleep(0.1)
    return [f"orphans: {run.survivors()}"] if run.survivors() else []


def main() -> int:
    """Fly a part of the campaign."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--part", default="1/1", help="K/N: every Nth case from the Kth on")
    parser.add_argument("--only", choices=("all", "singles", "pairs"), default="all")
    parser.add_argument("--seconds", type=float, default=1800.0, help="begin no case after so long")
    told = parser.parse_args()
    chosen = [one for one in cases() if told.only == "all" or (len(one) == 1) == (told.only == "singles")]
    began, tap, unsafe = time.monotonic(), WireTap(), 0
    for case in part_of(chosen, told.part):
        if time.monotonic() - began > told.seconds:
            print("time is up: more of this part is left", flush=True)
            break
        with tempfile.TemporaryDirectory(prefix="skein-wire-") as folder:
            result = fly(case, Path(folder), tap)
        unsafe += bool(result["wrong"])
        name = " + ".join(f"{process} {kind}" for process, kind in case)
        print(json.dumps({"case": name, **result}), flush=True)
    tap.close()
    return 1 if unsafe else 0


if __name__ == "__main__":
    sys.exit(main())
