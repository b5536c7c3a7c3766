"""Checks links, batteries and cameras before a take-off, from the reports of their processes. Pure."""

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType

from groundstation.bus.messages import UNHEARD, CameraStatus, FlightState, VehicleStatus
from groundstation.doctor.finding import Finding, Level
from groundstation.field.drones import camera_name
from groundstation.field.resolved import ResolvedField
from groundstation.monitor.alarms import DARK

# Drivers append to a fault the command, or the setting, that mends it.
_REMEDIES = (": groundstation ", ": set ")
_BATTERY_MARGIN, _BATTERY_SHOULD = 0.05, 0.4
_TELEMETRY_HZ, _LINK_SHARE = 5.0, 0.9
_PICTURES_HZ, _PICTURES_OLD_MS = 5.0, 700.0
# A quartz keeps 100 ppm. Setpoints live for 300 ms, and most odometry is dated by its arrival.
_DRIFT_PPM, _LATE_MS = 1000.0, 150.0
# Mean grey values beyond which detail in black or white is lost. Edges of emulated pictures are 2 to 4 px wide, and 4.5
# to 7 px after a blur of 2 px (1 sigma), which loses far sightings.
_BRIGHT, _BLURRED_PX = 0.92, 5.5


def drone_findings(field: ResolvedField, statuses: Mapping[str, VehicleStatus]) -> Iterator[Finding]:
    """Yield findings on each drone; one that is not connected is left out of the take-off, and stops no other."""
    for name, drone in field.drones.items():
        status = statuses.get(name)
        if status is None or status.flight_state in UNHEARD:
            why = status.detail if status is not None and status.detail else "nothing is heard of it"
            found, remedy = _remedied(why)
            yield Finding(Level.SHOULD, name, found, remedy or f"check its power, its network and {drone.address}")
            continue
        if status.flight_state is FlightState.EMERGENCY:
            yield Finding(Level.SHOULD, name, "its motors are cut off", "set it upright and start it again")
        yield from _readiness(name, status)
        yield _battery(name, status, drone.limits.battery_min)
        share = 1.0 if status.link_quality is None else status.link_quality
        if status.rate_hz < _TELEMETRY_HZ or share < _LINK_SHARE:
            heard = "" if status.link_quality is None else f", {status.link_quality:.0%} of it arrives"
            found = f"telemetry {status.rate_hz:.0f} Hz{heard}"
            yield Finding(Level.SHOULD, name, found, "bring it nearer, or choose another radio channel")
        yield from _clock(name, status)


def left_out(field: ResolvedField, statuses: Mapping[str, VehicleStatus]) -> tuple[str, ...]:
    """Return the drones that a take-off would leave out: without telemetry, or refusing the take-off."""
    known = {name: statuses.get(name) for name in field.drones}
    return tuple(n for n, told in known.items() if told is None or told.flight_state in UNHEARD or told.not_ready)


def _remedied(told: str) -> tuple[str, str]:
    """Return a fault and what mends it, "" if its driver names nothing."""
    for begins in _REMEDIES:
        found, _, rest = told.partition(begins)
        if rest:
            return found, f"{begins[2:]}{rest}"
    return told, ""


def _readiness(name: str, status: VehicleStatus) -> Iterator[Finding]:
    """Yield why a drone would refuse to take off, which leaves out only that drone; and its firmware."""
    if status.not_ready:
        found, remedy = _remedied(status.not_ready)
        remedy = remedy or "do what it asks for; until then it does not take off"
        yield Finding(Level.SHOULD, name, f"it refuses to take off: {found}", remedy)
    if status.firmware:
        yield Finding(Level.OK, name, f"firmware {status.firmware}")


def _clock(name: str, status: VehicleStatus) -> Iterator[Finding]:
    """Yield findings on a drone's clock against ours; none if it reports no time."""
    drift, late_ms = status.clock_drift_ppm, status.telemetry_late_ms
    if drift is not None:
        found = f"its clock goes {abs(drift):.0f} ppm {'fast' if drift > 0.0 else 'slow'}"
        bad = abs(drift) > _DRIFT_PPM
        remedy = "restart it; if that does not help, its rates are wrong by as much: replace it" if bad else ""
        yield Finding(Level.SHOULD if bad else Level.OK, name, found, remedy)
    if status.asks_time is False:
        found = "it does not ask for our time (TIMESYNC), so it cannot date the positions that it is sent"
        remedy = "send TIMESYNC on this link: set its MAV_n_MODE to Onboard, and restart it"
        yield Finding(Level.SHOULD, name, found, remedy)
    if late_ms is not None and late_ms > _LATE_MS:
        yield Finding(Level.SHOULD, name, f"its telemetry comes up to {late_ms:.0f} ms late",
                      "a free radio channel, no other traffic on it, or a less busy machine")  # fmt: skip


def _battery(name: str, status: VehicleStatus, lands_at: float) -> Finding:
    charge = status.battery
    if charge is None:
        return Finding(Level.SHOULD, name, "its battery's charge is not known", "measure it before each flight")
    found, remedy = f"battery {charge:.0%} (lands at {lands_at:.0%})", "charge or exchange its battery"
    if charge < lands_at + _BATTERY_MARGIN:
        return Finding(Level.MUST, name, found, remedy)
    return Finding(Level.SHOULD, name, found, remedy) if charge < _BATTERY_SHOULD else Finding(Level.OK, name, found)


def camera_findings(
    field: ResolvedField, statuses: Mapping[str, CameraStatus], sees: Mapping[str, Sequence[str]] = MappingProxyType({})
) -> Iterator[Finding]:
    """Yield findings on each camera, other sensor and target's odometry; statuses: by its name on the bus.

    sees: the entities whose markers it sees.
    """
    if not any(name in statuses and statuses[name].connected for name in field.world_sensors):
        remedy = "check power, source and network of at least one: without it nobody knows where the drones are"
        yield Finding(Level.MUST, "cameras", "no sensor fixed in the world sends anything", remedy)
    pieces = dict.fromkeys((*field.cameras, *map(camera_name, field.drones)), "pictures")
    pieces |= dict.fromkeys(field.motion_capture, "frames") | dict.fromkeys(field.ranging, "ranges")
    pieces |= dict.fromkeys(field.reporting, "reports")
    for name, what in pieces.items():
        status = statuses.get(name)
        reports = name in field.reporting
        if status is None or not status.connected:
            why = status.detail if status is not None and status.detail else "nothing arrives"
            alone = "; cameras track the target meanwhile" if reports else ""
            yield Finding(Level.SHOULD, name, why, f"check its power, its source and its network{alone}")
        else:
            yield _stream(name, status, what, "used" if reports else "sightings", sees.get(name, ()))
            yield from _picture(name, status)


def _stream(name: str, status: CameraStatus, what: str, used: str, sees: Sequence[str]) -> Finding:
    """Return the rate and age of a sensor's data; what, used: words for all of them, and for the used ones."""
    seen = f", sees {', '.join(sees)}" if sees else ""
    found = f"{status.fps:.0f} {what}/s, {status.age_ms:.0f} ms old, {status.detections} {used}{seen}"
    if status.fps >= _PICTURES_HZ and status.age_ms <= _PICTURES_OLD_MS:
        return Finding(Level.OK, name, found)
    return Finding(Level.SHOULD, name, found, "fewer or smaller pictures, a better link, or a faster machine")


def _picture(name: str, status: CameraStatus) -> Iterator[Finding]:
    """Yield faults in exposure and focus of a camera's newest picture, and whether it is frozen."""
    light, edge_px = status.brightness, status.edge_px
    if light is not None and status.detail:
        yield Finding(Level.SHOULD, name, status.detail, "wave a hand before it; if that changes nothing, restart it")
    if light is not None and not DARK <= light <= _BRIGHT:
        too = "dark" if light < DARK else "bright"
        yield Finding(Level.SHOULD, name, f"its picture is too {too} (mean {light:.0%} of white)",
                      "add light, keep light out of the lens, or set its exposure")  # fmt: skip
    if edge_px is not None and edge_px > _BLURRED_PX:
        yield Finding(Level.SHOULD, name, f"its picture is blurred: the sharpest edges are {edge_px:.0f} pixels wide",
                      "focus and clean its lens, fasten it, or shorten its exposure")  # fmt: skip
