"""From the field to what each process is handed: its own part, as JSON, and nothing else."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from drivers.ardrone.settings import ArDroneDriverSettings
from drivers.camera.settings import CameraDriverSettings, SourceKind, parse_source
from drivers.mavlink.settings import MavlinkDriverSettings
from groundstation.settings.drones import Drone, Mavlink, unknown_kind
from groundstation.settings.room import CalibrationSettings, WorldCameraSettings
from groundstation.settings.schema import Field

_SEARCH_RATE_HZ = 2.0


class DriverKind(StrEnum):
    """What a driver process talks to; the value is its package below `drivers`."""

    ARDRONE = "ardrone"
    MAVLINK = "mavlink"
    CAMERA = "camera"


@dataclass(frozen=True, slots=True)
class DriverSection:
    """One driver process: its name, its kind, what it drives (a drone or a camera of the field), and its section."""

    name: str
    kind: DriverKind
    entity: str
    section: str


def camera_name(drone: str) -> str:
    """Return the name on the bus of the camera that a drone carries."""
    return f"{drone}_camera"


def rerouted(field: Field, addresses: Mapping[str, str], streams: Mapping[str, tuple[str, int]]) -> Field:
    """Return the same field with other addresses of drones and other sources of cameras, by name.

    addresses: drone -> address. streams: world-fixed camera, or drone for the camera that it carries -> (address,
    port), spoken to as the field's own source is where that is an AR.Drone's video, else by HTTP. This is all that
    simulation changes. Raises KeyError for a name that is not in the field.
    """
    for name in (*addresses, *streams):
        if name not in field.drones and name not in field.cameras:
            raise KeyError(name)
    drones = {}
    for name, drone in field.drones.items():
        camera = drone.camera.model_copy(update=_source(drone.camera.source, streams.get(name)))
        drones[name] = drone.model_copy(update={"camera": camera, **_place(drone, addresses.get(name))})
    cameras = {
        name: camera.model_copy(update=_source(camera.source, streams.get(name)))
        for name, camera in field.cameras.items()
    }
    return field.model_copy(update={"drones": drones, "cameras": cameras})


def _place(drone: Drone, address: str | None) -> dict[str, Any]:
    if address is None:
        return {}
    match drone.kind:
        case "ardrone":
            return {"address": address}
        case "mavlink":
            # Vehicles that call us do so within the simulated network; there are no serial lines in it.
            way = {"local_address": address.rpartition(".")[0] + ".1", "serial": ""}
            return {"address": address, "mavlink": drone.require_mavlink().model_copy(update=way)}
        case other:
            raise unknown_kind(other)


def _source(source: str, stream: tuple[str, int] | None) -> dict[str, str]:
    if stream is None:
        return {}
    if parse_source(source).kind is SourceKind.ARDRONE:
        return {"source": f"ardrone://{stream[0]}:{stream[1]}"}
    return {"source": f"http://{stream[0]}:{stream[1]}/video.mjpg"}


def core_section(field: Field, run_dir: str, epoch: int) -> str:
    """Return what tracker, recorder and monitor are handed."""
    return json.dumps({"field": field.model_dump(mode="json"), "run_dir": run_dir, "epoch": epoch})


def driver_sections(field: Field) -> list[DriverSection]:
    """Return all driver processes of a field: vehicles, then cameras; full searches of cameras are staggered.

    Raises SettingsError for a kind of vehicle that is not known.
    """
    count = len(field.cameras) + len(field.drones)
    phases = [index / (count * _SEARCH_RATE_HZ) for index in range(count)]
    fixed = [
        DriverSection(name, DriverKind.CAMERA, name, _world_camera(field, name, camera, phase).model_dump_json())
        for (name, camera), phase in zip(field.cameras.items(), phases, strict=False)
    ]
    carried = [
        DriverSection(
            camera_name(name), DriverKind.CAMERA, name, _onboard_camera(field, name, drone, phase).model_dump_json()
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
                alone.append(DriverSection(name, DriverKind.ARDRONE, name, settings))
            case "mavlink":
                mavlink = drone.require_mavlink()
                links.setdefault(mavlink.port if mavlink.listen else name, []).append(name)
            case other:
                raise unknown_kind(other)
    return alone + [
        DriverSection(names[0], DriverKind.MAVLINK, names[0], _mavlink(field, names).model_dump_json())
        for names in links.values()
    ]


def _ardrone(field: Field, name: str, index: int) -> ArDroneDriverSettings:
    drone = field.drones[name]
    return ArDroneDriverSettings.model_validate(
        {
            "name": name,
            "address": drone.address,
            "limits": drone.limits.model_dump(),
            "odometry": drone.odometry.model_dump(include={"velocity_scale", "velocity_std_m_s"}),
            "safety": field.safety.model_dump(include={"setpoint_lifetime_ms", "land_after_s", "unseen_land_after_s"}),
            # WIRE: neighbours must not hear each other's ultrasound: 22.22 Hz (7) and 25 Hz (8) in turn.
            "flight": {"altitude_max_m": max(0.5, field.room.fence.z_m[1]), "ultrasound_freq": 7 + index % 2},
            "video": None if drone.video is None else drone.video.model_dump(),
            "raw_datagrams": field.recording.enabled and field.recording.raw_datagrams,
        }
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
    return MavlinkDriverSettings.model_validate(
        {
            "link": {
                "kind": mavlink.link,
                "target": _target(first, mavlink),
                "key_file": mavlink.key_file,
            },
            "vehicles": [_mavlink_vehicle(name, field.drones[name]) for name in names],
            "safety": field.safety.model_dump(include={"setpoint_lifetime_ms", "land_after_s", "unseen_land_after_s"}),
            "vision": {"rate_hz": mavlink.vision_hz},
            "raw_datagrams": field.recording.enabled and field.recording.raw_datagrams,
        }
    )


def _mavlink_vehicle(name: str, drone: Drone) -> dict[str, Any]:
    mavlink = drone.require_mavlink()
    return {
        "name": name,
        "system_id": mavlink.system_id,
        "flavour": mavlink.flavour,
        "pad_m": drone.pad_m,
        "pad_yaw_rad": drone.pad_yaw_rad,
        "limits": drone.limits.model_dump(exclude={"max_tilt_deg"}),
        "take_off_m": mavlink.take_off_m,
        "velocity_std_m_s": drone.odometry.velocity_std_m_s,
    }


def _world_camera(field: Field, name: str, camera: WorldCameraSettings, phase_s: float) -> CameraDriverSettings:
    mount = {
        "parent": "world",
        "position_m": camera.position_m,
        "looking": camera.looking,
        "rotation_deg": camera.rotation_deg,
    }
    robots = list(field.drones) if "robots" in camera.observes else []
    targets = list(field.tracked) if "targets" in camera.observes else []
    common = _camera(field, camera.source, camera.calibration, camera.video_delay_ms, phase_s)
    return CameraDriverSettings.model_validate({"name": name, "mount": mount, "observes": robots + targets, **common})


def _onboard_camera(field: Field, name: str, drone: Drone, phase_s: float) -> CameraDriverSettings:
    camera = drone.camera
    mount = {
        "parent": name,
        "position_m": camera.position_m,
        "tilt_down_deg": camera.tilt_down_deg,
        "pan_deg": camera.pan_left_deg,
    }
    common = _camera(field, camera.source, camera.calibration, camera.video_delay_ms, phase_s)
    return CameraDriverSettings.model_validate({"name": camera_name(name), "mount": mount, **common})


def _camera(field: Field, source: str, lens: CalibrationSettings, delay_ms: float, phase_s: float) -> dict[str, Any]:
    calibration = lens.model_dump(mode="json", exclude_none=True, exclude={"views", "std"})
    return {
        "source": source,
        "calibration": calibration,
        "video_delay_ms": delay_ms,
        "markers": _markers(field),
        "image_fps": field.recording.image_fps,
        "search_rate_hz": _SEARCH_RATE_HZ,
        "search_phase_s": phase_s,
    }


def _markers(field: Field) -> list[dict[str, Any]]:
    robots = [
        {"entity": name, "kind": "robot", "position_m": drone.marker.position_m, **drone.marker.printed}
        for name, drone in field.drones.items()
    ]
    targets = [
        {"entity": name, "kind": "target", "position_m": target.marker.position_m, **target.marker.printed}
        for name, target in field.tracked.items()
    ]
    return robots + targets
