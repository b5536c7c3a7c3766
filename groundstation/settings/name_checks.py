"""Checks of names and of other identifiers: markers, bodies, sources of pictures."""

from collections.abc import Iterable, Iterator

from groundstation.errors import without_password
from groundstation.field.room import ranging_link
from groundstation.settings.document import KeyPath
from groundstation.settings.marker import MarkerSettings
from groundstation.settings.parts import Finding, Parts

# Names of processes and of scopes on the bus: an entity of the same name would be taken for them. So would one that
# starts with sim_ (the simulator) or ends with _camera (the driver of the camera that a drone carries).
_RESERVED = frozenset(
    {"team", "operator", "run", "router", "tracker", "diagnosis", "recorder", "console", "monitor", "supervisor"}
)
# Longest name on the bus, and suffixes that the ground station adds: _camera of a drone, _odometry of a target.
_LONGEST_NAME, _ADDED = 48, {"drones": 7, "target": 9, "targets": 9}


def findings_of_names(parts: Parts) -> Iterator[Finding]:
    """Return names that are taken or too long, and identifiers that two entities share."""
    for check in (_names, _distinct, _captured):
        yield from check(parts)


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
        if name in _RESERVED or name.startswith("sim_") or name.endswith(("_camera", "_odometry")):
            yield path, f"the name {name} is taken by the ground station itself"
        elif len(name) > (most := _LONGEST_NAME - _ADDED.get(str(path[0]), 0)):
            yield path, f"the name {name} has {len(name)} letters: {most} at most"
    yield from _unique(((path, name, _kind_of(path)) for path, name in named), "the name")


def _kind_of(path: KeyPath) -> str:
    """Return the kind of entity that a path of the field file names."""
    kinds = {"drones": "a drone", "cameras": "a camera", "targets": "a target"}
    return (kinds | {"motion_capture": "a motion capture system", "ranging": "a ranging system"}).get(
        str(path[0]), "the target"
    )


def _distinct(parts: Parts) -> Iterator[Finding]:
    codes: list[tuple[KeyPath, object, str]] = [
        (("drones", name, "marker", _key_of(drone.marker)), drone.marker.pattern, name)
        for name, drone in parts.drones.items()
    ]
    sources: list[tuple[KeyPath, object, str]] = [
        (("cameras", name, "source"), _placed(camera.source, camera.host), name)
        for name, camera in parts.cameras.items()
    ]
    for path, (name, target) in parts.tracked.items():
        codes.append(((*path, "marker", _key_of(target.marker)), target.marker.pattern, name))
    sources += [
        (("drones", name, "camera", "source"), _placed(drone.video_source, drone.host), name)
        for name, drone in parts.drones.items()
    ]
    yield from _unique(codes, "marker code")
    yield from _unique(sources, "camera source")


def _key_of(marker: MarkerSettings) -> str:
    return "code" if marker.kind == "checkerboard" else "id"


def _placed(source: str, host: str) -> str:
    """Return a source without passwords and with its host: each host has its own devices and networks."""
    return without_password(source) + (f" on {host}" if host else "")


def _captured(parts: Parts) -> Iterator[Finding]:
    for name, system in parts.motion_capture.items():
        bodies: KeyPath = ("motion_capture", name, "bodies")
        yield from (
            ((*bodies, n), f"{n} is no drone or target of the field") for n in sorted({*system.bodies} - parts.bodies)
        )
        as_they_are = {*parts.flying, *(target for target, _ in parts.tracked.values())} - system.bodies.keys()
        called: list[tuple[KeyPath, object, str]] = [(bodies, n, n) for n in sorted(as_they_are)]
        called += [((*bodies, n), body.name or n, n) for n, body in system.bodies.items()]
        yield from _unique(called, "the body's name")


def _unique(values: Iterable[tuple[KeyPath, object, str]], what: str) -> Iterator[Finding]:
    holders: dict[object, str] = {}
    for path, value, holder in values:
        if value in holders:
            yield path, f"{what} {value} is already that of {holders[value]}"
        else:
            holders[value] = holder
