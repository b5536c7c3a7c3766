"""Judges whether a vehicle follows its commands, by its reported velocity and by cameras. Pure.

One part holds for every kind of vehicle: any vehicle that lags without overshoot has a velocity between the command and
its earlier velocity.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from drivers.watchdog_types import FREE, Action, VehicleView, WatchdogDecision
from groundstation.bus.messages import UP
from groundstation.time_units import NS_PER_S

# The slowest vehicle follows a command with this time constant; when this share of a step is left, it counts as done.
_SLOWEST_S = 1.0
# A velocity held in a turning frame lags behind by this share of the turn.
_TURNING_S = 0.5
_LONGEST_STEP_S = 0.2
# After a shorter silence earlier commands explain its velocity still; excusing each would hide what strays.
_UNHEARD_S = 0.7
# The tolerance covers the rest for one that brakes from 1 m/s; one that flies on at 0.6 m/s is found after 1.2 s.
_UNHEARD_SHARE = 0.5
# Residual motion after a take-off, and its climb.
_FIRST_M_S, _FIRST_CLIMB_M_S = 0.2, 1.0
# The fastest climb that a field allows: a drone that continues to its take-off height may fly it.
_RISES_M_S = 1.5


@dataclass(frozen=True, slots=True)
class Tolerance:
    """deviation_m_s: explained by noise, gusts and overshoot; excess_m: distance beyond that before it counts.

    forgets_m_s: how fast the excess shrinks while there is none; over_s: after obeying for this long a vehicle no
    longer strays.
    """

    deviation_m_s: float
    excess_m: float
    forgets_m_s: float = 0.2
    over_s: float = 0.3


# Reported velocities have noise of 0.05 m/s; those from camera positions twice as much, and a delay.
REPORTED = Tolerance(deviation_m_s=0.25, excess_m=0.2)
SEEN = Tolerance(deviation_m_s=0.4, excess_m=0.4)
# Air disturbs a climb less; a vehicle that keeps its height above what is below climbs over a table at 0.7 m/s.
CLIMB = Tolerance(deviation_m_s=0.25, excess_m=0.5)


class Envelope:
    """The interval, along one axis, between the command and a slow vehicle's remaining response to earlier ones."""

    def __init__(self, low_m_s: float, high_m_s: float) -> None:
        self.low, self.high = low_m_s, high_m_s

    def step(self, wanted_m_s: float, dt_s: float) -> None:
        """Take a command that holds for a time step."""
        share = min(1.0, dt_s / _SLOWEST_S)
        self.high = max(wanted_m_s, self.high + (wanted_m_s - self.high) * share)
        self.low = min(wanted_m_s, self.low + (wanted_m_s - self.low) * share)

    def admit(self, velocity_m_s: float) -> None:
        """Take a velocity as a response to earlier commands."""
        self.low, self.high = min(self.low, velocity_m_s), max(self.high, velocity_m_s)

    def beyond(self, velocity_m_s: float) -> float:
        """Return by how much a velocity is outside the interval [m/s]."""
        return max(0.0, velocity_m_s - self.high, self.low - velocity_m_s)


class Excess:
    """Cumulative sum (CUSUM) of a velocity's deviation beyond the tolerance."""

    def __init__(self, tolerance: Tolerance) -> None:
        self._tolerance = tolerance
        self.excess_m = 0.0
        self._obeys_s = math.inf

    @property
    def strays(self) -> bool:
        """Whether the vehicle strays."""
        return self._obeys_s < self._tolerance.over_s

    def step(self, deviation_m_s: float, extra_m_s: float, dt_s: float) -> bool:
        """Take a deviation; extra_m_s is tolerated in addition. Return whether the vehicle strays."""
        tolerance = self._tolerance
        over = deviation_m_s - tolerance.deviation_m_s - extra_m_s
        if over > 0.0:
            self.excess_m = min(self.excess_m + over * dt_s, 1.5 * tolerance.excess_m)
            self._obeys_s = 0.0 if self.excess_m >= tolerance.excess_m else self._obeys_s
        else:
            self.excess_m = max(0.0, self.excess_m - tolerance.forgets_m_s * dt_s)
            strayed = self.strays
            self._obeys_s += dt_s
            if strayed and not self.strays:
                self.excess_m = 0.0  # to stray again it has to go as far again
        return self.strays

    def lose(self) -> None:
        """Forget a stray: its velocity is not known any more, and may come back as that of one that stands."""
        if self.strays:
            self.excess_m, self._obeys_s = 0.0, math.inf


class ControlErrorMonitor:
    """Judges one vehicle while only its watchdog moves it."""

    def __init__(self) -> None:
        self._last_ns: int | None = None
        self._unheard_s = 0.0
        self.reset()

    def reset(self) -> None:
        """Begin anew, when it takes off, lands, or is flown by somebody else."""
        self._envelopes: tuple[Envelope, Envelope] | None = None
        self._climb = Envelope(-_FIRST_M_S, _FIRST_CLIMB_M_S)
        self._reported, self._seen, self._climbs = Excess(REPORTED), Excess(SEEN), Excess(CLIMB)

    def judge(
        self, now_ns: int, view: VehicleView, told: WatchdogDecision | None, seen_m_s: tuple[float, float] | None,
        climb_m_s: float | None = None,
    ) -> VehicleView:  # fmt: skip
        """Return the view completed by speed, whether cameras see it, and whether it strays from its last command.

        seen_m_s, climb_m_s: velocity forward and left, and up, by cameras; None if they do not see it.
        """
        dt_s = 0.0 if self._last_ns is None else min((now_ns - self._last_ns) / NS_PER_S, _LONGEST_STEP_S)
        self._last_ns = now_ns
        seen = seen_m_s is not None
        if told is None or told.mode not in FREE or view.flight_state not in UP or view.velocity_m_s is None:
            self.reset()
            return view._replace(seen=seen)
        reported = view.velocity_m_s[:2] if view.fresh else None
        if self._envelopes is None:
            x, y = reported or (0.0, 0.0)
            x, y = _clamp(x, _FIRST_M_S), _clamp(y, _FIRST_M_S)
            self._envelopes = (Envelope(x, x), Envelope(y, y))
        if self._unheard_s >= _UNHEARD_S and reported is not None:
            # Nobody knows whether it heard its commands while it was not heard; from now on it has to obey.
            for envelope, velocity in zip(self._envelopes, reported, strict=True):
                envelope.admit(_UNHEARD_SHARE * velocity)
        self._unheard_s = 0.0 if view.fresh or view.unsound else self._unheard_s + dt_s
        *wanted, up = told.velocity_m_s if told.action is Action.FLY else told.back_m_s or (0.0, 0.0, 0.0)
        for envelope, command in zip(self._envelopes, wanted, strict=True):
            envelope.step(command, dt_s)
        turning = _TURNING_S * abs(told.yaw_rate_rad_s) * math.hypot(*wanted)
        # All are judged at each turn: while one strays, another may begin to.
        strays = {
            "climb": self._judge_climb(climb_m_s, _RISES_M_S if view.rises else up, dt_s),
            "reported": self._judge_one(self._reported, reported, turning, dt_s, wanted, "reported"),
            "seen": self._judge_one(self._seen, seen_m_s, turning, dt_s, wanted, "seen by cameras"),
        }
        stray_by, stray = next(((how, why) for how, why in strays.items() if why), ("", ""))
        speeds = [0.0 if reported is None else math.hypot(*reported)]
        speeds += [] if seen_m_s is None else [math.hypot(*seen_m_s) - SEEN.deviation_m_s / 2]
        climbs = 0.0
        if view.foreign:  # others command it, but our limits hold, for a climb too
            self.reset()
            stray = stray_by = ""
            shown = 0.0 if climb_m_s is None else climb_m_s - CLIMB.deviation_m_s / 2
            climbs = max(view.velocity_m_s[2] if view.fresh else 0.0, shown)
        return view._replace(seen=seen, speed_m_s=max(speeds), climb_m_s=climbs, stray=stray, stray_by=stray_by)

    def _judge_one(
        self, excess: Excess, velocity: tuple[float, float] | None, turning_m_s: float, dt_s: float,
        wanted: Sequence[float], how: str,
    ) -> str:  # fmt: skip
        assert self._envelopes is not None
        if velocity is None:
            excess.lose()
            return ""
        deviation = math.hypot(*(e.beyond(v) for e, v in zip(self._envelopes, velocity, strict=True)))
        if not excess.step(deviation, turning_m_s, dt_s):
            return ""
        return f"{math.hypot(*velocity):.1f} m/s {how}, {math.hypot(*wanted):.1f} m/s asked"

    def _judge_climb(self, climb_m_s: float | None, wanted_m_s: float, dt_s: float) -> str:
        """Judge vertical motion, by cameras only: the height that a vehicle measures is that above what is below.

        Staying is never too little: the floor, a ceiling of its own or an object below may keep it where it is.
        """
        self._climb.step(wanted_m_s, dt_s)
        if climb_m_s is None:
            self._climbs.lose()
            return ""
        beyond = min(self._climb.beyond(climb_m_s), abs(climb_m_s))
        if not self._climbs.step(beyond, 0.0, dt_s):
            return ""
        return f"{_upward(climb_m_s)} seen by cameras, {_upward(wanted_m_s)} asked"


def _upward(climb_m_s: float) -> str:
    return f"{abs(climb_m_s):.1f} m/s {'up' if climb_m_s >= 0.0 else 'down'}"


def _clamp(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
