"""Warnings about settings that are permitted but unwise: each check yields the path and the likely consequence."""

import ipaddress
import math
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from drivers.camera.source_address import SourceKind, parse_source
from groundstation.adapters import adapters, drops_strangers
from groundstation.arrays import Array
from groundstation.geometry.rotations import world_from_downward_optical
from groundstation.settings.document import KeyPath
from groundstation.settings.files import is_there, unwritable
from groundstation.settings.in_view import STANDING_MARKER_M, in_picture
from groundstation.settings.kind_checks import cautions_of_kinds
from groundstation.settings.lens_cautions import lens_cautions
from groundstation.settings.marker_sizes import too_small
from groundstation.settings.parts import Finding
from groundstation.settings.room import WorldCameraSettings
from groundstation.settings.schema import Field
from groundstation.settings.unlikely_figures import unlikely
from groundstation.settings.volumes import anchor_cautions, volume_cautions

# The markers of drones that have taken off; half of a board.
RISEN_MARKER_M, RISEN_ROOM_M = 1.0, 0.15
PAD_TO_FENCE_M = 0.3
"""Distance of a pad from the fence that a take-off needs."""
_PAD_TO_OBSTACLE_M = 0.6
_FENCE_LEAST_M, _WALL_M = 1.0, 0.2
_LEAST_STD_M = 0.1
_LEAST_TILT_DEG = 5.0
Caution = Callable[[Field], Iterator[Finding]]
# Cosine of the angle between the optical axis and straight down beyond which a camera looks at walls.
_AT_WALLS = math.cos(math.radians(75.0))


def cautions(field: Field) -> Iterator[Finding]:
    """Yield the warnings about a field without mistakes."""
    for check in ALL:
        yield from check(field)


def _views(field: Field) -> Iterator[Finding]:
    pads = _pads(field)
    for name, camera in field.cameras.items():
        if world_from_downward_optical(camera.rotation_deg)[2, 2] > -_AT_WALLS:
            text = "lets it look at the walls or the ceiling: drones below it are not seen"
            yield ("cameras", name, "rotation_deg"), text
        if not any(in_picture(camera, centre) for centre in pads.values()):
            text = "and rotation_deg leave no pad in its view: it knows of a drone only after that has flown there"
            yield ("cameras", name, "position_m"), text


def _unseen_pads(field: Field) -> Iterator[Finding]:
    cameras = field.cameras.values()
    boxes = [one.volume_m for name, one in field.motion_capture.items() if name != field.truth.get("from")]
    boxes += [one.volume_m for one in field.ranging.values()]
    for name, pad in sorted(_pads(field).items()):
        if any(_within(box.x_m, pad[0]) and _within(box.y_m, pad[1]) for box in boxes):
            continue
        if not any(in_picture(camera, pad) for camera in cameras):
            yield ("drones", name, "pad_m"), "is in view of nothing fixed: nobody knows where it is when it takes off"
        elif not boxes and not any(_in_picture_risen(camera, field.drones[name].pad_m) for camera in cameras):
            text = f"is near the edge of the view: {RISEN_MARKER_M:g} m above it, no fixed camera sees a whole marker"
            yield ("drones", name, "pad_m"), text


def _pads(field: Field) -> dict[str, Array]:
    """Return the centre of each drone's marker as it stands on its pad (3) [m; world]."""
    return {name: np.array([*drone.pad_m, STANDING_MARKER_M]) for name, drone in field.drones.items()}


def _within(span: tuple[float, float], value: float) -> bool:
    return span[0] <= value <= span[1]


def _in_picture_risen(camera: WorldCameraSettings, pad_m: tuple[float, float]) -> bool:
    """Return whether a camera sees the whole marker of a drone that has risen from its pad."""
    corners = ((dx, dy, 0.0) for dx in (-RISEN_ROOM_M, RISEN_ROOM_M) for dy in (-RISEN_ROOM_M, RISEN_ROOM_M))
    return all(in_picture(camera, np.array([*pad_m, RISEN_MARKER_M]) + corner) for corner in corners)


def _carried_cameras(field: Field) -> Iterator[Finding]:
    for name, drone in field.drones.items():
        tilt = drone.camera.tilt_down_deg
        if tilt < _LEAST_TILT_DEG:
            path = ("drones", name, "camera", "tilt_down_deg")
            yield path, f"lets it look level or up (got {tilt:g}): markers lie flat and are seen from above only"


def _walls(field: Field) -> Iterator[Finding]:
    """Yield sides of the fence nearer than an arm's length to a wall or, at the top, to a fixed camera."""
    fence = field.room.fence
    for axis in ("x_m", "y_m"):
        (low, high), (least, most) = getattr(fence, axis), field.room.inside[axis]
        if (gap := min(low - least, most - high)) < _WALL_M:
            yield (
                ("room", "fence", axis),
                f"comes within {max(0.0, gap):.2f} m of a wall: drones stop at it within 0.1 m",
            )
    lenses = [camera.position_m[2] for camera in field.cameras.values()]
    if lenses and (gap := min(lenses) - fence.z_m[1]) < _WALL_M:
        yield ("room", "fence", "z_m"), f"comes within {max(0.0, gap):.2f} m of a fixed camera's lens"


def _fence(field: Field) -> Iterator[Finding]:
    fence = field.room.fence
    for axis, (low, high) in (("x_m", fence.x_m), ("y_m", fence.y_m), ("z_m", fence.z_m)):
        if high - low < _FENCE_LEAST_M:
            yield ("room", "fence", axis), f"leaves {high - low:.2f} m: a drone brakes within 0.3 m of each side"
    for name, drone in field.drones.items():
        (x, y), xs, ys = drone.pad_m, fence.x_m, fence.y_m
        inside = (x - xs[0], xs[1] - x, y - ys[0], ys[1] - y)
        if min(inside) < PAD_TO_FENCE_M:
            text = f"is {max(0.0, min(inside)):.2f} m from the fence: a take-off drifts farther than that"
            yield ("drones", name, "pad_m"), text


def _obstacles(field: Field) -> Iterator[Finding]:
    for name, drone in field.drones.items():
        for obstacle, one in field.room.obstacles.items():
            (x, y), (width, depth, _) = one.centre_m, one.size_m
            beside = abs(drone.pad_m[0] - x) - width / 2, abs(drone.pad_m[1] - y) - depth / 2
            apart = math.hypot(*(max(0.0, gap) for gap in beside))
            if 0.0 < apart < _PAD_TO_OBSTACLE_M:
                near = f"is {apart:.2f} m from room.obstacles.{obstacle}"
                text = f"{near}: take-offs and landings drift, keep it {_PAD_TO_OBSTACLE_M:g} m away"
                yield ("drones", name, "pad_m"), text


def _heights(field: Field) -> Iterator[Finding]:
    (lowest, _), range_m = field.planner.heights_m, field.planner.planned_range_m
    over_m = lowest - field.highest_target_m
    if over_m >= range_m:
        text = f"keep the drones {over_m:.1f} m over the target, and planned_range_m is {range_m:g}: they never see it"
        yield ("planner", "level_heights_m"), text


def _uncertainty(field: Field) -> Iterator[Finding]:
    limit = field.safety.max_position_std_m
    if limit < _LEAST_STD_M:
        text = f"is less than flights reach (0.02 to 0.1 m; got {limit:g}): drones would hover all the time"
        yield ("safety", "max_position_std_m"), text


def _addresses(field: Field) -> Iterator[Finding]:
    for name, drone in field.drones.items():
        try:
            address = ipaddress.IPv4Address(drone.address)
        except ValueError:
            continue
        if address.is_multicast or address.is_unspecified or int(address) & 0xFF == 0xFF:
            text = (
                f"is not the address of a single vehicle (got {drone.address}): commands would go to all, or to nobody"
            )
            yield ("drones", name, "address"), text


def _adapters(field: Field) -> Iterator[Finding]:
    ours = {name: drone for name, drone in field.drones.items() if not drone.host}
    known, shared = adapters(), Counter(drone.address for drone in ours.values())
    for name, drone in ours.items():
        path = ("drones", name, "interface")
        if drone.interface and drone.interface not in known:
            yield path, f"is no network adapter of this machine (got {drone.interface}); it has {', '.join(known)}"
        elif drone.interface and shared[drone.address] > 1 and drops_strangers(drone.interface):
            text = "drops what one of two vehicles with one address says (rp_filter is 1): "
            yield path, text + "sudo sysctl -w net.ipv4.conf.all.rp_filter=2"


def _places(field: Field) -> Iterator[Finding]:
    if field.recording.enabled and (why := unwritable(Path(field.recording.directory).absolute())):
        yield ("recording", "directory"), why
    sources: list[tuple[KeyPath, str]] = [
        (("cameras", name, "source"), camera.source) for name, camera in field.cameras.items() if not camera.host
    ]
    sources += [
        (("drones", name, "camera", "source"), drone.camera.source)
        for name, drone in field.drones.items()
        if not drone.host
    ]
    for path, source in sources:
        address = parse_source(source)
        if address.kind in (SourceKind.DEVICE, SourceKind.FILE) and not is_there(Path(address.path)):
            yield path, f"is not there on this machine (got {address.path})"


def _kinds(field: Field) -> Iterator[Finding]:
    yield from cautions_of_kinds(field.drones)


OF_A_FIELD: tuple[Caution, ...] = (
    _views,
    _unseen_pads,
    _carried_cameras,
    _walls,
    _fence,
    _obstacles,
    _heights,
    _uncertainty,
    lens_cautions,
    too_small,
    unlikely,
    volume_cautions,
    anchor_cautions,
    _kinds,
)
ALL: tuple[Caution, ...] = (*OF_A_FIELD, _addresses, _adapters, _places)  # of this computer as well
