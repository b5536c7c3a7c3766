"""Runs every compiled kernel once before the tracker is READY, on an invented second of flight."""

from groundstation.bus.messages import FlightState, Header, Odometry, RelativeObservation, VehicleStatus
from groundstation.field.resolved import ResolvedField
from groundstation.time_units import NS_PER_S
from groundstation.tracker import tracker_from_field

_START_NS = 1_000 * NS_PER_S
_MS = 1_000_000
_CLOCK = "warm-up"


def warm_up(field: ResolvedField) -> None:
    """Fly a tracker of its own through take-off, localisation and one plan; nothing is kept of it."""
    tracker = tracker_from_field(field, _CLOCK, 0)
    now_ns = _START_NS
    for step in range(10):
        now_ns += 20 * _MS
        for index, robot in enumerate(tracker.robots):
            header = Header(now_ns, _CLOCK, robot, robot, step)
            tracker.ingest(robot, VehicleStatus(header=header, flight_state=FlightState.FLYING, mode=""), now_ns)
            tracker.ingest(f"{robot}/odometry", _odometry(header), now_ns)
            for camera in field.cameras:
                sight = _sighting(Header(now_ns, _CLOCK, camera, camera, step), robot, (1.5 * index, 0.5, 2.5))
                tracker.ingest(f"{camera}/{robot}", sight, now_ns)
            for target in field.tracked:
                tracker.ingest(f"{robot}/{target}", _sighting(header, target, (0.0, 0.0, 1.2)), now_ns)
        tracker.advance(now_ns)
    tracker.plan()
    tracker.setpoints(now_ns)
    tracker.estimates()


def _odometry(header: Header) -> Odometry:
    return Odometry(
        header=header,
        velocity_m_s=(0.1, 0.0, 0.0),
        velocity_covariance=(0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.01),
        yaw_rad=0.0,
        roll_rad=0.0,
        pitch_rad=0.0,
        height_m=1.3,
    )


def _sighting(header: Header, subject: str, position_m: tuple[float, float, float]) -> RelativeObservation:
    variances = [0.01 if i % 5 == 0 else 0.0 for i in range(16)]
    return RelativeObservation(
        header=header,
        observer=header.entity,
        subject=subject,
        camera=f"{header.entity}_camera",
        position_m=position_m,
        yaw_rad=0.0,
        covariance=tuple(variances),
    )
