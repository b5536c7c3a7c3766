"""Watches the navdata rate for the collapses that a Wi-Fi scan of this computer causes. Pure.

WIRE (docs/reference/ardrone.md 11; ardrone_autonomy #118): while the host's network manager scans, 200 Hz fall to 4-10
Hz for some 5 s, every couple of minutes; the drone misses commands meanwhile as well.
"""

from groundstation.bus.messages import Severity
from groundstation.bus.notice import Notice
from groundstation.time_units import NS_PER_MS

_SLOW_SHARE, _FINE_SHARE = 0.4, 0.7
_LONG_ENOUGH_NS = 500 * NS_PER_MS
# A lower rate was never a full stream.
_LEAST_HZ = 50.0
_REMEDY = (
    "does this computer scan for Wi-Fi networks? tie its connection to one access point (nmcli connection modify NAME "
    "802-11-wireless.bssid AA:BB:...), close network menus, or use a cable to the access point"
)


class RateWatch:
    """Detects when the rate falls far below the best of this connection, and when it is back."""

    def __init__(self) -> None:
        self._best_hz = 0.0
        self._slow_since_ns: int | None = None
        self._told = False

    def reset(self) -> None:
        """Begin anew, for a new connection."""
        self._best_hz, self._slow_since_ns, self._told = 0.0, None, False

    def step(self, now_ns: int, rate_hz: float) -> Notice | None:
        """Take the rate over the last second; returns an event for the operator."""
        self._best_hz = max(self._best_hz, rate_hz)
        if self._best_hz < _LEAST_HZ:
            return None
        if rate_hz >= (_FINE_SHARE if self._told else _SLOW_SHARE) * self._best_hz:
            return self._recover(now_ns, rate_hz)
        self._slow_since_ns = self._slow_since_ns or now_ns
        if self._told or now_ns - self._slow_since_ns < _LONG_ENOUGH_NS:
            return None
        self._told = True
        return Notice(Severity.WARNING, f"navdata fell from {self._best_hz:.0f} to {rate_hz:.0f} Hz", _REMEDY)

    def _recover(self, now_ns: int, rate_hz: float) -> Notice | None:
        since_ns, told = self._slow_since_ns, self._told
        self._slow_since_ns, self._told = None, False
        if not told or since_ns is None:
            return None
        return Notice(Severity.INFO, f"navdata is back at {rate_hz:.0f} Hz after {(now_ns - since_ns) * 1e-9:.1f} s")
