"""Bootstrap and configuration of the drone: what to send beside REF and PCMD. Pure.

WIRE (AR.Drone sheet 3, 5.1): CONFIG until state bit 6 rises, CTRL 5 until it falls, then the next key. A CONFIG
sent while bit 6 is still up is lost, therefore each key waits for the whole cycle of the one before.
"""

from dataclasses import dataclass
from enum import StrEnum

from drivers.ardrone.settings import ArDroneDriverSettings
from drivers.ardrone.wire import at
from drivers.ardrone.wire.at import AtCommand
from drivers.ardrone.wire.configuration import CONFIGURATION, format_value
from drivers.ardrone.wire.state import StateBit

_REQUEST_PERIOD_NS = 100_000_000
_REQUEST_AFTER_NS = 1_000_000_000
_DISCONNECTED_NS = 2_000_000_000
_FLAT_TRIMS = 3


class Phase(StrEnum):
    """Where the session stands."""

    SEARCHING = "SEARCHING"
    CONFIGURING = "CONFIGURING"
    READY = "READY"


class _Cycle(StrEnum):
    CLEAR = "CLEAR"
    SET = "SET"
    ACKNOWLEDGE = "ACKNOWLEDGE"


@dataclass(frozen=True, slots=True)
class Scale:
    """What a fraction of 1 in PCMD means, as configured: tilt [rad], climb [m/s], yaw rate [rad/s]."""

    tilt_rad: float
    climb_m_s: float
    yaw_rate_rad_s: float


def scale_from_settings(settings: ArDroneDriverSettings) -> Scale:
    """Return the limits to configure: the settings', within what the drone accepts."""
    limits = settings.limits
    return Scale(
        _within("control:euler_angle_max", limits.max_tilt_rad),
        _within("control:control_vz_max", limits.max_climb_m_s * 1000) / 1000,
        _within("control:control_yaw", limits.max_yaw_rate_rad_s),
    )


def _within(name: str, value: float) -> float:
    key = CONFIGURATION[name]
    assert key.minimum is not None and key.maximum is not None
    return min(max(value, key.minimum), key.maximum)


def configuration(settings: ArDroneDriverSettings) -> tuple[tuple[str, str], ...]:
    """Return the keys to write at connect, in order.

    WIRE: `outdoor` copies one of two sets of limits over the active ones, so it goes before them.
    """
    scale, flight = scale_from_settings(settings), settings.flight
    return (
        ("general:navdata_demo", format_value(False)),
        ("control:outdoor", format_value(flight.outdoor)),
        ("control:flight_without_shell", format_value(flight.without_shell)),
        ("control:euler_angle_max", f"{scale.tilt_rad:.6g}"),
        ("control:control_vz_max", f"{scale.climb_m_s * 1000:.6g}"),
        ("control:control_yaw", f"{scale.yaw_rate_rad_s:.6g}"),
        ("control:altitude_max", f"{flight.altitude_max_m * 1000:.0f}"),
        ("pic:ultrasound_freq", str(flight.ultrasound_freq)),
    )


class Session:
    """Brings one drone from silence to full navdata with our limits, and back again when it forgets us."""

    def __init__(self, keys: tuple[tuple[str, str], ...], flat_trim: bool = True) -> None:
        self._keys = keys
        self._index = 0
        self._cycle = _Cycle.CLEAR
        self._trims_left = self._trims = _FLAT_TRIMS if flat_trim else 0
        self._next_request_ns = 0
        self.phase = Phase.SEARCHING

    @property
    def detail(self) -> str:
        """Return what the session waits for, or ""."""
        if self.phase is Phase.READY:
            return ""
        return "waiting for navdata" if self.phase is Phase.SEARCHING else f"configuring {self._keys[self._index][0]}"

    def request_due(self, now_ns: int, silence_ns: int) -> bool:
        """Return whether to ask for navdata now: every 100 ms while there is none."""
        silent = self.phase is Phase.SEARCHING or silence_ns > _REQUEST_AFTER_NS
        if not silent or now_ns < self._next_request_ns:
            return False
        self._next_request_ns = now_ns + _REQUEST_PERIOD_NS
        return True

    def step(self, state: int, silence_ns: int) -> list[AtCommand]:
        """Return the commands to add to the next datagram, given the newest state word and its age."""
        if silence_ns > _DISCONNECTED_NS:
            self.phase = Phase.SEARCHING
            return []
        if self.phase is Phase.SEARCHING or (self.phase is Phase.READY and _has_forgotten(state)):
            self.phase, self._index, self._cycle, self._trims_left = Phase.CONFIGURING, 0, _Cycle.CLEAR, self._trims
        if self.phase is Phase.CONFIGURING:
            return self._configure(bool(state & StateBit.COMMAND))
        if self._trims_left and not state & StateBit.FLY:
            self._trims_left -= 1  # several times, since datagrams get lost and nothing acknowledges it
            return [at.ftrim()]
        return []

    def _configure(self, pending: bool) -> list[AtCommand]:
        if self._cycle is _Cycle.CLEAR and not pending:
            self._cycle = _Cycle.SET
        elif self._cycle is _Cycle.SET and pending:
            self._cycle = _Cycle.ACKNOWLEDGE
        elif self._cycle is _Cycle.ACKNOWLEDGE and not pending:
            self._cycle = _Cycle.SET
            self._index += 1
            if self._index == len(self._keys):
                self.phase = Phase.READY
                return []
        return [at.config(*self._keys[self._index]) if self._cycle is _Cycle.SET else at.ctrl(at.CTRL_ACK)]


def _has_forgotten(state: int) -> bool:
    return bool(state & (StateBit.NAVDATA_BOOTSTRAP | StateBit.NAVDATA_DEMO))
