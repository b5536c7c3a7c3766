"""The rates of streams: those to request, those that come far more seldom, and when to request them again. Pure.

WIRE (ArduCopter 4.7): a REQUEST_DATA_STREAM of another station on the same link changes the rates of ours.
"""

from collections import Counter, deque
from collections.abc import Mapping
from itertools import pairwise

from drivers.mavlink.wire import telemetry
from drivers.mavlink.wire.flight import OdometryMessage
from drivers.mavlink.wire.frames import Message
from drivers.mavlink.wire.names import Flavour
from drivers.mavlink.wire.telemetry import AttitudeQuaternion, LocalPositionNed
from groundstation.time_units import NS_PER_MS, NS_PER_S

# Slower streams come too seldom to be counted within the time.
_LEAST_HZ = 10.0
_STEP_NS, _STEPS = 500 * NS_PER_MS, 4
# Links that lose half of all frames are no other station's work.
_LEAST_SHARE = 0.4
# A link too narrow for a stream gets no more requests until it has come at its rate once.
_TRIES = 3
_STOPPED = 0.0
_NAMES: dict[type[Message], str] = {LocalPositionNed: "velocity", AttitudeQuaternion: "attitude"}


def streams(flavour: Flavour, odometry_hz: float, imu_hz: float) -> dict[type[Message], float]:
    """Return the messages to request and their rates [Hz]; `_STOPPED` for unused ones that come unrequested."""
    imu = telemetry.HighresImu if flavour is Flavour.PX4 else telemetry.RawImu
    wanted: dict[type[Message], float] = {
        telemetry.ExtendedSysState: 5.0,
        telemetry.LocalPositionNed: odometry_hz,
        telemetry.AttitudeQuaternion: odometry_hz,
        telemetry.SysStatus: 2.0,
        telemetry.BatteryStatus: 1.0,
    }
    if imu_hz > 0:
        wanted[imu] = imu_hz
    if flavour is Flavour.ARDUPILOT:
        wanted[telemetry.EkfStatusReport] = 5.0
    else:
        # WIRE (docs/reference/mavlink.md 2): unrequested, PX4 sends 100 and 30 of these a second; of the latter only
        # the covariances are of use. Its ESTIMATOR_STATUS comes every second or two unless requested.
        wanted |= {telemetry.Attitude: _STOPPED, OdometryMessage: 5.0, telemetry.EstimatorStatus: 5.0}
    return wanted


class StreamRates:
    """Counts what arrives of each stream; `take` may be called on another thread than `step`.

    words: which stream comes too seldom, and how often, or ""; the velocity before others.
    """

    def __init__(self, rates: Mapping[type[Message], float]) -> None:
        self._rates = {kind: hz for kind, hz in rates.items() if hz >= _LEAST_HZ}
        self.words = ""
        self._arrived: Counter[type[Message]] = Counter()
        self._tries: Counter[type[Message]] = Counter()
        self.start_over()

    def start_over(self) -> None:
        """Count anew."""
        self.words = ""
        self._counts: deque[tuple[int, Counter[type[Message]]]] = deque(maxlen=_STEPS + 1)

    def take(self, kind: type[Message]) -> None:
        """Count a message."""
        self._arrived[kind] += 1

    def step(self, now_ns: int) -> list[type[Message]]:
        """Return the streams to request again now."""
        if self._counts and now_ns - self._counts[-1][0] < _STEP_NS:
            return []
        if self._counts and now_ns - self._counts[-1][0] > 2 * _STEP_NS:
            self.start_over()  # this loop stood still
        self._counts.append((now_ns, Counter(self._arrived)))
        if len(self._counts) <= _STEPS:
            return []
        (then_ns, before), (_, now) = self._counts[0], self._counts[-1]
        elapsed_s = (now_ns - then_ns) / NS_PER_S
        found_hz = {kind: (now[kind] - before[kind]) / elapsed_s for kind in self._rates}
        slow = [kind for kind in self._rates if self._is_slow(kind)]
        for kind in self._rates.keys() - set(slow):
            del self._tries[kind]
        again = [kind for kind in slow if self._tries[kind] < _TRIES]
        self._tries.update(again)
        if again:
            self.start_over()
        self.words = _words(slow[0], found_hz[slow[0]], self._rates[slow[0]]) if slow else ""
        return again

    def _is_slow(self, kind: type[Message]) -> bool:
        """Return whether it came all the time, but seldom: it has not ended, nor has the link paused."""
        most = _LEAST_SHARE * self._rates[kind] * _STEP_NS / NS_PER_S
        steps = [later[kind] - sooner[kind] for (_, sooner), (_, later) in pairwise(self._counts)]
        return all(step < most for step in steps) and sum(step > 0 for step in steps) >= _STEPS - 1


def _words(kind: type[Message], found_hz: float, granted_hz: float) -> str:
    name = _NAMES.get(kind, kind.__name__)
    return f"its {name} comes at {found_hz:.0f} of {granted_hz:.0f} Hz"
