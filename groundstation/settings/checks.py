"""Checks between settings: each yields the path at fault and the fault."""

from collections.abc import Callable, Iterator

from drivers.camera.source_address import parse_source
from groundstation.errors import without_password
from groundstation.settings.adapter_checks import findings_of_adapters
from groundstation.settings.document import KeyPath
from groundstation.settings.host_checks import findings_of_hosts
from groundstation.settings.kind_checks import findings_of_kinds
from groundstation.settings.name_checks import findings_of_names
from groundstation.settings.parts import Finding, Parts
from groundstation.settings.ranging_checks import findings_of_lines, findings_of_ranging
from groundstation.settings.room import CalibrationSettings
from groundstation.settings.room_checks import findings_in_room
from groundstation.vehicles import kind_named


def findings(parts: Parts) -> Iterator[Finding]:
    """Return all faults between the given sections."""
    for check in _CHECKS:
        yield from check(parts)


def _team(parts: Parts) -> Iterator[Finding]:
    if parts.drones and not parts.flying:
        yield ("drones",), "at least one drone must be enabled"


def _root(parts: Parts) -> Iterator[Finding]:
    """Require a sensor fixed in the world, the root of every sensing topology."""
    if parts.truth is not None and (parts.truth not in parts.given or parts.truth in {*parts.cameras, *parts.ranging}):
        known = ", ".join(parts.motion_capture) or "there is none"
        yield ("truth", "from"), f"must name a motion capture system of the field: {known} (got {parts.truth})"
    if not parts.given - {parts.truth}:
        yield (
            ("cameras",),
            ("at least one camera, or a motion capture system that is not the truth, or ranging, must be given"),
        )


def _ranged(parts: Parts) -> Iterator[Finding]:
    yield from findings_of_ranging(parts.ranging, parts.drones, parts.flying, parts.room)
    observed = {name: one.observes for name, one in parts.cameras.items()}
    observed |= {name: one.observes for name, one in parts.motion_capture.items() if name != parts.truth}
    faulty = parts.given - {*parts.ranging, *parts.cameras, *parts.motion_capture}
    if not faulty and not any("robots" in seen for seen in observed.values()):
        yield from findings_of_lines(parts.ranging)


def _kinds(parts: Parts) -> Iterator[Finding]:
    yield from findings_of_adapters(parts.drones)
    yield from findings_of_kinds(parts.drones)


def _hosts(parts: Parts) -> Iterator[Finding]:
    yield from findings_of_hosts(
        parts.drones, parts.cameras, {"motion_capture": parts.motion_capture, "ranging": parts.ranging}, parts.bus
    )


def _own_video(parts: Parts) -> Iterator[Finding]:
    """Require that a vehicle's own video comes from that vehicle."""
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
    findings_in_room,
    _root,
    _ranged,
    _team,
    findings_of_names,
    _kinds,
    _hosts,
    _own_video,
    _rates_and_times,
    _calibrations,
)
