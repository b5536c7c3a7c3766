"""From a resolved field to the process table: the one place that knows which processes a run consists of."""

import json
import os
import sys
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from drivers.ardrone.wire import at
from drivers.camera.settings import SourceKind, parse_source
from drivers.registry import entry_point
from groundstation.errors import GroundStationError, OperatorMistake
from groundstation.settings.schema import Field
from groundstation.settings.sections import DriverKind, DriverSection, core_section, driver_sections, rerouted
from groundstation.supervisor.network import Network
from groundstation.supervisor.table import LastWords, ProcessSpec, Restart, StopOrder

FLY_ENDPOINT = "tcp/127.0.0.1:7447"
_AT_PORT = 5556
_MIN_FREE_BYTES = 50_000_000


@dataclass(frozen=True, slots=True)
class Simulation:
    """What makes a run a simulated one: its network, scenario and seed."""

    network: Network
    scenario: dict[str, Any]
    seed: int | None


def make_run_dir(parent: Path, field_name: str) -> Path:
    """Return a new run folder that can be written; raises GroundStationError before anything has started."""
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
    path = parent / f"{stamp}-{field_name}"
    try:
        for number in range(2, 100):
            if not path.exists():
                break
            path = parent / f"{stamp}-{field_name}-{number}"
        path.mkdir(parents=True)
        probe = path / ".probe"
        probe.write_bytes(b"x" * 4096)
        probe.unlink()
        free = _free_bytes(path)
    except OSError as error:
        raise OperatorMistake(f"cannot write to {path}: {error.strerror} (--set recording.directory=...)") from error
    if free < _MIN_FREE_BYTES:
        path.rmdir()
        raise GroundStationError(f"only {free / 1e6:.0f} MB are free for {parent}: make room before take-off")
    return path


def _free_bytes(path: Path) -> int:
    status = os.statvfs(path)
    return status.f_bavail * status.f_frsize


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
    table = [
        ProcessSpec(
            "router",
            "router",
            entry="groundstation.runtime.router:run",
            section=json.dumps({"endpoint": endpoint}),
            stop_order=StopOrder.CONNECTS,
            hang_limit_s=1.0,
            # Drones go on by themselves after pauses below 0.5 s; no router must come back so soon.
            restart_delay_s=0.5,
            on_bus=False,
        )
    ]
    if simulation is not None:
        table.append(_sim_bridge(field, simulation))
    table.append(
        ProcessSpec(
            "tracker",
            "tracker",
            entry="groundstation.runtime.node:run",
            section=core,
            numbered=True,
            hang_limit_s=0.5,
            start_limit_s=180.0,  # kernels that are compiled for the first time, on a busy machine, need minutes
            stop_order=StopOrder.DECIDES,
        )
    )
    if field.recording.enabled:
        recorder = "groundstation.runtime.recorder:run"
        table.append(_client("recorder", recorder, core, stop_order=StopOrder.RECORDS, stop_limit_s=8.0))
    table += [_driver(section, field) for section in driver_sections(field)]
    if field.console.enabled:
        page = json.dumps(json.loads(core) | {"truth": simulation is not None})
        table.append(_client("console", "groundstation.console.process:run", page, required=False))
    if monitor:
        screen = "groundstation.runtime.monitor:run"
        table.append(_client("monitor", screen, core, on_terminal=True, stop_order=StopOrder.DECIDES))
    return tuple(table)


def _client(name: str, entry: str, section: str, **options: Any) -> ProcessSpec:
    return ProcessSpec(name, name, entry=entry, section=section, hang_limit_s=5.0, silence_limit_s=5.0, **options)


def _driver(section: DriverSection, field: Field) -> ProcessSpec:
    entry = entry_point(section.kind)
    if section.kind is DriverKind.CAMERA:
        return ProcessSpec(
            section.name, "camera", entry=entry, section=section.section, required=False, hang_limit_s=2.0
        )
    return ProcessSpec(
        section.name,
        "driver",
        entry=entry,
        section=section.section,
        required=False,
        stop_limit_s=12.0,
        last_words=_last_words(field, section),
    )


def _last_words(field: Field, section: DriverSection) -> LastWords | None:
    drone = field.drones[section.entity]
    if drone.mavlink is None:
        return _ardrone_last_words(drone.address, field.safety.land_after_s)
    if drone.mavlink.listen or drone.mavlink.serial or drone.mavlink.key_file:
        return None  # nobody but the driver can speak to it; its own time-outs act
    from drivers.mavlink.last_words import hover_and_land

    hover, land = hover_and_land(drone.mavlink.system_id)
    return LastWords(drone.address, drone.mavlink.port, hover, land, field.safety.land_after_s)


def _ardrone_last_words(address: str, land_after_s: float) -> LastWords:
    # WIRE: sequence number 1 resets the drone's count, so it obeys whoever speaks after its driver. Hovering is PCMD
    # without flags, and no REF: a start bit would lift a drone that stands.
    hover = at.encode_datagram([at.pcmd(at.Motion())], 1)
    land = at.encode_datagram([at.ref(start=False), at.pcmd(at.Motion())], 1)
    return LastWords(address, _AT_PORT, hover, land, land_after_s)


def _sim_bridge(field: Field, simulation: Simulation) -> ProcessSpec:
    network = simulation.network
    order = {
        "field": field.model_dump(mode="json"),
        "scenario": simulation.scenario,
        "addresses": {name: drone.address for name, drone in field.drones.items()},
        "streams": _streams(field, network),
        "seed": simulation.seed,
    }
    return ProcessSpec(
        "sim_bridge",
        "sim_bridge",
        command=(sys.executable, "-m", "sim_bridge", "--spec", "{spec}"),
        section=json.dumps(order),
        restart=Restart.ENDS_RUN,
        stop_order=StopOrder.EMULATES,
        hang_limit_s=5.0,
        keep_open=(network.lock,),
    )
