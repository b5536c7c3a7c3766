"""Makes each process's section from the field: its own part, as JSON, and nothing else."""

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from pydantic import BaseModel

from drivers.camera.settings import SEARCH_RATE_HZ
from drivers.camera.source_address import parse_source
from drivers.motion_capture.settings import emulated_source
from drivers.ranging.settings import emulated_source as emulated_gateway
from groundstation.errors import SettingsError
from groundstation.field.drones import camera_name
from groundstation.field.targets import odometry_name
from groundstation.settings.camera_sections import onboard_camera, world_camera
from groundstation.settings.capture_sections import capture_section
from groundstation.settings.drones import Drone
from groundstation.settings.motion_capture import MotionCaptureSettings
from groundstation.settings.odometry_sections import odometry_section, with_emulated_odometry
from groundstation.settings.parts import Finding
from groundstation.settings.ranging_sections import ranging_section
from groundstation.settings.resolved import resolved_field
from groundstation.settings.schema import Field
from groundstation.vehicles import VehicleOrder, kind_named
from groundstation.vehicles.answers import processes_of, stop_of
from groundstation.vehicles.registry import ask

# Kinds of driver processes other than kinds of vehicles.
CAMERA, MOTION_CAPTURE, RANGING, ODOMETRY = "camera", "motion_capture", "ranging", "odometry"


@dataclass(frozen=True, slots=True)
class DriverSection:
    """One driver process: its name, its kind, the drone or sensor that it drives, and its section.

    entities: all entities of its messages. host: the other host that it runs on, "" for the run's own.
    """

    name: str
    kind: str
    entity: str
    section: str
    entities: tuple[str, ...]
    host: str = ""


def rerouted(
    field: Field,
    addresses: Mapping[str, str],
    streams: Mapping[str, tuple[str, int]],
    streams_only: Collection[str] = (),
    captures: Mapping[str, tuple[str, int]] = MappingProxyType({}),
) -> Field:
    """Return the same field with other addresses of drones and other sources of sensors, by name.

    addresses: drone -> address.
    streams: world-fixed camera, or drone for the camera that it carries -> (address, port). A camera whose source is
    the vehicle's own video keeps that protocol; all others are read by HTTP.
    captures: motion capture or ranging system, or odometry of a target -> (address, port). The protocol is NatNet, that
    of a gateway of ranges, or that of a router of ROS 2 if the source in the field is one.
    These addresses, and that a drone may have any serial number, are all that simulation changes.
    streams_only: drones whose cameras are never their own video. Raises KeyError for a name that is not in the field.
    """
    heard = [*map(odometry_name, field.tracked)]
    for name in (*addresses, *streams, *captures):
        if name not in {*field.drones, *field.cameras, *field.motion_capture, *field.ranging, *heard}:
            raise KeyError(name)
    drones = {
        name: _moved(_with_source(drone, streams.get(name), name in streams_only), addresses.get(name))
        for name, drone in field.drones.items()
    }
    cameras = {
        name: camera.model_copy(update={"source": _source(camera.source, streams.get(name))})
        for name, camera in field.cameras.items()
    }
    systems = {name: _emulated(one, captures.get(name)) for name, one in field.motion_capture.items()}
    ranging = {
        name: one.model_copy(update={"source": emulated_gateway(*captures[name])}) if name in captures else one
        for name, one in field.ranging.items()
    }
    update = {"drones": drones, "cameras": cameras, "motion_capture": systems, "ranging": ranging}
    return with_emulated_odometry(field.model_copy(update=update), captures)


def _emulated(system: MotionCaptureSettings, place: tuple[str, int] | None) -> MotionCaptureSettings:
    if place is None:
        return system
    return system.model_copy(update={"source": emulated_source(system.source, *place)})


def _with_source(drone: Drone, stream: tuple[str, int] | None, plain: bool) -> Drone:
    camera = drone.camera.model_copy(
        update={"source": _source(drone.camera.source, stream, "" if plain else kind_named(drone.kind).camera)}
    )
    return drone.model_copy(update={"camera": camera})


def _moved(drone: Drone, address: str | None) -> Drone:
    if address is None:
        return drone
    sections = ask(kind_named(drone.kind), "moved", address.rpartition(".")[0] + ".1", drone.sections)
    update: dict[str, object] = {"address": address, "interface": "", "serial_number": ""}  # an emulator has its own
    for key, section in drone.sections.items():
        update[key] = section.model_copy(update=sections.get(key, {}))
    return drone.model_copy(update=update)


def _source(source: str, stream: tuple[str, int] | None, own: str = "") -> str:
    if stream is None:
        return source
    if own and parse_source(source).vehicle == own:
        return f"{own}://{stream[0]}:{stream[1]}"
    return f"http://{stream[0]}:{stream[1]}/video.mjpg"


def core_section(field: Field, run_dir: str, epoch: int) -> str:
    """Return the section of tracker, recorder and monitor."""
    return json.dumps({"field": field.model_dump(mode="json"), "run_dir": run_dir, "epoch": epoch})


def driver_sections(field: Field) -> list[DriverSection]:
    """Return all driver processes of a field: vehicles, then sensors; full searches of cameras are staggered.

    Raises SettingsError for a kind of vehicle that is not known.
    """
    count = len(field.cameras) + len(field.drones)
    phases = [index / (count * SEARCH_RATE_HZ) for index in range(count)]
    sensors = [
        DriverSection(name, CAMERA, name, _text(world_camera(field, name, camera, phase)), (name,), camera.host)
        for (name, camera), phase in zip(field.cameras.items(), phases, strict=False)
    ]
    sensors += [
        DriverSection(name, MOTION_CAPTURE, name, _text(capture_section(field, name)), (name,), system.host)
        for name, system in field.motion_capture.items()
    ]
    sensors += [
        DriverSection(name, RANGING, name, _text(ranging_section(field, name)), (name,), system.host)
        for name, system in field.ranging.items()
    ]
    return _vehicles(field) + sensors + _odometry(field) + _carried(field, phases[len(field.cameras) :])


def _odometry(field: Field) -> list[DriverSection]:
    reporting = [(name, target, target.odometry) for name, target in field.tracked.items() if target.odometry]
    return [
        DriverSection(own, ODOMETRY, name, _text(odometry_section(name, target, odometry)), (name, own))
        for name, target, odometry in reporting
        for own in (odometry_name(name),)
    ]


def _carried(field: Field, phases: Sequence[float]) -> list[DriverSection]:
    return [
        DriverSection(own, CAMERA, name, _text(onboard_camera(field, name, drone, phase)), (name, own), drone.host)
        for (name, drone), phase in zip(field.drones.items(), phases, strict=True)
        for own in (camera_name(name),)
    ]


def _text(section: BaseModel) -> str:
    return section.model_dump_json()


def vehicle_order(field: Field, name: str) -> VehicleOrder:
    """Return a drone's order for its kind."""
    values = resolved_field(field)
    return VehicleOrder(
        name,
        list(field.drones).index(name),
        values.drones[name],
        values.safety,
        field.room.fence.z_m[1],
        field.recording.enabled and field.recording.raw_datagrams,
        field.drones[name].sections,
        values.room.fence,
    )


def faults_of_kinds(field: Field) -> Iterator[Finding]:
    """Yield why a kind cannot make its driver processes, or their stop datagrams, at one of its vehicles."""
    for (kind, _), group in _teams(field).items():
        orders = {order.name: order for order in group}
        try:
            for process in processes_of(kind_named(kind), group):
                stop_of(kind_named(kind), [orders[name] for name in process.vehicles])
        except SettingsError as error:
            yield from ((("drones", group[0].name, "kind"), one.removeprefix("kind: ")) for one in error.problems)


def _teams(field: Field) -> dict[tuple[str, str], list[VehicleOrder]]:
    """Return the orders of all vehicles by kind and host."""
    orders: dict[tuple[str, str], list[VehicleOrder]] = {}
    for name, drone in field.drones.items():
        orders.setdefault((drone.kind, drone.host), []).append(vehicle_order(field, name))
    return orders


def _vehicles(field: Field) -> list[DriverSection]:
    return [
        DriverSection(process.vehicles[0], kind, process.vehicles[0], process.section, process.vehicles, host)
        for (kind, host), group in _teams(field).items()
        for process in processes_of(kind_named(kind), group)
    ]
