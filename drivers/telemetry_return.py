"""Whether a vehicle goes on by itself after its telemetry was silent: if its radio paused, and not too often. Pure."""

from dataclasses import dataclass

from drivers.failsafe_table import Condition
from drivers.watchdog_types import VehicleView, WatchdogLimits
from groundstation.time_units import NS_PER_S

# After so long a silence it has the second time to stand: it may have heard nothing either, and flown on.
_LONG_S, _STANDS_S = 0.5, 0.8
# After one that would need an order if its values were wrong, it has to be heard for this time without a gap; that is
# long enough for a heartbeat of 1 Hz to tell who flies it.
_LASTS_S = 1.5
# It waits for an order where that is not reached within the first, or after more such silences within the third.
_LASTS_WITHIN_S, _TIMES, _TIMES_WITHIN_S = 10.0, 3, 60.0


@dataclass(slots=True)
class _Wait:
    """Of a vehicle that was silent: since when, and whether others flew it before that."""

    since_ns: int
    foreign: bool
    back_ns: int | None = None
    needs_to_last: bool = False

    @property
    def lasts_s(self) -> float:
        """Return how long it has to be heard before it goes on."""
        return _LASTS_S if self.needs_to_last else _STANDS_S


class TelemetryReturn:
    """Call `is_doubted` and `step` once a turn, `forget` at an order to go on. Silences begin 0.3 s after a packet."""

    def __init__(self) -> None:
        self.forget()
        self._foreign = False

    def forget(self) -> None:
        """Begin anew: an order to go on ends the wait and all doubt, and permits as many returns as ever."""
        self._doubted = self._counted = False
        self._silent_ns: int | None = None
        self._wait: _Wait | None = None
        self._times_ns: list[int] = []

    def is_doubted(self, charged_s: float, vehicle: VehicleView) -> bool:
        """Return whether values that cannot be true came in the present silence; charged_s: its duration, 0: none."""
        self._doubted = charged_s > 0.0 and (self._doubted or bool(vehicle.unsound))
        return self._doubted

    def step(
        self, now_ns: int, charged_s: float, tracks: bool, vehicle: VehicleView, limits: WatchdogLimits
    ) -> dict[Condition, str]:
        """Return the conditions that a silence leaves behind; charged_s: of silences since the last order to go on.

        tracks: its mode is TRACK; only in that is there anything to go on with.
        """
        if not tracks:
            self._wait = None
        if not vehicle.fresh:
            self._hear_nothing(now_ns, charged_s, tracks, limits)
            return {}
        self._silent_ns = None
        if self._wait is None:
            self._foreign = vehicle.foreign
            return {}
        return self._hear(now_ns, self._wait, vehicle)

    def _hear_nothing(self, now_ns: int, charged_s: float, tracks: bool, limits: WatchdogLimits) -> None:
        if self._silent_ns is None:
            self._silent_ns, self._counted = now_ns, False
        if tracks and self._wait is None and charged_s >= _LONG_S:
            self._wait = _Wait(self._silent_ns, self._foreign)
        if (wait := self._wait) is None:
            return
        silent_s = (now_ns - self._silent_ns) / NS_PER_S
        wait.needs_to_last = wait.needs_to_last or charged_s >= limits.resume_within_s
        if wait.needs_to_last or silent_s >= _LONG_S:
            wait.back_ns = None
        if not self._counted and silent_s >= limits.resume_within_s:
            self._counted = True
            self._times_ns.append(now_ns)

    def _hear(self, now_ns: int, wait: _Wait, vehicle: VehicleView) -> dict[Condition, str]:
        wait.back_ns = now_ns if wait.back_ns is None else wait.back_ns
        settled = now_ns - wait.back_ns >= wait.lasts_s * NS_PER_S
        taken = settled and vehicle.foreign and not vehicle.piloted and not wait.foreign
        doubt = "it is in a mode that is not ours" if taken else "" if settled else self._impatience(now_ns, wait)
        if doubt:
            return {Condition.BACK_IN_DOUBT: doubt}
        if settled:
            self._wait = None
            return {}
        return {Condition.TELEMETRY_BACK: f"{wait.lasts_s:g} s"}

    def _impatience(self, now_ns: int, wait: _Wait) -> str:
        """Return why it no longer waits for lasting telemetry, or ""."""
        self._times_ns = [time_ns for time_ns in self._times_ns if now_ns - time_ns < _TIMES_WITHIN_S * NS_PER_S]
        if len(self._times_ns) > _TIMES:
            return f"it was silent {len(self._times_ns)} times within {_TIMES_WITHIN_S:g} s"
        patchy = now_ns - wait.since_ns > _LASTS_WITHIN_S * NS_PER_S
        return f"with gaps for {_LASTS_WITHIN_S:g} s" if patchy else ""
