"""Makes each motion capture driver's section from the field."""

from drivers.motion_capture.settings import BodySection, MotionCaptureSection
from groundstation.settings.motion_capture import MotionCaptureSettings, RigidBodySettings
from groundstation.settings.schema import Field
from groundstation.settings.values import Vector3

# A drone that is pushed, falls or is carried is faster than commanded.
_MARGIN = 2.0


def capture_section(field: Field, name: str) -> MotionCaptureSection:
    """Return the settings of the driver of a motion capture system."""
    system = field.motion_capture[name]
    markers = {n: drone.marker.position_m for n, drone in field.drones.items()}
    markers |= {n: target.marker.position_m for n, target in field.tracked.items()}
    volume = system.volume_m
    return MotionCaptureSection(
        name=name,
        source=system.source,
        bodies=tuple(_body(system, entity, marker) for entity, marker in markers.items()),
        observed=observed(field, name),
        up=system.up,
        position_m=system.position_m,
        yaw_deg=system.yaw_deg,
        delay_ms=system.delay_ms,
        rate_hz=system.rate_hz,
        position_std_m=system.pose_std_m,
        heading_std_deg=system.heading_std_deg,
        volume_m=(volume.x_m, volume.y_m, volume.z_m),
        max_speed_m_s=_MARGIN * max(one.limits.max_speed_m_s for one in field.drones.values())
        + max(target.max_speed_m_s or 0.0 for target in field.tracked.values()),
    )


def observed(field: Field, name: str) -> tuple[str, ...]:
    """Return the drones and targets that a system reports to the tracker; none for the truth."""
    if field.truth.get("from") == name:
        return ()
    system = field.motion_capture[name]
    robots = tuple(field.drones) if "robots" in system.observes else ()
    return robots + (tuple(field.tracked) if "targets" in system.observes else ())


def _body(system: MotionCaptureSettings, entity: str, marker_m: Vector3) -> BodySection:
    body = system.bodies.get(entity, RigidBodySettings())
    return BodySection(
        entity=entity,
        name=body.name or entity,
        position_m=body.position_m,
        yaw_deg=body.yaw_deg,
        marker_m=marker_m,
    )
