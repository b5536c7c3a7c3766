"""`python -m sim_bridge.standalone 127.0.0.2 px4@127.0.0.3`: emulated drones alone, for programs of others.

Each address gets a drone of its own with the ports of a real one (an AR.Drone, or `px4@`, `ardupilot@`: system ids from
1 on, UDP port 14550), 2 m from the next in an empty room; no bus, no ground station. With `--truth`, a line of JSON
every 0.1 s says where each really is and what it does. Exit codes: 0 stopped (Ctrl-C, SIGTERM, `--seconds`), 1 cannot
run (the port that is taken is named), 2 wrong arguments or scenario.
"""

import argparse
import ipaddress
import json
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from groundstation.errors import GroundStationError, SettingsError
from sim_bridge.cameras import render_specs
from sim_bridge.devices.ardrone import ArDroneEmulator
from sim_bridge.devices.ardrone_firmware import DEFAULT, FIRMWARES, ArdroneFirmware
from sim_bridge.devices.ardrone_video import PORT
from sim_bridge.devices.mavlink_open import open_at
from sim_bridge.devices.mavlink_satellites import Satellites
from sim_bridge.devices.mavlink_truth import TruthTeller
from sim_bridge.mavlink_scenario import CopterScenario
from sim_bridge.scenario import Scenario, TargetScenario
from sim_bridge.settings_files import named_scenario
from sim_bridge.site import Site
from sim_bridge.stage import Stage
from sim_bridge.target_paths import Standstill
from sim_bridge.tick_schedule import Clockwork
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.emulation import Body
from sim_bridge.world.mavlink_copter import MavlinkCopter
from sim_bridge.world.world import TICK_NS, World

Address = tuple[str, int]
_SPACING_M = 2.0
_TRUTH_TICKS = 20
_MODE_TICKS = 20
# WIRE (docs/reference/ardrone.md 6): calibration of a real front camera at 640x360.
_FRONT = {
    "width_px": 640, "height_px": 360, "fx_px": 569.9, "fy_px": 568.0, "cx_px": 331.4, "cy_px": 135.9,
    "distortion": (-0.527, 0.274, 0.021, -0.006, 0.0),
}  # fmt: skip


def site_of(names: Sequence[str]) -> Site:
    """Return a room with a drone for each name, in a row along y, all facing a parked TurtleBot along x."""
    middle = (len(names) - 1) / 2
    drones: dict[str, dict[str, object]] = {}
    for index, name in enumerate(names):
        kind, at, _ = name.rpartition("@")
        drones[name] = {
            "kind": "mavlink" if at else "ardrone",
            "mavlink": {"flavour": kind, "system_id": index + 1} if at else None,
            "pad_m": (0.0, (index - middle) * _SPACING_M),
            "marker": {"code": index % 16, "square_mm": 44, "position_m": (0.0, 0.0, 0.08)},
            "camera": None
            if at
            else {"source": "ardrone://", "calibration": _FRONT, "position_m": (0.2, 0.0, 0.0), "tilt_down_deg": 0.0},
        }
    return Site.model_validate(
        {
            "site": "hangar",
            "room": {"size_m": (40.0, 20.0 + len(names) * _SPACING_M, 6.0)},
            "drones": drones,
            "target": {"name": "target", "marker": {"code": 5, "height_m": 0.4, "square_mm": 44}},
        }
    )


@dataclass(frozen=True, slots=True)
class MavlinkChoice:
    """Options of MAVLink vehicles.

    indoor: set up for flight on poses from outside, which their ground station must send, else with satellites; calls:
    address that each of them speaks to unasked; truth: address to which the first sends its true state.
    """

    indoor: bool = False
    calls: Address | None = None
    truth: Address | None = None


class Hangar:
    """The drones and their ports; `close` releases them."""

    def __init__(
        self, names: Sequence[str], firmware: ArdroneFirmware, seed: int = 1, mavlink: MavlinkChoice = MavlinkChoice(),
        scenario: Scenario | None = None,
    ) -> None:  # fmt: skip
        scenario = scenario or Scenario()
        self._site, self._seed, self._mavlink = site_of(names), seed, mavlink
        copters = scenario.of_kind("mavlink", CopterScenario).model_copy(update={"configured": mavlink.indoor})
        drones = scenario.drones.model_copy(update={"firmware": firmware.name})
        parked = TargetScenario(path=Standstill(position_m=(6.0, 0.0)))
        self._scenario = scenario.model_copy(update={"mavlink": copters, "drones": drones, "target": parked})
        self.world = World(self._site, self._scenario, seed)
        self._stage = Stage(self.world)
        self._tellers: list[TruthTeller] = []
        try:
            for name, drone in self.world.of(Quadrotor).items():
                emulator = ArDroneEmulator(name, name, drone, self.world.onboard[name], firmware=firmware)
                self._stage.add(name, emulator, emulator.fileno())
            for name, copter in self.world.of(MavlinkCopter).items():
                self._open_mavlink(name, copter)
        except GroundStationError:
            self.close()
            raise

    def _open_mavlink(self, name: str, copter: MavlinkCopter) -> None:
        choice, address = self._mavlink, name.rpartition("@")[2]
        vehicle = open_at(address, name, self._site.drones[name], copter, self._scenario, calls=choice.calls)
        self._stage.add(name, vehicle, vehicle.socket.fileno())
        parameters = vehicle.firmware.parameters
        if not choice.indoor:
            vehicle.equip(Satellites(self._seed + parameters.system))
        if choice.truth is not None and not self._tellers:
            self._tellers.append(TruthTeller(parameters.flavour, parameters.system, copter.airframe, choice.truth))

    def open_video(self, should_stop: Callable[[], bool]) -> None:
        """Serve the pictures of all drones; returns when every port listens. Raises GroundStationError."""
        name = f"{os.getpid()}-hangar"
        self._stage.share_truth(name)
        streams = {address: (address, PORT) for address in self.world.of(Quadrotor)}
        specs = render_specs(self._site, self._scenario, streams, name, self._seed)
        self._stage.open_cameras(specs, should_stop)

    def tick(self, stamp_ns: int) -> None:
        """Advance by 5 ms; stamp_ns: boot-clock time of the new states."""
        self._stage.tick(stamp_ns)
        for teller in self._tellers:
            teller.send()
        if self.world.ticks % _MODE_TICKS == 0:
            self._stage.tell_cameras()

    def truth(self) -> str:
        """Return the true state [m, m/s, rad; world] and action of each drone, as a line of JSON."""
        drones = {}
        for name, drone in self.world.drones.items():
            body = drone.airframe
            drones[name] = {
                "position": [round(value, 4) for value in (body.x, body.y, body.z)],
                "velocity": [round(value, 4) for value in (body.vx, body.vy, body.vz)],
                "yaw": round(body.yaw, 4),
                "phase": self._phase(name, drone),
                "battery": round(drone.battery, 4),
            }
        return json.dumps({"time": round(self.world.time_s, 3), "drones": drones})

    def _phase(self, name: str, drone: Body) -> str:
        if isinstance(drone, Quadrotor):
            return drone.autopilot.phase.name
        words = ["ARMED"] if drone.autopilot.motors_on else []
        return " ".join([*words, drone.steering.name] if isinstance(drone, MavlinkCopter) else words)

    def close(self) -> None:
        """Stop the pictures and close all ports; idempotent."""
        self._stage.close()
        while self._tellers:
            self._tellers.pop().close()


def serve(hangar: Hangar, seconds: float, tell_truth: bool, should_stop: Callable[[], bool]) -> None:
    """Run in real time until stopped."""
    clock = Clockwork(time.monotonic_ns())
    while not should_stop() and clock.ticks * TICK_NS < seconds * 1e9:
        deadline_ns = clock.next_deadline()
        time.sleep(max(0.0, (deadline_ns - time.monotonic_ns()) / 1e9))
        clock.begin(time.monotonic_ns())
        hangar.tick(clock.deadline_ns)
        if tell_truth and clock.ticks % _TRUTH_TICKS == 0:
            print(hangar.truth(), flush=True)


def _drone(text: str) -> str:
    kind, at, address = text.rpartition("@")
    try:
        good = ipaddress.IPv4Address(address).is_loopback
    except ValueError:
        good = False
    if not good:
        raise argparse.ArgumentTypeError(f"{address!r} is no loopback address: give one such as 127.0.0.2")
    if at and kind not in ("ardrone", "px4", "ardupilot"):
        raise argparse.ArgumentTypeError(f"{kind!r} is no kind of drone, only ardrone, px4 and ardupilot")
    return address if kind == "ardrone" else text


def _place(text: str) -> Address:
    host, _, port = text.rpartition(":")
    try:
        if not ipaddress.IPv4Address(host).is_loopback or not 0 < int(port) < 65536:
            raise ValueError(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no loopback address and port, such as 127.0.0.1:14550") from None
    return host, int(port)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m sim_bridge.standalone", description=__doc__)
    parser.add_argument(
        "drones", nargs="+", type=_drone, metavar="[KIND@]ADDRESS", help="ardrone (default), px4 or ardupilot"
    )
    parser.add_argument(
        "--firmware", choices=FIRMWARES, default=DEFAULT, help="of all AR.Drones (default: %(default)s)"
    )
    parser.add_argument(
        "--omit-option", type=int, action="append", default=[], metavar="TAG", help="navdata option never to send"
    )
    parser.add_argument("--no-video", action="store_true", help="leave TCP port 5555 closed")
    parser.add_argument(
        "--indoor", action="store_true", help="MAVLink vehicles without satellites, set up for poses from outside"
    )
    parser.add_argument("--call", type=_place, metavar="ADDRESS:PORT", help="whom MAVLink vehicles speak to unasked")
    parser.add_argument(
        "--truth-to", type=_place, metavar="ADDRESS:PORT", help="where the first MAVLink vehicle sends its true state"
    )
    parser.add_argument(
        "--scenario",
        help="scenario file, or a shipped one's name: errors and habits of the drones, without faults and targets",
    )
    parser.add_argument("--seed", type=int, default=1, help="of noise and unrest (default: %(default)s)")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after so long")
    parser.add_argument("--truth", action="store_true", help="print the true states")
    arguments = parser.parse_args()
    places = [name.rpartition("@")[2] for name in arguments.drones]
    if len(set(places)) < len(places):
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
        mavlink = MavlinkChoice(arguments.indoor, arguments.call, arguments.truth_to)
        scenario = named_scenario(arguments.scenario) if arguments.scenario else Scenario()
        hangar = Hangar(arguments.drones, firmware, arguments.seed, mavlink, scenario)
        # WIRE: an AR.Drone 1 sends its pictures over UDP in a coding of its own, which is not emulated.
        if hangar.world.of(Quadrotor) and not arguments.no_video and firmware.generation == 2:
            hangar.open_video(lambda: bool(stopped))
        print(f"serving {', '.join(arguments.drones)}", file=sys.stderr, flush=True)
        serve(hangar, arguments.seconds, arguments.truth, lambda: bool(stopped))
    except SettingsError as error:
        print(error, file=sys.stderr)
        return 2
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
