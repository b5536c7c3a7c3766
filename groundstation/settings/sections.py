"""From the field to what each process is handed: its own part, as JSON, and nothing else."""

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import StrEnum

from drivers.ardrone.settings import (
    ArDroneDriverSettings,
    ArDroneLimits,
    FlightConfiguration,
    VelocityScale,
    Video,
)
from drivers.camera.settings import SourceKind, parse_source
from drivers.mavlink.settings import LinkSettings, MavlinkDriverSettings, VehicleSettings, VisionFeedback
from drivers.vehicle_settings import SilenceLimits, VehicleLimits
from groundstation.field.drones import camera_name
from groundstation.settings.behaviour import SafetySettings
from groundstation.settings.camera_sections import SEARCH_RATE_HZ, onboard_camera, world_camera
from groundstation.settings.drones import Drone, Mavlink, unknown_kind
from groundstation.settings.schema import Field


class DriverKind(StrEnum):
    """What a driver process talks to; the value is its package below `drivers`."""

    ARDRONE = "ardrone"
    MAVLINK = "mavlink"
    CAMERA = "camera"


@dataclass(frozen=True, slots=True)
class DriverSection:
    """One driver process: its name, its kind, what it drives (a drone or a camera of the field), and its section.

    entities: all that it speaks of.
    """

    name: str
    kind: DriverKind
    entity: str
    section: str
    entities: tuple[str, ...]


def rerouted(
    field: Field,
    addresses: Mapping[str, str],
    streams: Mapping[str, tuple[str, int]],
    streams_only: Collection[str] = (),
) -> Field:
    """Return the same field with other addresses of drones and other sources of cameras, by name.

    addresses: drone -> address. streams: world-fixed camera, or drone for the camera that it carries -> (address,
    port), spoken to as the field's own source is where that is an AR.Drone's video, else by HTTP. This, and that a
    drone may have any serial number, is all that simulation changes. streams_only: drones whose cameras are never their
    own video. Raises KeyError for a name that is not in the field.
    """
    for name in (*addresses, *streams):
        if name not in field.drones and name not in field.cameras:
            raise KeyError(name)
    drones = {
        name: _moved(_with_source(drone, streams.get(name), name in streams_only), addresses.get(name))
        for name, drone in field.drones.items()
    }
    cameras = {
        name: camera.model_copy(update={"source": _source(camera.source, streams.get(name))})
        for name, camera in field.cameras.items()
    }
    return field.model_copy(update={"drones": drones, "cameras": cameras})


def _with_source(drone: Drone, stream: tuple[str, int] | None, plain: bool) -> Drone:
    camera = drone.camera.model_copy(update={"source": _source(drone.camera.source, stream, plain)})
    return drone.model_copy(update={"camera": camera})


def _moved(drone: Drone, address: str | None) -> Drone:
    if address is None:
        return drone
    moved = drone.model_copy(update={"address": address, "serial_number": ""})  # an emulator has its own
    match drone.kind:
        case "ardrone":
            return moved
        case "mavlink":
            # Vehicles that call us do so within the simulated network; there are no serial lines in it.
            way = {"local_address": address.rpartition(".")[0] + ".1", "serial": ""}
            return moved.model_copy(update={"mavlink": drone.require_mavlink().model_copy(update=way)})
        case other:
            raise unknown_kind(other)


def _source(source: str, stream: tuple[str, int] | None, plain: bool = False) -> str:
    if stream is None:
        return source
    if parse_source(source).kind is SourceKind.ARDRONE and not plain:
        return f"ardrone://{stream[0]}:{stream[1]}"
    return f"http://{stream[0]}:{stream[1]}/video.mjpg"


def core_section(field: Field, run_dir: str, epoch: int) -> str:
    """Return what tracker, recorder and monitor are handed."""
    return json.dumps({"field": field.model_dump(mode="json"), "run_dir": run_dir, "epoch": epoch})


def driver_sections(field: Field) -> list[DriverSection]:
    """Return all driver processes of a field: vehicles, then cameras; full searches of cameras are staggered.

    Raises SettingsError for a kind of vehicle that is not known.
    """
    count = len(field.cameras) + len(field.drones)
    phases = [index / (count * SEARCH_RATE_HZ) for index in range(count)]
    fixed = [
        DriverSection(
            name, DriverKind.CAMERA, name, world_camera(field, name, camera, phase).model_dump_json(), (name,)
        )
        for (name, camera), phase in zip(field.cameras.items(), phases, strict=False)
    ]
    carried = [
        DriverSection(
            camera_name(name),
            DriverKind.CAMERA,
            name,
            onboard_camera(field, name, drone, phase).model_dump_json(),
            (name, camera_name(name)),
        )
        for (name, drone), phase in zip(field.drones.items(), phases[len(fixed) :], strict=True)
    ]
    return _vehicles(field) + fixed + carried


def _vehicles(field: Field) -> list[DriverSection]:
    alone: list[DriverSection] = []
    links: dict[object, list[str]] = {}  # MAVLink vehicles by driver process: those that call the same port share one
    for index, (name, drone) in enumerate(field.drones.items()):
        match drone.kind:
            case "ardrone":
                settings = _ardrone(field, name, index).model_dump_json()
                alone.append(DriverSection(name, DriverKind.ARDRONE, name, settings, (name,)))
            case "mavlink":
                mavlink = drone.require_mavlink()
                links.setdefault(mavlink.port if mavlink.listen else name, []).append(name)
            case other:
                raise unknown_kind(other)
    return alone + [
        DriverSection(names[0], DriverKind.MAVLINK, names[0], _mavlink(field, names).model_dump_json(), tuple(names))
        for names in links.values()
    ]


def _ardrone(field: Field, name: str, index: int) -> ArDroneDriverSettings:
    drone = field.drones[name]
    limits, video = drone.limits, drone.video
    return ArDroneDriverSettings(
        name=name,
        address=drone.address,
        serial_number=drone.serial_number,
        limits=ArDroneLimits(
            max_speed_m_s=limits.max_speed_m_s,
            max_climb_m_s=limits.max_climb_m_s,
            max_yaw_rate_deg_s=limits.max_yaw_rate_deg_s,
            max_tilt_deg=limits.max_tilt_deg,
            battery_min=limits.battery_min,
            battery_hold_s=limits.battery_hold_s,
        ),
        odometry=VelocityScale(
            velocity_scale=drone.odometry.velocity_scale, velocity_std_m_s=drone.odometry.velocity_std_m_s
        ),
        safety=_silence(field.safety),
        pad_m=drone.pad_m,
        # WIRE: neighbours must not hear each other's ultrasound: 22.22 Hz (7) and 25 Hz (8) in turn.
        flight=FlightConfiguration(
            altitude_max_m=max(0.5, field.room.fence.z_m[1]), ultrasound_freq=8 if index % 2 else 7
        ),
        video=None if video is None else Video(codec=video.codec, channel=video.channel, bitrate=video.bitrate),
        raw_datagrams=field.recording.enabled and field.recording.raw_datagrams,
    )


def _silence(safety: SafetySettings) -> SilenceLimits:
    return SilenceLimits(
        setpoint_lifetime_ms=safety.setpoint_lifetime_ms,
        land_after_s=safety.land_after_s,
        unseen_land_after_s=safety.unseen_land_after_s,
        min_separation_m=safety.min_separation_m,
    )


def _target(drone: Drone, mavlink: Mavlink) -> str:
    if mavlink.serial:
        return f"serial:{mavlink.serial}"
    if mavlink.listen:
        return f"udpin:{mavlink.local_address}:{mavlink.port}"
    return f"udpout:{drone.address}:{mavlink.port}"


def _mavlink(field: Field, names: list[str]) -> MavlinkDriverSettings:
    first = field.drones[names[0]]
    mavlink = first.require_mavlink()
    return MavlinkDriverSettings(
        link=LinkSettings(kind=mavlink.link, target=_target(first, mavlink), key_file=mavlink.key_file),
        vehicles=tuple(_mavlink_vehicle(name, field.drones[name]) for name in names),
        safety=_silence(field.safety),
        vision=VisionFeedback(rate_hz=mavlink.vision_hz),
        raw_datagrams=field.recording.enabled and field.recording.raw_datagrams,
    )


def _mavlink_vehicle(name: str, drone: Drone) -> VehicleSettings:
    mavlink, limits = drone.require_mavlink(), drone.limits
    return VehicleSettings(
        name=name,
        system_id=mavlink.system_id,
        flavour=mavlink.flavour,
        serial_number=drone.serial_number,
        pad_m=drone.pad_m,
        pad_yaw_rad=drone.pad_yaw_rad,
        limits=VehicleLimits(
            max_speed_m_s=limits.max_speed_m_s,
            max_climb_m_s=limits.max_climb_m_s,
            max_yaw_rate_deg_s=limits.max_yaw_rate_deg_s,
            battery_min=limits.battery_min,
            battery_hold_s=limits.battery_hold_s,
        ),
        take_off_m=mavlink.take_off_m,
        parameters=mavlink.parameters,
        forward=mavlink.forward,
        forward_allows=mavlink.forward_allows,
        velocity_std_m_s=drone.odometry.velocity_std_m_s,
        attitude_std_rad=drone.odometry.attitude_std_rad,
    )
