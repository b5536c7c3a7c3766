"""Finds why a vehicle may not take off yet, from its reports."""

from drivers.mavlink.latest_telemetry import LatestTelemetry
from drivers.mavlink.requests import Requests
from drivers.mavlink.session import MavlinkSession
from drivers.mavlink.settling import Settling
from drivers.mavlink.texts import Texts
from drivers.mavlink.wire.names import ARMED, ESTIMATOR_LOCATED, EkfFlag, Flavour, SensorBits
from groundstation.time_units import NS_PER_S

# ArduPilot repeats its reasons against arming every 30 s.
_COMPLAINTS_NS = 35 * NS_PER_S
_FAULTS = SensorBits.GYRO | SensorBits.ACCELEROMETER


class Readiness:
    """Readiness of one vehicle, from its session, pending requests, and texts."""

    def __init__(self, flavour: Flavour, session: MavlinkSession, requests: Requests, said: Texts) -> None:
        self._flavour, self._session, self._requests, self._said = flavour, session, requests, said
        self._settling = Settling()
        self._starts_ns: int | None = None

    def why_not(self, now_ns: int, known: LatestTelemetry) -> str:
        """Return the reason that prevents its take-off, in words, or ""."""
        detail = self._session.detail(self._requests)
        if detail:
            return detail
        if not known.tells_motion(now_ns):
            return "it has no position yet"
        if not self._is_located(known.ekf):
            return "its estimator has no position yet"
        if known.healthy & _FAULTS != _FAULTS:
            return "its gyros or accelerometers are not healthy"
        if self._flavour is Flavour.PX4:
            # WIRE (docs/reference/mavlink.md 2): without GPS PX4's PREARM_CHECK never becomes healthy, yet OFFBOARD
            # arming works.
            return "" if self._settling.is_over(now_ns, known.status) else "its own checks have not passed yet"
        return "" if known.healthy & SensorBits.PREARM_CHECK else self._arming_reason(now_ns)

    def _is_located(self, flags: int | None) -> bool:
        if self._flavour is Flavour.ARDUPILOT:
            return bool((flags or 0) & EkfFlag.POS_HORIZ_REL)
        # WIRE (docs/reference/mavlink.md 2.2): PX4 sends LOCAL_POSITION_NED without a position, too.
        return flags is None or bool(flags & ESTIMATOR_LOCATED)

    def _arming_reason(self, now_ns: int) -> str:
        said = self._said.reasons(now_ns - _COMPLAINTS_NS, "arm", now_ns)
        return f"it does not want to arm{': ' + '; '.join(said) if said else ''}"

    def note_start(self, now_ns: int, starts: bool) -> None:
        """Note whether it is told to take off now."""
        self._starts_ns = (now_ns if self._starts_ns is None else self._starts_ns) if starts else None

    def refusal(self, known: LatestTelemetry) -> str:
        """Return the vehicle's last objection to starting its motors since the order to take off; "" once they turn."""
        if self._starts_ns is None or known.base_mode & ARMED:
            return ""
        # WIRE (PX4 1.16): "Preflight Fail: ..." names the fault, "Arming denied: ..." only says that there is one.
        said = self._said.reasons(self._starts_ns, "preflight") or self._said.reasons(self._starts_ns, "arm")
        return said[-1] if said else ""
