"""Deviations of an autopilot's velocity, climb and attitude, from its reports and from cameras. Pure.

Its covariances are too small (docs/reference/mavlink.md 2.1), so they can only increase the field file's figures; where
its filter refuses the fed positions (test ratios near 1), its velocity comes from its accelerometers alone.
"""

import math

from drivers.mavlink.wire.flight import OdometryMessage
from drivers.mavlink.wire.names import ESTIMATOR_LOCATED, EkfFlag
from drivers.mavlink.wire.telemetry import EkfStatusReport, EstimatorStatus
from groundstation.time_units import NS_PER_S

# WIRE (ESTIMATOR_STATUS): below 0.5 under normal operation, above 1 a measurement is refused.
_NORMAL_RATIO, _REFUSED_RATIO = 0.5, 1.0
_REFUSED_STD_M_S = 0.5
# WIRE (docs/reference/mavlink.md 2.1): 0.3 to 0.9 m/s after lift-off, at any covariances.
_LIFT_OFF_STD_M_S = 0.5
# The error of an estimator levelled by positions alone is g times its tilt over a bandwidth of some 1.6 rad/s.
_TILT_PER_VELOCITY = 0.08
_NOISE_M_S = 0.05
_FADES_S = 10.0
_KEPT_NS = 3 * NS_PER_S
_REFUSES_NS = NS_PER_S // 2
_REFUSES_HEIGHTS = "its estimator refuses the heights that cameras see: it may climb or sink unasked"
_MOST_M_S, _MOST_RAD = 2.0, math.radians(10.0)
_FILLED_IN = 1e3  # a variance of 30 m/s: no measurement
_ROLL_VARIANCE, _PITCH_VARIANCE = 15, 18
_X_VARIANCE, _Y_VARIANCE = 0, 6


class StatedUncertainty:
    """Deviations of one vehicle's velocity [m/s], and of its roll and pitch [rad]; 0.0: not stated."""

    def __init__(self) -> None:
        self._velocity = self._attitude = self._ratio = self._vertical_ratio = 0.0
        self._stated_ns = self._ratio_ns = self._vertical_ns = self._drift_ns = 0
        self._floor_ns: int | None = None
        self._refuses_ns: int | None = None
        self._drift_m_s = 0.0

    def take(self, now_ns: int, message: OdometryMessage | EstimatorStatus | EkfStatusReport) -> None:
        """Take the autopilot's own deviations."""
        match message:
            case OdometryMessage():
                velocity, pose = message.velocity_covariance, message.pose_covariance
                self._velocity = _std(velocity[_X_VARIANCE], velocity[_Y_VARIANCE])
                self._attitude = _std(pose[_ROLL_VARIANCE], pose[_PITCH_VARIANCE])
                self._stated_ns = now_ns
            case EstimatorStatus():
                aid = _REFUSED_RATIO if _is_blind(message) else math.nan
                self._doubt(now_ns, message.vel_ratio, message.pos_horiz_ratio, aid)
                self._doubt_climb(now_ns, message.pos_vert_ratio)
            case EkfStatusReport():
                self._doubt(now_ns, message.velocity_variance, message.pos_horiz_variance)
                self._doubt_climb(now_ns, message.pos_vert_variance)

    def _doubt(self, now_ns: int, *ratios: float) -> None:
        # NaN: the autopilot compares nothing now, which does not refute its earlier result.
        if stated := [r for r in ratios if not math.isnan(r)]:
            self._ratio, self._ratio_ns = max(stated), now_ns

    def _doubt_climb(self, now_ns: int, ratio: float) -> None:
        if math.isnan(ratio):
            return
        if ratio <= _REFUSED_RATIO:
            self._refuses_ns = None
        elif self._refuses_ns is None:
            self._refuses_ns = now_ns
        self._vertical_ratio, self._vertical_ns = ratio, now_ns

    def leave_floor(self, now_ns: int) -> None:
        """Note that its motors turn before lift-off."""
        self._floor_ns, self._refuses_ns = now_ns, None

    def see_drift(self, now_ns: int, drift_m_s: float) -> None:
        """Take the error of its velocity as measured by cameras [m/s]."""
        faded = self._drift_m_s * math.exp(-max(0, now_ns - self._drift_ns) / NS_PER_S / _FADES_S)
        self._drift_m_s, self._drift_ns = max(faded, drift_m_s - _NOISE_M_S), now_ns

    def velocity_std_m_s(self, now_ns: int) -> float:
        """Return the deviation of a component of its velocity."""
        stated = self._velocity if now_ns - self._stated_ns <= _KEPT_NS else 0.0
        refused = _refused_std_m_s(self._ratio) if now_ns - self._ratio_ns <= _KEPT_NS else 0.0
        rises = self._floor_ns is not None and now_ns - self._floor_ns <= _KEPT_NS
        lift_off = _LIFT_OFF_STD_M_S if rises else 0.0
        return min(_MOST_M_S, max(stated, lift_off, refused))

    def climb_std_m_s(self, now_ns: int) -> float:
        """Return the deviation of its climb, by the heights that it refuses."""
        return _refused_std_m_s(self._vertical_ratio) if now_ns - self._vertical_ns <= _KEPT_NS else 0.0

    def doubts(self, now_ns: int) -> str:
        """Return what to tell while it refuses the heights that it is fed, not just for a moment, or ""."""
        lately = now_ns - self._vertical_ns <= _KEPT_NS
        refuses = lately and self._refuses_ns is not None and now_ns - self._refuses_ns >= _REFUSES_NS
        return _REFUSES_HEIGHTS if refuses else ""

    def attitude_std_rad(self, now_ns: int) -> float:
        """Return the deviation of roll and of pitch."""
        stated = self._attitude if now_ns - self._stated_ns <= _KEPT_NS else 0.0
        return min(_MOST_RAD, max(stated, _TILT_PER_VELOCITY * self._drift_m_s))


def _refused_std_m_s(ratio: float) -> float:
    return _REFUSED_STD_M_S * min(1.0, max(0.0, ratio - _NORMAL_RATIO) / _NORMAL_RATIO)


def _is_blind(status: EstimatorStatus) -> bool:
    """Return whether a PX4 disowns its velocity; without our positions its ratios are NaN, and its flags decide.

    WIRE (docs/reference/mavlink.md 2.2): vel_ratio is NaN all the time where no velocity is fed.
    """
    if not status.flags & EkfFlag.VELOCITY_HORIZ:
        return True
    return math.isnan(status.pos_horiz_ratio) and not status.flags & ESTIMATOR_LOCATED


def _std(*variances: float) -> float:
    # An unknown covariance is NaN by the standard; some send 0 or a huge value.
    known = [v for v in variances if 0.0 < v < _FILLED_IN]
    return math.sqrt(max(known)) if len(known) == len(variances) else 0.0
