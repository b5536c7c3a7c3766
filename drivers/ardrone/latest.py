"""The newest telemetry of an AR.Drone. Pure."""

from typing import NamedTuple

from drivers.ardrone.identity import Model
from groundstation.bus.messages import AIRBORNE, FlightState, Vector3
from groundstation.time_units import NS_PER_MS

FRESH_NS = 300 * NS_PER_MS


class LatestNavdata(NamedTuple):
    """The newest telemetry of the drone; heard_ns 0: never; moved_ns: when it last reported motion.

    Velocity as reported; height_m: above the floor, if reported.
    """

    heard_ns: int = 0
    moved_ns: int = 0
    state: int = 0
    control_state: int | None = None
    flight_state: FlightState = FlightState.UNKNOWN
    battery: float | None = None
    model: Model = Model.UNKNOWN
    velocity_m_s: Vector3 = (0.0, 0.0, 0.0)
    height_m: float | None = None

    def is_fresh(self, now_ns: int) -> bool:
        """Return whether it is newer than 0.3 s; in flight its motion counts, once that was reported."""
        newest_ns = self.moved_ns if self.moved_ns and self.flight_state in AIRBORNE else self.heard_ns
        return newest_ns > 0 and now_ns - newest_ns < FRESH_NS
