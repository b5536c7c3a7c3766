"""Hosts the real drivers of a field, with their watchdogs, in one thread at the emulated vehicles' wire."""

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from drivers.ardrone.driver import RATE_HZ as ARDRONE_HZ
from drivers.ardrone.driver import ArDrone
from drivers.ardrone.settings import ArDroneDriverSettings
from drivers.host import VehicleHost
from drivers.mavlink.driver import RATE_HZ as MAVLINK_HZ
from drivers.mavlink.driver import Fleet, hosts_of
from drivers.mavlink.settings import MavlinkDriverSettings
from drivers.watchdog_types import WatchdogDecision
from groundstation.bus.api import Bus
from groundstation.bus.messages import Severity
from sim_bridge.devices.mavlink import MavlinkEmulator
from sim_bridge.devices.mavlink_open import open_at
from sim_bridge.scenario import Scenario
from sim_bridge.site import Site
from sim_bridge.study.faults.ardrone_device import MemoryArDrone
from sim_bridge.study.faults.memory_network import MemoryNetwork
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.mavlink_copter import MavlinkCopter
from sim_bridge.world.world import TICK_NS, World
from sim_bridge.wrong_values import WrongValues

Device = MemoryArDrone | MavlinkEmulator
# One driver process: its kind, and its section of the settings as from the supervisor.
Section = tuple[str, str]
BusOf = Callable[[str], Bus]


class HostedProcess:
    """A driver's interface to its process; `said` keeps its events."""

    def __init__(self, name: str, bus: Bus, said: list[tuple[str, str]]) -> None:
        self.name, self.section = name, "{}"
        self.bus: Bus = bus
        self.stop_requested = False
        self.supervisor_alive = self.supervisor_fresh = True
        self.spoken_for_ns = 0
        self._said = said

    def beat(self) -> None:
        """Nobody watches."""

    def ready(self, detail: str = "") -> None:
        """Nobody waits."""

    def degrade(self, detail: str, works: bool = True) -> None:
        """Nobody waits."""

    def note_addresses(self, addresses: Sequence[tuple[str, int]]) -> None:
        """Keep no addresses: no process dies here."""

    def finish(self) -> None:
        """Nobody waits."""

    def leave(self, number: int) -> None:
        """Leave nothing: no process dies here."""

    def tick_status(self, ticks: int = 0, overruns: int = 0, overflowed: int = 0) -> None:
        """Nobody watches."""

    def sleep_until(self, deadline_ns: int) -> bool:
        """Never asked to stop."""
        return True

    def wake(self) -> None:
        """Do nothing: the study calls each turn."""

    def event(self, severity: Severity | str, text: str, remedy: str = "", entity: str | None = None) -> None:
        """Keep an event."""
        self._said.append((str(severity), text))


def devices_of(
    site: Site, world: World, scenario: Scenario, wrong: Mapping[str, WrongValues], addresses: Mapping[str, str],
    network: MemoryNetwork,
) -> dict[str, Device]:  # fmt: skip
    """Return the emulated vehicles; call it while sockets are in memory."""
    devices: dict[str, Device] = {}
    for name, drone in world.of(Quadrotor).items():
        firmware = scenario.drones.firmware_of(name)
        devices[name] = MemoryArDrone(addresses[name], drone, world.onboard[name], firmware, wrong[name], network)
    for name, copter in world.of(MavlinkCopter).items():
        placed = site.drones[name]
        devices[name] = open_at(addresses[name], name, placed, copter, scenario, wrong=wrong[name])
    return devices


def of_team(sections: Iterable[Section], drones: Mapping[str, Any]) -> list[Section]:
    """Return the sections of these drones' drivers, and all others: sensors of the team, a target's odometry."""
    kept = []
    for kind, section in sections:
        plain = json.loads(section)
        if "vehicles" in plain:
            plain["vehicles"] = [vehicle for vehicle in plain["vehicles"] if vehicle["name"] in drones]
            kept += [(kind, json.dumps(plain))] if plain["vehicles"] else []
        elif kind != "ardrone" or plain["name"] in drones:
            kept.append((kind, section))
    return kept


def placed(sections: Iterable[Section], field: Mapping[str, Any]) -> list[Section]:
    """Return the sections with the pads and the fence of a field (plain values), which drivers keep to."""
    return [(kind, json.dumps(_placed(json.loads(section), field))) for kind, section in sections]


def _placed(section: dict[str, Any], field: Mapping[str, Any]) -> dict[str, Any]:
    drones, fence = field["drones"], field["room"]["fence"]
    if "safety" in section:
        section["safety"]["fence_m"] = [fence[axis] for axis in ("x_m", "y_m", "z_m")]
    for vehicle in section.get("vehicles") or [section]:
        if (drone := drones.get(vehicle["name"])) is None:
            continue  # sensors of the team, or a target's odometry
        vehicle["pad_m"] = drone["pad_m"]
        if "pad_yaw_rad" in vehicle:
            vehicle["pad_yaw_rad"] = math.radians(drone["pad_yaw_deg"])
    return section


class Drivers:
    """All drivers of a field. Build it under the stand-ins for threads and sockets; call `turn` once per tick."""

    def __init__(self, sections: Sequence[Section], bus_of: BusOf, said: list[tuple[str, str]]) -> None:
        self.hosts: dict[str, VehicleHost] = {}
        self.decisions: dict[str, WatchdogDecision] = {}
        self._fleets: list[tuple[Fleet, list[VehicleHost]]] = []
        self._alone: list[VehicleHost] = []
        for kind, section in sections:
            if kind == "ardrone":
                settings = ArDroneDriverSettings.model_validate_json(section)
                process = HostedProcess(settings.name, bus_of(settings.name), said)
                self._alone.append(VehicleHost(process, ArDrone(settings, process.bus), settings.authority))
            elif kind == "mavlink":
                self._open_fleet(section, bus_of, said)
        for host in (*self._alone, *(host for _, hosts in self._fleets for host in hosts)):
            self.hosts[host.vehicle.name] = host

    def _open_fleet(self, section: str, bus_of: BusOf, said: list[tuple[str, str]]) -> None:
        # MAVSDK is a native program with threads and sockets of its own: its frames are those of pymavlink.
        plain = json.loads(section)
        plain["link"]["kind"] = "pymavlink"
        settings = MavlinkDriverSettings.model_validate(plain)
        process = HostedProcess(settings.vehicles[0].name, bus_of(settings.vehicles[0].name), said)
        fleet = Fleet(process, settings)
        self._fleets.append((fleet, list(hosts_of(process, fleet, settings))))

    def turn(self, now_ns: int, tick: int) -> None:
        """Run a turn of each driver that is due or woken by an order."""
        if tick % round(1e9 / ARDRONE_HZ / TICK_NS) == 0:
            for host in self._alone:
                self.decisions[host.vehicle.name] = host.turn(now_ns)
        due = tick % round(1e9 / MAVLINK_HZ / TICK_NS) == 0
        for fleet, hosts in self._fleets:
            if due:
                fleet.turn(now_ns)
            for host in hosts:
                if due or host.due_ns() <= now_ns:
                    self.decisions[host.vehicle.name] = host.turn(now_ns)
