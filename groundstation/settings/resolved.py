"""A resolved field in the forms that people and other programs read."""

import io

from groundstation.errors import without_password
from groundstation.field.resolved import ResolvedField, field_from_values
from groundstation.settings.drones import Drone
from groundstation.settings.schema import Field
from groundstation.settings.target import OneOfTargets, TrackedBody

# Printed so that the operator knows the precedence; drivers.watchdog enforces it.
STOP_PRIORITY = "CUT_MOTORS > LAND > HOLD > setpoint > TAKEOFF"


def resolved_field(field: Field) -> ResolvedField:
    """Return the field as the values for all other packages, without passwords."""
    return field_from_values(field.model_dump(mode="json"))


def yaml_of(field: Field) -> str:
    """Return the field as YAML: a valid, fully merged field file, but without passwords."""
    from ruamel.yaml import YAML

    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.representer.sort_base_mapping_type_on_output = False
    yaml.width = 120
    stream = io.StringIO()
    yaml.dump(field.model_dump(mode="json"), stream)
    return stream.getvalue()


def summary_of(field: Field) -> str:
    """Return a page for the operator: the team, the limits of each drone, and reactions to failures."""
    x, y, z = field.room.size_m
    fence = field.room.fence
    lines = [
        f"site {field.site}: room {x:g} x {y:g} x {z:g} m, fence x {_span(fence.x_m)} y {_span(fence.y_m)}"
        f" z {_span(fence.z_m)} m",
        "",
    ]
    for name, camera in field.cameras.items():
        lines.append(
            f"camera {name}: {without_password(camera.source)}, {camera.position_m[2]:g} m up, looks {camera.looking},"
        )
        lines.append(f"  observes {' and '.join(camera.observes)}")
    lines += [f"motion capture {name}: {system.source}" for name, system in field.motion_capture.items()]
    lines += [
        f"ranging {name}: {system.source}, {len(system.anchors)} anchors, observes drones"
        for name, system in field.ranging.items()
    ]
    lines += [line for name, drone in field.drones.items() for line in _drone_lines(name, drone)]
    lines += [_target_line(name, target) for name, target in field.tracked.items()]
    lines += ["", *_safety_lines(field)]
    return "\n".join(lines)


def _span(interval: tuple[float, float]) -> str:
    return f"{interval[0]:g}..{interval[1]:g}"


def _drone_lines(name: str, drone: Drone) -> list[str]:
    limits = drone.limits
    return [
        f"drone {name}: {drone.kind} at {drone.address}, pad {_pair(drone.pad_m)} m, marker {drone.marker.identity}",
        f"  camera {without_password(drone.camera.source)}, {drone.camera.tilt_down_deg:g} deg down",
        f"  at most {limits.max_speed_m_s:g} m/s, climb {limits.max_climb_m_s:g} m/s,"
        f" turn {limits.max_yaw_rate_deg_s:g} deg/s; lands below {limits.battery_min:.0%} battery"
        f" held {limits.battery_hold_s:g} s",
    ]


def _target_line(name: str, target: TrackedBody) -> str:
    motion = target.model.replace("_", " ")
    weight = f", weight {target.weight:g}" if isinstance(target, OneOfTargets) else ""
    heard = f", odometry from {target.odometry.source}" if target.odometry is not None else ""
    return f"target {name}: marker {target.marker.identity} at {target.marker.height_m:g} m, {motion}{weight}{heard}"


def _pair(point: tuple[float, float]) -> str:
    return f"({point[0]:g}, {point[1]:g})"


def _safety_lines(field: Field) -> list[str]:
    safety = field.safety
    return [
        f"who wins: {STOP_PRIORITY}",
        f"no fresh setpoint for {safety.setpoint_lifetime_ms / 1000:g} s: hover;"
        f" for {safety.land_after_s:g} s: land (until a new take-off)",
        f"not localised for {safety.unseen_land_after_s:g} s, or unseen for three times as long: land;"
        f" position known worse than {safety.max_position_std_m:g} m: hover",
        f"drones stay {safety.min_separation_m:g} m apart and inside the fence: one that leaves it hovers, and lands"
        f" after {safety.land_after_s:g} s",
    ]
