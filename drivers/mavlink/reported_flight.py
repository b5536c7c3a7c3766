"""Judges a vehicle's flight by its reports: what it does, whether it is heard, what its reports lack. Pure."""

from drivers.mavlink import convert
from drivers.mavlink.commands import Orders
from drivers.mavlink.identity import Misfit
from drivers.mavlink.latest_telemetry import FRESH_NS, HEARTBEAT_NS, LatestTelemetry
from drivers.mavlink.lift_off import credible
from drivers.mavlink.wire.names import ARMED, Flavour, Landed, MavState, climbs_first, flies_home, mode_name
from groundstation.bus.messages import FlightState
from groundstation.time_units import NS_PER_S

# A stream that was slowed down has come again by then.
_ENDED_NS = NS_PER_S
# A pilot's sticks stop it within this, and cameras see that late: their speed is a mean over half a second.
_STOPS_NS = 3 * NS_PER_S // 2
# WIRE (docs/reference/mavlink.md 1, 2): neither firmware refuses EXTENDED_SYS_STATE.
_ANSWERS_NOTHING = "it is heard, but sends nothing that it is asked for: it may not hear this computer"


class ReportedFlight:
    """The flight of one vehicle. orders: its present ones; misfit: why its frames may be unusable."""

    def __init__(self, flavour: Flavour, orders: Orders, misfit: Misfit) -> None:
        self._flavour, self._orders, self._misfit = flavour, orders, misfit
        self._piloted_ns: int | None = None
        self._critical = False

    def told(self, now_ns: int, known: LatestTelemetry) -> FlightState:
        """Return the state to act upon, by its reports and its orders."""
        starts, state = self._orders.starting, self.state(now_ns, known)
        if not known.heartbeat_ns or not self.landed(now_ns, known):
            return FlightState.UNKNOWN
        if state is FlightState.FLYING and starts and not self._orders.lift.lifted:
            return FlightState.TAKING_OFF
        if state is FlightState.FLYING and convert.is_still(known.velocity_m_s):
            return FlightState.HOVERING
        if state is FlightState.LANDED and starts and known.base_mode & ARMED:
            return FlightState.TAKING_OFF
        return state

    def state(self, now_ns: int, known: LatestTelemetry) -> FlightState:
        """Return the state that it reports."""
        landed = self.landed(now_ns, known)
        if known.disarmed_aloft(now_ns, landed):
            return FlightState.LANDING
        return convert.flight_state_from(self._flavour, known.base_mode, known.custom_mode, known.status, landed)

    def landed(self, now_ns: int, known: LatestTelemetry) -> int:
        """Return its MAV_LANDED_STATE, as far as it is credible."""
        flew = self._orders.lift.lifted and not self._orders.starting and bool(known.base_mode & ARMED)
        return credible(known.landed, now_ns - known.landed_ns, flew)

    def is_heard(self, now_ns: int, known: LatestTelemetry) -> bool:
        """Return whether its telemetry is fresh."""
        # In the air, silence is judged by velocities; on the ground there may be none before the first pose.
        newest = known.heard_ns if self.landed(now_ns, known) == Landed.ON_GROUND else known.moved_ns
        return known.heartbeat_ns > 0 and now_ns - newest < FRESH_NS and now_ns - known.heartbeat_ns < HEARTBEAT_NS

    def mute(self, now_ns: int, known: LatestTelemetry, slow: str) -> str:
        """Return the report that it lacks although it is heard, or ""; slow: the stream that comes seldom."""
        if self.is_heard(now_ns, known):
            return ""
        if words := self._misfit.words(now_ns):
            return words
        # WIRE (ArduCopter 4.6.2): without a position it ends its LOCAL_POSITION_NED, in flight as well.
        heard = now_ns - known.heard_ns < FRESH_NS and now_ns - known.heartbeat_ns < HEARTBEAT_NS
        if not heard:
            return ""
        if not known.landed_ns:
            return _ANSWERS_NOTHING
        if not known.moved_ns:
            return ""
        ended = now_ns - known.moved_ns > _ENDED_NS
        return slow or ("it tells no velocity, as its own estimator knows none" if ended else "its velocity stays away")

    def unsound(self, now_ns: int, known: LatestTelemetry, why: str, slow: str) -> tuple[str, str]:
        """Return why its motion cannot be true, and which report it lacks, "" each; why: the former by its values.

        An attitude that does not arrive repeats as one that is stuck does, but its sensor is not to blame.
        """
        if why and not known.tells_attitude(now_ns) and known.tells_motion(now_ns):
            return "", slow or "its attitude stays away"
        return why, self.mute(now_ns, known, slow)

    def failsafe(self, known: LatestTelemetry) -> str:
        """Return words for a failsafe of the autopilot when it begins while the motors turn; otherwise "".

        WIRE (docs/reference/mavlink.md 5.2): its text about it comes once, and radios lose texts.
        """
        critical = known.status == MavState.CRITICAL and bool(known.base_mode & ARMED)
        begins, self._critical = critical and not self._critical, critical
        mode = mode_name(self._flavour, known.custom_mode)
        return f"its autopilot reports a failsafe of its own, in {mode}" if begins else ""

    def is_piloted(self, now_ns: int, known: LatestTelemetry) -> bool:
        """Return whether a pilot's sticks may move it; call it once a turn."""
        moves = bool(known.base_mode & ARMED) and self._orders.pilot.moves(known.custom_mode)
        self._piloted_ns = now_ns if moves else self._piloted_ns
        return moves

    def must_keep_limits(self, now_ns: int) -> bool:
        """Return whether its speed is limited when our setpoints do not move it: no pilot does or just did."""
        stops = self._piloted_ns is not None and now_ns - self._piloted_ns < _STOPS_NS
        return not (stops or self._orders.climbs_by_itself(now_ns))

    def homeward(self, now_ns: int, known: LatestTelemetry) -> str:
        """Return how it flies home or climbs by itself, and in which mode, or ""."""
        if not known.base_mode & ARMED or self.landed(now_ns, known) == Landed.ON_GROUND:
            return ""
        home = flies_home(self._flavour, known.custom_mode)
        if not home and not climbs_first(self._flavour, known.custom_mode):
            return ""
        name = mode_name(self._flavour, known.custom_mode)
        return f"{'flies home' if home else 'climbs'} by itself, in {name}"
