"""Makes the process table of a resolved field; no other module knows all processes of a run."""

import json
import time
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec

from drivers.camera.source_address import parse_source
from groundstation.bus import topics
from groundstation.bus.access import AccessList
from groundstation.bus.roles import SHELLS, Member, Role, certificate_name
from groundstation.bus.thinning import rates_by_key
from groundstation.console.section import enough_hz
from groundstation.errors import OperatorMistake
from groundstation.field.targets import odometry_name
from groundstation.flight.failsafe_datagrams import failsafe_datagrams
from groundstation.flight.real_parts import ALL_EMULATED, RealParts
from groundstation.plug_ins import planner_title
from groundstation.process.ports import port_of
from groundstation.runtime.liaison import VERSION, LiaisonSection
from groundstation.runtime.router import RouterSection
from groundstation.settings.behaviour import Bus
from groundstation.settings.schema import Field
from groundstation.settings.sections import (
    CAMERA,
    MOTION_CAPTURE,
    ODOMETRY,
    RANGING,
    DriverSection,
    core_section,
    driver_sections,
    rerouted,
)
from groundstation.supervisor import process_table as rows
from groundstation.supervisor.guard_order import guarded
from groundstation.supervisor.network import Network
from groundstation.supervisor.process_spec import ProcessSpec
from groundstation.supervisor.run import SOURCE
from groundstation.supervisor.site import hosts
from groundstation.vehicles import kind_named

_SENSOR_DRIVERS = {
    CAMERA: "drivers.camera.driver:run",
    MOTION_CAPTURE: "drivers.motion_capture.driver:run",
    RANGING: "drivers.ranging.driver:run",
    ODOMETRY: "drivers.target_odometry.driver:run",
}
# Enough for a vehicle's roll and pitch at a picture's exposure, which are interpolated: below 1 mrad off.
_ATTITUDES_HZ = 30.0


@dataclass(frozen=True, slots=True)
class Simulation:
    """The simulated part of a run: its network, scenario and seed, and the parts that are real nevertheless.

    The scenario is kept as in its file: only the simulator, which checks it, knows its keys.
    """

    network: Network
    scenario: dict[str, Any]
    seed: int | None
    real: RealParts = ALL_EMULATED


def fly_endpoint(field: Field) -> str:
    """Return the endpoint on which the router of a real flight listens."""
    return f"tls/127.0.0.1:{field.bus.port}"


def simulated(field: Field, network: Network, real: RealParts = ALL_EMULATED) -> Field:
    """Return the field with the addresses of its emulated devices; real parts keep those of the file."""
    addresses = {
        name: network.of(drone.host).drone_address(index)
        for index, (name, drone) in enumerate(field.drones.items())
        if name not in real.drones
    }
    streams = _streams(field, network, real)
    return rerouted(field, addresses, streams, frozenset(real.drones), _captures(field, network, real))


def _captures(field: Field, network: Network, real: RealParts) -> dict[str, tuple[str, int]]:
    """Return addresses of emulated motion capture, ranging and routers of targets, numbered after the cameras."""
    first = len(field.cameras) + len(field.drones)
    hosts = {name: one.host for name, one in field.motion_capture.items()}
    hosts |= {name: one.host for name, one in field.ranging.items()}
    told = {odometry_name(name): name for name, target in field.tracked.items() if target.odometry is not None}
    hosts |= dict.fromkeys(told, "")
    places = {name: network.of(host).stream(index) for index, (name, host) in enumerate(hosts.items(), start=first)}
    exist = real.systems | {name for name, target in told.items() if target in real.targets}
    return {name: place for name, place in places.items() if name not in exist}


def _streams(field: Field, network: Network, real: RealParts) -> dict[str, tuple[str, int]]:
    hosts = {name: camera.host for name, camera in field.cameras.items()}
    hosts |= {name: drone.host for name, drone in field.drones.items()}
    streams = {name: network.of(host).stream(index) for index, (name, host) in enumerate(hosts.items())}
    for index, (name, drone) in enumerate(field.drones.items()):
        source = parse_source(drone.camera.source)
        # A drone sends its own video from its own address; a real drone's is not ours, so its emulated camera is
        # separate.
        if source.vehicle and source.vehicle == kind_named(drone.kind).camera and name not in real.drones:
            streams[name] = (network.of(drone.host).drone_address(index), source.port)
    return {name: stream for name, stream in streams.items() if name not in real.cameras}


def process_table(
    field: Field, endpoint: str, run_dir: Path, *, simulation: Simulation | None, monitor: bool
) -> tuple[ProcessSpec, ...]:
    """Return all processes of a run; `field` already has its final addresses."""
    core = core_section(field, str(run_dir), int(time.time()))
    table = [rows.ROUTER]
    if simulation is not None:
        table.append(_sim_bridge(field, simulation))
    table.append(replace(rows.TRACKER, section=core, guest=planner_title(field.planner.plug_in)))
    if field.cameras:  # only where a fixed camera sees the team can sightings contradict the field
        table.append(replace(rows.DIAGNOSIS, section=core))
    if field.recording.enabled:
        table.append(replace(rows.RECORDER, section=core))
    table += device_rows(field)
    table += [_liaison(host, field) for host in hosts_of(field)]
    if field.console.enabled:
        page = json.dumps(json.loads(core) | {"truth": simulation is not None})
        enough = enough_hz(field.site, field.drones, field.tracked)
        table.append(replace(rows.CONSOLE, section=page, at_most_hz=enough))
    if monitor:
        table.append(replace(rows.MONITOR, section=core))
    elsewhere = [member for host in hosts_of(field) for member in members_on(host, field)]
    table[0] = replace(rows.ROUTER, section=router_section(endpoint, field.site, table, field.bus, elsewhere))
    return guarded(tuple(table))


def hosts_of(field: Field) -> tuple[str, ...]:
    """Return the other hosts that run devices of a field."""
    return tuple(dict.fromkeys(section.host for section in driver_sections(field) if section.host))


def device_rows(field: Field, host: str = "") -> list[ProcessSpec]:
    """Return the drivers of one host: the run's own ("") or another one."""
    return [_driver(section, field) for section in driver_sections(field) if section.host == host]


def members_on(host: str, field: Field) -> list[Member]:
    """Return the members that another host may act as: itself, and the devices that it runs; raises OperatorMistake."""
    certificate = certificate_name(host)
    if certificate not in {member.name for member in hosts(field.site)}:
        raise OperatorMistake(
            f"{host} is to run devices and was not admitted: groundstation site admit {field.site} {host} "
            f"{field.bus.listen}"
        )
    devices = [Member(certificate, Role(row.role), (row.name,), row.entities) for row in device_rows(field, host)]
    return [Member(certificate, Role.HOST, (host,), (host,)), *devices]


def _liaison(host: str, field: Field) -> ProcessSpec:
    section = LiaisonSection(host, VERSION, field.model_dump_json())
    return replace(rows.LIAISON, name=f"liaison_{host}", section=msgspec.json.encode(section).decode())


def router_section(
    endpoint: str, site: str, table: Iterable[ProcessSpec], bus: Bus, elsewhere: Iterable[Member] = ()
) -> str:
    """Return the router's section: its endpoint, and the members it admits, here and on other hosts."""
    members = [
        Member(spec.name, Role(spec.role), (spec.name,), spec.entities or (spec.name,)) for spec in table if spec.on_bus
    ]
    members += [Member(SOURCE, Role.SUPERVISOR, (SOURCE,)), *SHELLS]
    also = (f"tls/{bus.listen}:{port_of(endpoint)}",) if bus.listen else ()
    members += (*hosts(site), *elsewhere) if bus.listen else ()
    access = AccessList(site, tuple(members))
    return msgspec.json.encode(RouterSection(endpoint, access, also, bus.name_refusals)).decode()


def _driver(section: DriverSection, field: Field) -> ProcessSpec:
    sensor = _SENSOR_DRIVERS.get(section.kind)
    attitudes = ((topics.ODOMETRY, field.drones, _ATTITUDES_HZ),) if section.kind == CAMERA else ()
    row = rows.DRONE if sensor is None else rows.TARGET if section.kind == ODOMETRY else rows.CAMERA
    spec = replace(
        row,
        name=section.name,
        entry=sensor or kind_named(section.kind).driver,
        section=section.section,
        entities=section.entities,
        at_most_hz=rates_by_key(field.site, attitudes),
    )
    if sensor is not None:
        return spec
    return replace(spec, failsafe_datagrams=failsafe_datagrams(field, section))


def _sim_bridge(field: Field, simulation: Simulation) -> ProcessSpec:
    network, real = simulation.network, simulation.real
    order = {
        "field": field.model_dump(mode="json"),
        "scenario": simulation.scenario,
        "addresses": {name: drone.address for name, drone in field.drones.items() if name not in real.drones},
        "streams": _streams(field, network, real),
        "captures": _captures(field, network, real),
        "real": {
            name: {"source": body.source, "address": body.address, "system": body.system}
            for name, body in real.bodies.items()
        },
        "seed": simulation.seed,
    }
    return replace(rows.SIM_BRIDGE, section=json.dumps(order), keep_open=(network.lock,))
