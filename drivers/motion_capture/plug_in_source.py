"""A source of another package: what fails in it is told and counted, and the process goes on."""

import time
from collections import Counter
from collections.abc import Iterable
from typing import Any

from drivers.motion_capture.captured_frame import CapturedFrame
from groundstation import plug_ins
from groundstation.errors import DriverError

# For one that fails without waiting; short enough that damaged datagrams of a stranger do not keep ours waiting.
_PAUSE_S = 0.005
_MOST_NS, _LARGEST_DEVIATION = 2**62, 1e3


class PlugInSource:
    """The `Source` around another package's. A DriverError passes: it asks for a new process."""

    def __init__(self, scheme: str, source: Any) -> None:
        self._scheme, self._source = scheme, source
        self._failures, self._failed = 0, ""
        self.rejected: Counter[str] = Counter(source.rejected)
        self.detail = str(source.detail)

    def poll(self, wait_s: float) -> list[CapturedFrame]:
        """Return the arrived frames; none of a poll that fails."""
        source = self._source
        try:
            frames = [_plain(frame) for frame in source.poll(wait_s)]
            rejected, detail = Counter[str](source.rejected), str(source.detail)
        except DriverError:
            raise
        except Exception as error:  # noqa: BLE001 - anybody's program: its fault is told, and the process goes on
            self._failures += 1
            self.detail = self._failed = f"{self._scheme}://: {plug_ins.reason(error)}"
            self.rejected["failed"] = self._failures
            time.sleep(_PAUSE_S)
            return []
        if frames:
            self._failed = ""
        self.rejected = rejected + Counter(failed=self._failures)
        self.detail = self._failed or detail
        return frames

    def close(self) -> None:
        """Close it."""
        self._source.close()


def _plain(frame: object) -> CapturedFrame:
    """Return a frame of plain values; raises what conversions raise. Whether numbers are a pose is judged per body."""
    if not isinstance(frame, CapturedFrame):
        raise TypeError(f"poll returns CapturedFrames, not a {type(frame).__name__}")
    poses: dict[str, Any] = {str(name): (tuple(place), tuple(turn)) for name, (place, turn) in frame.poses.items()}
    return CapturedFrame(
        _time_ns(frame.arrival_ns),
        _time_ns(frame.processing_ns),
        poses,
        tuple(str(name) for name in frame.untracked),
        {str(name): _deviations(told) for name, told in frame.deviations.items()},
        {str(name): _time_ns(behind) for name, behind in frame.behind_ns.items()},
        bool(frame.whole),
    )


def _time_ns(value: Any) -> int:
    time_ns = int(value)
    if abs(time_ns) > _MOST_NS:
        raise ValueError("a time [ns] beyond 64 bits")
    return time_ns


def _deviations(told: Iterable[Any]) -> tuple[float, float, float, float]:
    x, y, z, heading = (float(value) for value in told)
    if not all(0.0 <= value <= _LARGEST_DEVIATION for value in (x, y, z, heading)):  # nan compares false
        raise ValueError(f"deviations must be from 0 to {_LARGEST_DEVIATION:g}")
    return x, y, z, heading
