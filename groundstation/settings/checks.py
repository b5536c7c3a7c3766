"""What must hold between settings: each check yields the path at fault and what is wrong with it."""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from itertools import combinations

from drivers.camera.settings import parse_source
from groundstation.errors import without_password
from groundstation.field.room import ranging_link
from groundstation.settings.adapter_checks import findings_of_adapters
from groundstation.settings.behaviour import Bus, EstimatorSettings, PlannerSettings, SafetySettings
from groundstation.settings.document import KeyPath
from groundstation.settings.drones import Drone
from groundstation.settings.host_checks import findings_of_hosts
from groundstation.settings.kind_checks import findings_of_kinds
from groundstation.settings.marker import MarkerSettings
from groundstation.settings.motion_capture import MotionCaptureSettings
from groundstation.settings.ranging import RangingSettings
from groundstation.settings.ranging_checks import findings_of_ranging
from groundstation.settings.room import CalibrationSettings, RoomSettings, WorldCameraSettings
from groundstation.settings.target import OneOfTargets, TargetSettings, TrackedBody
from groundstation.vehicles import kind_named

Finding = tuple[KeyPath, str]

# Names of processes and of scopes on the bus: an entity of the same name would be taken for them. So would one that
# starts with sim_ (the simulator) or ends with _camera (the driver of the camera that a drone carries).
RESERVED = frozenset(
    {"team", "operator", "router", "tracker", "diagnosis", "recorder", "console", "monitor", "supervisor"}
)
_ROBOT_HEIGHT_M = 0.3
# What the bus takes, and what the ground station itself adds to a name: _camera of a drone, _odometry of a target.
_LONGEST_NAME, _ADDED = 48, {"drones": 7, "target": 9, "targets": 9}


@dataclass(frozen=True, slots=True)
class Parts:
    """The sections that are sound in themselves; a check is left out where one that it needs is missing.

    truth: the sensor that judges; given: the names of all that is fixed in the world, also where its entry is faulty.
    """

    room: RoomSettings | None = None
    cameras: dict[str, WorldCameraSettings] = field(default_factory=dict)
    motion_capture: dict[str, MotionCaptureSettings] = field(default_factory=dict)
    ranging: dict[str, RangingSettings] = field(default_factory=dict)
    truth: str | None = None
    given: frozenset[str] = frozenset()
    drones: dict[str, Drone] = field(default_factory=dict)
    target: TargetSettings | None = None
    targets: dict[str, OneOfTargets] = field(default_factory=dict)
    estimator: EstimatorSettings | None = None
    planner: PlannerSettings | None = None
    safety: SafetySettings | None = None
    bus: Bus | None = None

    @property
    def tracked(self) -> dict[KeyPath, tuple[str, TrackedBody]]:
        """Return name and settings of each target by its path in the file."""
        several: dict[KeyPath, tuple[str, TrackedBody]] = {("targets", n): (n, one) for n, one in self.targets.items()}
        return several if self.target is None else {("target",): (self.target.name, self.target), **several}

    @property
    def flying(self) -> dict[str, Drone]:
        """Return the drones that are enabled."""
        return {name: drone for name, drone in self.drones.items() if drone.enabled}


def findings(parts: Parts) -> Iterator[Finding]:
    """Return everything that is wrong between the given sections."""
    for check in _CHECKS:
        yield from check(parts)


def _fence_in_room(parts: Parts) -> Iterator[Finding]:
    if parts.room is None:
        return
    size, fence = parts.room.size_m, parts.room.fence
    walls = {"x_m": (-size[0] / 2, size[0] / 2), "y_m": (-size[1] / 2, size[1] / 2), "z_m": (0.0, size[2])}
    for name, (low, high) in walls.items():
        least, most = getattr(fence, name)
        if least < low or most > high:
            yield ("room", "fence", name), f"must lie inside the room, {low:g} to {high:g} (got {least:g} to {most:g})"


def _obstacles(parts: Parts) -> Iterator[Finding]:
    if parts.room is None:
        return
    size = parts.room.size_m
    for name, one in parts.room.obstacles.items():
        path = ("room", "obstacles", name)
        (x, y), half = one.centre_m, (one.size_m[0] / 2, one.size_m[1] / 2)
        if abs(x) + half[0] > size[0] / 2 or abs(y) + half[1] > size[1] / 2 or one.size_m[2] > size[2]:
            yield path, "must stand inside the room"
        for drone, own in parts.flying.items():
            if abs(own.pad_m[0] - x) < half[0] and abs(own.pad_m[1] - y) < half[1]:
                yield ("drones", drone, "pad_m"), f"lies in room.obstacles.{name}"


def _cameras_above_fence(parts: Parts) -> Iterator[Finding]:
    if parts.room is None:
        return
    size, top = parts.room.size_m, parts.room.fence.z_m[1]
    for name, camera in parts.cameras.items():
        x, y, z = camera.position_m
        path = ("cameras", name, "position_m")
        if abs(x) > size[0] / 2 or abs(y) > size[1] / 2 or z > size[2]:
            yield path, "must lie inside the room"
        elif z <= top:
            yield path, f"must hang above the fence: height > {top:g} (got {z:g})"


def _team(parts: Parts) -> Iterator[Finding]:
    if parts.drones and not parts.flying:
        yield ("drones",), "at least one drone must be enabled"


def _root(parts: Parts) -> Iterator[Finding]:
    """Every sensing topology starts from what is fixed in the world."""
    if parts.truth is not None and (parts.truth not in parts.given or parts.truth in {*parts.cameras, *parts.ranging}):
        known = ", ".join(parts.motion_capture) or "there is none"
        yield ("truth", "from"), f"must name a motion capture system of the field: {known} (got {parts.truth})"
    if not parts.given - {parts.truth}:
        yield (
            ("cameras",),
            ("one camera at least, or a motion capture system that is not the truth, or ranging, must be given"),
        )


def _captured(parts: Parts) -> Iterator[Finding]:
    known = {*parts.drones, *(name for name, _ in parts.tracked.values())}
    for name, system in parts.motion_capture.items():
        bodies: KeyPath = ("motion_capture", name, "bodies")
        yield from (((*bodies, n), f"{n} is no drone or target of the field") for n in sorted({*system.bodies} - known))
        as_they_are = {*parts.flying, *(target for target, _ in parts.tracked.values())} - system.bodies.keys()
        called: list[tuple[KeyPath, object, str]] = [(bodies, n, n) for n in sorted(as_they_are)]
        called += [((*bodies, n), body.name or n, n) for n, body in system.bodies.items()]
        yield from _unique(called, "the body's name")


def _ranged(parts: Parts) -> Iterator[Finding]:
    yield from findings_of_ranging(parts.ranging, parts.drones, parts.flying, parts.room)


def _pads(parts: Parts) -> Iterator[Finding]:
    if parts.room is not None:
        for name, drone in parts.flying.items():
            if not parts.room.fence.contains(*drone.pad_m):
                yield ("drones", name, "pad_m"), f"must lie inside the fence (got {list(drone.pad_m)})"
    if parts.safety is None:
        return
    least = parts.safety.min_separation_m
    for (first, one), (second, other) in combinations(parts.flying.items(), 2):
        distance = math.dist(one.pad_m, other.pad_m)
        if distance < least:
            yield (
                ("drones", second, "pad_m"),
                f"is {distance:.2f} m from the pad of {first}: must be >= {least:g} (safety.min_separation_m)",
            )


def _unique(values: Iterable[tuple[KeyPath, object, str]], what: str) -> Iterator[Finding]:
    holders: dict[object, str] = {}
    for path, value, holder in values:
        if value in holders:
            yield path, f"{what} {value} is already that of {holders[value]}"
        else:
            holders[value] = holder


def _key_of(marker: MarkerSettings) -> str:
    return "code" if marker.kind == "checkerboard" else "id"


def _distinct(parts: Parts) -> Iterator[Finding]:
    codes: list[tuple[KeyPath, object, str]] = [
        (("drones", name, "marker", _key_of(drone.marker)), drone.marker.identity, name)
        for name, drone in parts.drones.items()
    ]
    sources: list[tuple[KeyPath, object, str]] = [
        (("cameras", name, "source"), _placed(camera.source, camera.host), name)
        for name, camera in parts.cameras.items()
    ]
    for path, (name, target) in parts.tracked.items():
        codes.append(((*path, "marker", _key_of(target.marker)), target.marker.identity, name))
    sources += [
        (("drones", name, "camera", "source"), _placed(drone.video_source, drone.host), name)
        for name, drone in parts.drones.items()
    ]
    yield from _unique(codes, "marker code")
    yield from _unique(sources, "camera source")


def _placed(source: str, host: str) -> str:
    """Return a source as the operator may read it; each host has its own devices and networks."""
    return without_password(source) + (f" on {host}" if host else "")


def _kinds(parts: Parts) -> Iterator[Finding]:
    yield from findings_of_adapters(parts.drones)
    yield from findings_of_kinds(parts.drones)


def _hosts(parts: Parts) -> Iterator[Finding]:
    yield from findings_of_hosts(
        parts.drones, parts.cameras, {"motion_capture": parts.motion_capture, "ranging": parts.ranging}, parts.bus
    )


def _own_video(parts: Parts) -> Iterator[Finding]:
    """A vehicle's video is taken from that very vehicle."""
    for name, camera in parts.cameras.items():
        if parse_source(camera.source).vehicle:
            yield ("cameras", name, "source"), "must not be a vehicle's own video: drones carry their cameras"
    for name, drone in parts.drones.items():
        source, path = parse_source(drone.camera.source), ("drones", name, "camera", "source")
        if not source.vehicle:
            continue
        if kind_named(drone.kind).camera != source.vehicle:
            yield path, f"must not be another kind's own video ({source.vehicle}://) for kind: {drone.kind}"
        elif source.host != drone.address:
            got = without_password(drone.camera.source)
            yield path, f"must be this drone's own address, {source.vehicle}://{drone.address} (got {got})"


def _names(parts: Parts) -> Iterator[Finding]:
    named: list[tuple[KeyPath, str]] = [(("drones", name), name) for name in parts.drones]
    named += [(("cameras", name), name) for name in parts.cameras]
    named += [(("motion_capture", name), name) for name in parts.motion_capture]
    for name, system in parts.ranging.items():
        named.append((("ranging", name), name))
        named += [
            (("ranging", name, "anchors", one), ranging_link(name, one, drone))
            for one in system.anchors
            for drone in parts.drones
        ]
    if parts.target is not None:
        named.append((("target", "name"), parts.target.name))
    named += [(("targets", name), name) for name in parts.targets]
    for path, name in named:
        if name in RESERVED or name.startswith("sim_") or name.endswith(("_camera", "_odometry")):
            yield path, f"the name {name} is taken by the ground station itself"
        elif len(name) > (most := _LONGEST_NAME - _ADDED.get(str(path[0]), 0)):
            yield path, f"the name {name} has {len(name)} letters: {most} at most"
    yield from _unique(((path, name, _kind_of(path)) for path, name in named), "the name")


def _kind_of(path: KeyPath) -> str:
    """Return what kind of thing a path of the field file names."""
    kinds = {"drones": "a drone", "cameras": "a camera", "targets": "a target"}
    return (kinds | {"motion_capture": "a motion capture system", "ranging": "a ranging system"}).get(
        str(path[0]), "the target"
    )


def _heights(parts: Parts) -> Iterator[Finding]:
    if parts.planner is None:
        return
    rows = parts.planner.level_heights_m
    if parts.flying and len(rows) < len(parts.flying):
        yield (
            ("planner", "level_heights_m"),
            f"must hold a row for each number of levels, 1 to {len(parts.flying)} drones (got {len(rows)})",
        )
    low = max((one.marker.height_m + _ROBOT_HEIGHT_M for _, one in parts.tracked.values()), default=0.0)
    high = math.inf
    if parts.room is not None:
        low, high = max(low, parts.room.fence.z_m[0]), parts.room.fence.z_m[1]
    for index, row in enumerate(rows):
        for slot, height in enumerate(row):
            if not low <= height <= high:
                path = ("planner", "level_heights_m", index, slot)
                yield path, f"must be between {low:g} (over the target) and {high:g} (the fence) (got {height:g})"


def _rates_and_times(parts: Parts) -> Iterator[Finding]:
    planner, safety, estimator = parts.planner, parts.safety, parts.estimator
    if planner and estimator and planner.rate_hz > estimator.rate_hz:
        yield ("planner", "rate_hz"), f"must be <= {estimator.rate_hz} (estimator.rate_hz) (got {planner.rate_hz})"
    if planner and safety and planner.separation_m < safety.min_separation_m:
        yield (
            ("planner", "separation_m"),
            f"must be >= {safety.min_separation_m:g} (safety.min_separation_m) (got {planner.separation_m:g})",
        )
    if safety and safety.setpoint_lifetime_ms >= safety.land_after_s * 1000:
        yield ("safety", "land_after_s"), f"must be > {safety.setpoint_lifetime_ms / 1000:g} (the setpoint's lifetime)"


def _calibrations(parts: Parts) -> Iterator[Finding]:
    held: list[tuple[KeyPath, CalibrationSettings]] = [
        (("cameras", name, "calibration"), camera.calibration) for name, camera in parts.cameras.items()
    ]
    held += [(("drones", name, "camera", "calibration"), d.camera.calibration) for name, d in parts.drones.items()]
    for path, lens in held:
        for name, value, size in (("cx_px", lens.cx_px, lens.width_px), ("cy_px", lens.cy_px, lens.height_px)):
            if not 0.25 * size <= value <= 0.75 * size:
                yield (*path, name), f"must lie near the middle of the picture, {size} wide or high (got {value:g})"
        if not 0.8 <= lens.fx_px / lens.fy_px <= 1.25:
            yield (*path, "fy_px"), f"must be close to fx_px = {lens.fx_px:g}: pixels are square (got {lens.fy_px:g})"


_CHECKS: tuple[Callable[[Parts], Iterator[Finding]], ...] = (
    _fence_in_room,
    _obstacles,
    _cameras_above_fence,
    _root,
    _captured,
    _ranged,
    _team,
    _pads,
    _distinct,
    _kinds,
    _hosts,
    _own_video,
    _names,
    _heights,
    _rates_and_times,
    _calibrations,
)
