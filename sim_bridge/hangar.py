"""`python -m sim_bridge.hangar 127.0.0.2 127.0.0.3`: emulated AR.Drones alone, for programs of others.

Each address gets a drone of its own with the ports of a real one, 2 m from the next in an empty room; no bus, no
ground station. With `--truth`, a line of JSON every 0.1 s says where each really is and what it does. Exit codes:
0 stopped (Ctrl-C, SIGTERM, `--seconds`), 1 cannot run (the port that is taken is named), 2 wrong arguments.
"""

import argparse
import ipaddress
import json
import select
import signal
import sys
import time

from groundstation.errors import GroundStationError
from sim_bridge.clockwork import Clockwork
from sim_bridge.devices.ardrone import ArDroneEmulator
from sim_bridge.devices.ardrone_firmware import DEFAULT, FIRMWARES, Firmware
from sim_bridge.scenario import DroneScenario, Scenario, Standstill, TargetScenario
from sim_bridge.site import Site
from sim_bridge.world.world import TICK_NS, World

_SPACING_M = 2.0
_TRUTH_TICKS = 20


def world_of(addresses: list[str], firmware: str, seed: int) -> World:
    """Return a room with one drone for each address, in a row along y, all looking along x."""
    middle = (len(addresses) - 1) / 2
    marker = {"code": 1, "square_mm": 44, "position_m": [0, 0, 0.08]}
    drones = {
        address: {"kind": "ardrone", "pad_m": [0, (index - middle) * _SPACING_M], "marker": marker}
        for index, address in enumerate(addresses)
    }
    site = Site.model_validate(
        {
            "site": "hangar",
            "room": {"size_m": [40, 20 + len(addresses) * _SPACING_M, 6]},
            "drones": drones,
            "target": {"name": "target", "marker": {"code": 5, "height_m": 0.4, "square_mm": 44}},
        }
    )
    aside = Standstill(position_m=(15.0, 0.0))
    scenario = Scenario(drones=DroneScenario(firmware=firmware), target=TargetScenario(path=aside))
    return World(site, scenario, seed)


class Hangar:
    """The drones and their ports; `close` releases them."""

    def __init__(self, addresses: list[str], firmware: Firmware, seed: int = 1) -> None:
        self.world = world_of(addresses, firmware.name, seed)
        self.emulators: dict[str, ArDroneEmulator] = {}
        self._poll = select.poll()
        self._readers: dict[int, ArDroneEmulator] = {}
        try:
            for address, drone in self.world.ardrones.items():
                onboard = self.world.onboard[address]
                emulator = ArDroneEmulator(address, address, drone, onboard, firmware=firmware)
                self.emulators[address] = emulator
                self._readers[emulator.fileno()] = emulator
                self._poll.register(emulator, select.POLLIN)
        except GroundStationError:
            self.close()
            raise

    def tick(self) -> None:
        """Advance by 5 ms."""
        for descriptor, _ in self._poll.poll(0):
            self._readers[descriptor].receive()
        self.world.step()
        for emulator in self.emulators.values():
            emulator.send()

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
        """Close all ports."""
        for emulator in self.emulators.values():
            emulator.close()
        self.emulators.clear()


def _address(text: str) -> str:
    address = ipaddress.ip_address(text)
    if address.version != 4 or not address.is_loopback:
        raise argparse.ArgumentTypeError(f"{text} is not on loopback: give addresses such as 127.0.0.2")
    return text


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m sim_bridge.hangar", description=__doc__)
    parser.add_argument("addresses", nargs="+", type=_address, metavar="ADDRESS", help="loopback address of a drone")
    parser.add_argument("--firmware", choices=FIRMWARES, default=DEFAULT, help="of all drones (default: %(default)s)")
    parser.add_argument("--omit-option", type=int, action="append", default=[], help="navdata option never to send")
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
    stopped = []
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda *_: stopped.append(True))
    try:
        hangar = Hangar(arguments.addresses, FIRMWARES[arguments.firmware].without(tuple(arguments.omit_option)))
    except GroundStationError as error:
        print(f"hangar: {error}", file=sys.stderr)
        return 1
    print(f"serving {', '.join(arguments.addresses)}", file=sys.stderr, flush=True)
    clock = Clockwork(time.monotonic_ns())
    try:
        while not stopped and clock.ticks * TICK_NS < arguments.seconds * 1e9:
            deadline_ns = clock.next_deadline()
            time.sleep(max(0.0, (deadline_ns - time.monotonic_ns()) / 1e9))
            clock.begin(time.monotonic_ns())
            hangar.tick()
            if arguments.truth and clock.ticks % _TRUTH_TICKS == 0:
                print(hangar.truth(), flush=True)
    except BrokenPipeError:
        return 0
    finally:
        hangar.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
