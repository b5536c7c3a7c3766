"""Whether a vehicle goes on by itself after its telemetry was silent: if its radio paused, and not too often. Pure."""

from drivers.failsafe_table import Condition
from drivers.watchdog_types import VehicleView, WatchdogLimits
from groundstation.time_units import NS_PER_S


class TelemetryReturn:
    """Call `is_doubted` and `step` once a turn, `forget` at an order to go on.

    A silence is long from `sound_after_s` on, and counts from `resume_within_s` on; a shorter one ends with its first
    packet.
    """

    def __init__(self) -> None:
        self._doubted = False
        self._long = self._counted = False
        self._back_ns: int | None = None
        self._times_ns: list[int] = []

    def forget(self) -> None:
        """Begin anew: an order to go on ends the wait, and permits as many returns as ever."""
        self._long = self._counted = False
        self._back_ns, self._times_ns = None, []

    def is_doubted(self, charged_s: float, vehicle: VehicleView) -> bool:
        """Return whether values that cannot be true came in the present silence; charged_s: its duration, 0: none."""
        self._doubted = charged_s > 0.0 and (self._doubted or bool(vehicle.unsound))
        return self._doubted

    def step(
        self, now_ns: int, lasted_s: float, tracks: bool, vehicle: VehicleView, limits: WatchdogLimits
    ) -> dict[Condition, str]:
        """Return the conditions that a silence leaves behind; lasted_s: its duration since the last order to go on.

        tracks: its mode is TRACK; only in that is there anything to go on with.
        """
        self._long, self._counted = self._long and tracks, self._counted and tracks
        if not vehicle.fresh:
            self._back_ns = None
            self._long = tracks and (self._long or lasted_s >= limits.sound_after_s)
            if self._long and not self._counted and lasted_s >= limits.resume_within_s:
                self._counted = True
                self._times_ns.append(now_ns)
        if not (vehicle.fresh and self._long):
            return {}
        self._back_ns = now_ns if self._back_ns is None else self._back_ns
        sound_s = limits.sound_s if self._counted else limits.stands_s
        settled = now_ns - self._back_ns >= sound_s * NS_PER_S
        doubt = self._doubt(now_ns, settled, vehicle, limits)
        self._long = not settled or bool(doubt)
        self._counted = self._counted and self._long
        if doubt:
            return {Condition.BACK_IN_DOUBT: doubt}
        return {Condition.TELEMETRY_BACK: f"{sound_s:g} s"} if self._long else {}

    def _doubt(self, now_ns: int, settled: bool, vehicle: VehicleView, limits: WatchdogLimits) -> str:
        """Return why it does not go on by itself, or ""; who flies it shows in a report that comes once a second."""
        within_ns = limits.returns_within_s * NS_PER_S
        self._times_ns = [time_ns for time_ns in self._times_ns if now_ns - time_ns < within_ns]
        if len(self._times_ns) > limits.returns_most and not settled:
            return f"it was silent {len(self._times_ns)} times within {limits.returns_within_s:g} s"
        return "it is in a mode that is not ours" if settled and vehicle.foreign else ""
