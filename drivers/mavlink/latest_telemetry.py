"""The newest telemetry of a MAVLink vehicle."""

from dataclasses import dataclass, replace

from drivers.mavlink.battery import Batteries
from drivers.mavlink.convert import BaseAttitude
from drivers.mavlink.turning import turned_on
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.names import ARMED, Landed, MavState
from drivers.mavlink.wire.telemetry import Heartbeat
from groundstation.bus.messages import Vector3
from groundstation.time_units import NS_PER_MS, NS_PER_S

# Longer than a vehicle with stopped motors takes to be on the floor and to report it.
_FALLS_NS = 5 * NS_PER_S
FRESH_NS = 300 * NS_PER_MS
# Of one a second three may be lost.
HEARTBEAT_NS = 4 * NS_PER_S
# Shorter than the second between two heartbeats; one that came twice does not confirm itself.
_CONFIRMS_NS = 300 * NS_PER_MS
_NO_BATTERY = Batteries()


@dataclass(frozen=True, slots=True)
class LatestTelemetry:
    """The last reports; times 0: never. moved_ns, attitude_ns: of the last velocity and attitude.

    asked_ns: of the last request for our time; disarmed_ns: since when heartbeats report again that its motors stand;
    ends_ns: since when all of them report the end of its flight, 0 if they do not.
    transmitter: it receives a pilot's transmitter; ekf: flags of its estimator, None: never reported.
    """

    heard_ns: int = 0
    moved_ns: int = 0
    heartbeat_ns: int = 0
    asked_ns: int = 0
    base_mode: int = 0
    disarmed_ns: int = 0
    custom_mode: int = 0
    status: int = 0
    ends_ns: int = 0
    landed: int = 0
    landed_ns: int = 0
    healthy: int = 0
    transmitter: bool = False
    ekf: int | None = None
    batteries: Batteries = _NO_BATTERY
    attitude: BaseAttitude | None = None
    attitude_ns: int = 0
    inertial: tuple[float, ...] = ()
    velocity_m_s: Vector3 = (0.0, 0.0, 0.0)
    position_m: Vector3 | None = None

    def after_heartbeat(self, now_ns: int, beat: Heartbeat) -> "LatestTelemetry":
        """Return it with a heartbeat taken; raises WireError for a state that does not exist.

        With its motors running the end of its flight cuts them, so it counts from the second heartbeat in a row on.
        """
        status, armed = beat.system_status, bool(beat.base_mode & ARMED)
        if status > MavState.FLIGHT_TERMINATION:
            raise WireError("implausible", f"MAV_STATE {status}")
        ends_ns = (self.ends_ns or now_ns) if status >= MavState.POWEROFF else 0
        if ends_ns and armed and now_ns - ends_ns < _CONFIRMS_NS:
            status = self.status
        disarmed_ns = now_ns if self.base_mode & ARMED and not armed else self.disarmed_ns
        return replace(
            self, heartbeat_ns=now_ns, base_mode=beat.base_mode, custom_mode=beat.custom_mode, status=status,
            ends_ns=ends_ns, disarmed_ns=disarmed_ns,
        )  # fmt: skip

    def tells_motion(self, now_ns: int) -> bool:
        """Return whether its velocity is younger than 0.3 s."""
        return now_ns - self.moved_ns < FRESH_NS

    def tells_attitude(self, now_ns: int) -> bool:
        """Return whether its attitude is younger than 0.3 s."""
        return now_ns - self.attitude_ns < FRESH_NS

    def fell_silent(self, now_ns: int) -> bool:
        """Return whether it was heard, and is not any more."""
        return self.heartbeat_ns > 0 and now_ns - self.heard_ns > FRESH_NS

    def disarmed_aloft(self, now_ns: int, landed: int) -> bool:
        """Return whether the latest reports say both that the motors stand and that it flies (MAV_LANDED_STATE).

        Both cannot be true for long: the heartbeat may be old, or another vehicle's.
        """
        if self.base_mode & ARMED or landed in (Landed.UNDEFINED, Landed.ON_GROUND):
            return False
        return self.disarmed_ns > 0 and now_ns - self.disarmed_ns < _FALLS_NS

    def attitude_at(self, now_ns: int) -> BaseAttitude | None:
        """Return the attitude extrapolated to now; None: never reported."""
        return None if self.attitude is None else turned_on(self.attitude, now_ns - self.attitude_ns)
