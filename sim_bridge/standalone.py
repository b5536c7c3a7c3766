"""`python -m sim_bridge.standalone 127.0.0.2 127.0.0.3`: emulated AR.Drones alone, for programs of others.

Each address gets a drone of its own with the ports of a real one, 2 m from the next in an empty room; no bus, no
ground station. With `--truth`, a line of JSON every 0.1 s says where each really is and what it does. Exit codes:
0 stopped (Ctrl-C, SIGTERM, `--seconds`), 1 cannot run (the port that is taken is named), 2 wrong arguments.
"""

import argparse
import ipaddress
import json
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence

from groundstation.errors import GroundStationError
from sim_bridge.cameras import render_specs
from sim_bridge.devices.ardrone import ArDroneEmulator
from sim_bridge.devices.ardrone_firmware import DEFAULT, FIRMWARES, ArdroneFirmware
from sim_bridge.devices.ardrone_video import PORT
from sim_bridge.scenario import DroneScenario, Scenario, Standstill, TargetScenario
from sim_bridge.site import Site
from sim_bridge.stage import Stage
from sim_bridge.tick_schedule import Clockwork
from sim_bridge.world.world import TICK_NS, World

_SPACING_M = 2.0
_TRUTH_TICKS = 20
_MODE_TICKS = 20
# WIRE (docs/reference/ardrone.md 6): calibration of a real front camera at 640x360.
_FRONT = {
    "width_px": 640, "height_px": 360, "fx_px": 569.9, "fy_px": 568.0, "cx_px": 331.4, "cy_px": 135.9,
    "distortion": (-0.527, 0.274, 0.021, -0.006, 0.0),
}  # fmt: skip


def site_of(addresses: Sequence[str]) -> Site:
    """Return a room with a drone for each address, in a row along y, all looking along x at a parked TurtleBot."""
    middle = (len(addresses) - 1) / 2
    camera = {"source": "ardrone://", "calibration": _FRONT, "position_m": (0.2, 0.0, 0.0), "tilt_down_deg": 0.0}
    drones = {
        address: {
            "kind": "ardrone",
            "pad_m": (0.0, (index - middle) * _SPACING_M),
            "marker": {"code": index % 16, "square_mm": 44, "position_m": (0.0, 0.0, 0.08)},
            "camera": camera,
        }
        for index, address in enumerate(addresses)
    }
    return Site.model_validate(
        {
            "site": "hangar",
            "room": {"size_m": (40.0, 20.0 + len(addresses) * _SPACING_M, 6.0)},
            "drones": drones,
            "target": {"name": "target", "marker": {"code": 5, "height_m": 0.4, "square_mm": 44}},
        }
    )


class Hangar:
    """The drones and their ports; `close` releases them."""

    def __init__(self, addresses: Sequence[str], firmware: ArdroneFirmware, seed: int = 1) -> None:
        self._site, self._seed = site_of(addresses), seed
        parked = TargetScenario(path=Standstill(position_m=(6.0, 0.0)))
        self._scenario = Scenario(drones=DroneScenario(firmware=firmware.name), target=parked)
        self.world = World(self._site, self._scenario, seed)
        self._stage = Stage(self.world)
        try:
            for address, drone in self.world.ardrones.items():
                onboard = self.world.onboard[address]
                emulator = ArDroneEmulator(address, address, drone, onboard, firmware=firmware)
                self._stage.add(address, emulator, emulator.fileno())
        except GroundStationError:
            self.close()
            raise

    def open_video(self, should_stop: Callable[[], bool]) -> None:
        """Serve the pictures of all drones; returns when every port listens. Raises GroundStationError."""
        name = f"{os.getpid()}-hangar"
        self._stage.share_truth(name)
        streams = {address: (address, PORT) for address in self._stage.emulators}
        specs = render_specs(self._site, self._scenario, streams, name, self._seed)
        self._stage.open_cameras(specs, should_stop)

    def tick(self, stamp_ns: int) -> None:
        """Advance by 5 ms; stamp_ns: the boot-clock time that the new states are true at."""
        self._stage.tick(stamp_ns)
        if self.world.ticks % _MODE_TICKS == 0:
            self._stage.tell_cameras()

    def truth(self) -> str:
        """Return where each drone really is [m, m/s, rad; world] and what it does, as a line of JSON."""
        drones = {}
        for name, drone in self.world.ardrones.items():
            body = drone.airframe
            drones[name] = {
                "position": [round(value, 4) for value in (body.x, body.y, body.z)],
                "velocity": [round(value, 4) for value in (body.vx, body.vy, body.vz)],
                "yaw": round(body.yaw, 4),
                "phase": drone.autopilot.phase.name,
                "battery": round(drone.battery, 4),
            }
        return json.dumps({"time": round(self.world.time_s, 3), "drones": drones})

    def close(self) -> None:
        """Stop the pictures and close all ports; idempotent."""
        self._stage.close()


def serve(hangar: Hangar, seconds: float, tell_truth: bool, should_stop: Callable[[], bool]) -> None:
    """Turn in real time."""
    clock = Clockwork(time.monotonic_ns())
    while not should_stop() and clock.ticks * TICK_NS < seconds * 1e9:
        deadline_ns = clock.next_deadline()
        time.sleep(max(0.0, (deadline_ns - time.monotonic_ns()) / 1e9))
        clock.begin(time.monotonic_ns())
        hangar.tick(clock.deadline_ns)
        if tell_truth and clock.ticks % _TRUTH_TICKS == 0:
            print(hangar.truth(), flush=True)


def _address(text: str) -> str:
    try:
        good = ipaddress.IPv4Address(text).is_loopback
    except ValueError:
        good = False
    if not good:
        raise argparse.ArgumentTypeError(f"{text!r} is no loopback address: give one such as 127.0.0.2")
    return text


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m sim_bridge.standalone", description=__doc__)
    parser.add_argument("addresses", nargs="+", type=_address, metavar="ADDRESS", help="loopback address of a drone")
    parser.add_argument("--firmware", choices=FIRMWARES, default=DEFAULT, help="of all drones (default: %(default)s)")
    parser.add_argument(
        "--omit-option", type=int, action="append", default=[], metavar="TAG", help="navdata option never to send"
    )
    parser.add_argument("--no-video", action="store_true", help="leave TCP port 5555 closed")
    parser.add_argument("--seed", type=int, default=1, help="of noise and unrest (default: %(default)s)")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after so long")
    parser.add_argument("--truth", action="store_true", help="print the true states")
    arguments = parser.parse_args()
    if len(set(arguments.addresses)) < len(arguments.addresses):
        parser.error("an address stands twice")
    return arguments


def main() -> int:
    """Serve until told to stop."""
    arguments = _arguments()
    stopped: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda number, _frame: stopped.append(number))
    firmware = FIRMWARES[arguments.firmware].without(tuple(arguments.omit_option))
    hangar: Hangar | None = None
    try:
        hangar = Hangar(arguments.addresses, firmware, arguments.seed)
        # WIRE: an AR.Drone 1 sends its pictures over UDP in a coding of its own, which is not emulated.
        if not arguments.no_video and firmware.generation == 2:
            hangar.open_video(lambda: bool(stopped))
        print(f"serving {', '.join(arguments.addresses)}", file=sys.stderr, flush=True)
        serve(hangar, arguments.seconds, arguments.truth, lambda: bool(stopped))
    except GroundStationError as error:
        print(f"hangar: {error}", file=sys.stderr)
        return 1
    except BrokenPipeError:
        return 0
    finally:
        if hangar is not None:
            hangar.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
