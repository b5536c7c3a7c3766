"""From a resolved field to the process table: the one place that knows which processes a run consists of."""

import json
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from drivers.camera.settings import SourceKind, parse_source
from drivers.registry import entry_point
from groundstation.flight.failsafe_datagrams import failsafe_datagrams
from groundstation.settings.schema import Field
from groundstation.settings.sections import DriverKind, DriverSection, core_section, driver_sections, rerouted
from groundstation.supervisor import process_table as rows
from groundstation.supervisor.guard_order import guarded
from groundstation.supervisor.network import Network
from groundstation.supervisor.process_spec import ProcessSpec


@dataclass(frozen=True, slots=True)
class Simulation:
    """What makes a run a simulated one: its network, scenario and seed.

    The scenario is as its file has it: only the simulator, which judges it, knows its keys.
    """

    network: Network
    scenario: dict[str, Any]
    seed: int | None


def fly_endpoint(field: Field) -> str:
    """Return where the router of a real flight listens."""
    return f"tcp/127.0.0.1:{field.bus.port}"


def simulated(field: Field, network: Network) -> Field:
    """Return the field with the addresses of its emulated devices."""
    addresses = {name: network.drone_address(index) for index, name in enumerate(field.drones)}
    return rerouted(field, addresses, _streams(field, network))


def _streams(field: Field, network: Network) -> dict[str, tuple[str, int]]:
    streams = {name: network.stream(index) for index, name in enumerate((*field.cameras, *field.drones))}
    for index, (name, drone) in enumerate(field.drones.items()):
        source = parse_source(drone.camera.source)
        if source.kind is SourceKind.ARDRONE:  # a drone sends its own video from its own address
            streams[name] = (network.drone_address(index), source.port)
    return streams


def process_table(
    field: Field, endpoint: str, run_dir: Path, *, simulation: Simulation | None, monitor: bool
) -> tuple[ProcessSpec, ...]:
    """Return all processes of a run; `field` already has the addresses that it is to use."""
    core = core_section(field, str(run_dir), int(time.time()))
    table = [replace(rows.ROUTER, section=json.dumps({"endpoint": endpoint}))]
    if simulation is not None:
        table.append(_sim_bridge(field, simulation))
    table.append(replace(rows.TRACKER, section=core))
    if field.recording.enabled:
        table.append(replace(rows.RECORDER, section=core))
    table += [_driver(section, field) for section in driver_sections(field)]
    if field.console.enabled:
        page = json.dumps(json.loads(core) | {"truth": simulation is not None})
        table.append(replace(rows.CONSOLE, section=page))
    if monitor:
        table.append(replace(rows.MONITOR, section=core))
    return guarded(tuple(table))


def _driver(section: DriverSection, field: Field) -> ProcessSpec:
    row = rows.CAMERA if section.kind is DriverKind.CAMERA else rows.DRONE
    spec = replace(row, name=section.name, entry=entry_point(section.kind), section=section.section)
    if section.kind is DriverKind.CAMERA:
        return spec
    return replace(spec, failsafe_datagrams=failsafe_datagrams(field, section))


def _sim_bridge(field: Field, simulation: Simulation) -> ProcessSpec:
    network = simulation.network
    order = {
        "field": field.model_dump(mode="json"),
        "scenario": simulation.scenario,
        "addresses": {name: drone.address for name, drone in field.drones.items()},
        "streams": _streams(field, network),
        "seed": simulation.seed,
    }
    return replace(rows.SIM_BRIDGE, section=json.dumps(order), keep_open=(network.lock,))
