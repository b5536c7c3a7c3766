"""One horizontal axis of the velocity loop: wanted response, observer of the speed, pending tilt. Pure.

The odometry's speed is noisy over half a second, too slow and off by a constant factor; a prediction from the
accelerometers (drag and wind) and the commanded tilts is sharp at once but drifts. The observer follows the prediction
and is drawn to the odometry with a time constant of a second or so.
"""

import math
from collections import deque
from dataclasses import dataclass

SEEN_TICKS = 24
"""Calls of the loop over which cameras see a mean speed."""

_SUBSTEPS = 4
# How fast the commanded speed is corrected by the measured one in wind [1/s].
_LEARN_WIND = 1.0


@dataclass(frozen=True, slots=True)
class Gains:
    """Figures of loop and vehicle.

    proportional [1/s]. reference_rad_s, reference_damping: of the wanted response, second order. observer_rad_s, and
    blind_observer_rad_s without accelerometers and in wind: bandwidth of the observer, its damping. tilt_rad_s,
    tilt_damping, dead_ticks: how tilt answers, after this many calls. odometry_delay_s: age of the measured speed. drag
    [1/s], drag_per_m [1/m]: air drag. accelerometer_gain: measured / true. bias_m_s2: bound of the observer's bias.
    still: speeds below this are zero [m/s, rad/s]. settle_s: after this long at zero the drone holds its place by
    itself. standing_s: time constant with which a standing drone learns what its accelerometers show at rest.
    overshoot_m_s, disturbance_m_s2: how much faster than wanted the commanded tilts may make the drone, and how much of
    a steady push that only its speed shows (an attitude wrong by 1.2 degrees) they may counter. doubt_m_s, doubt_m:
    difference between the measured speed and the one from commands that a wrong scale and gusts explain, and the
    integral of the excess that nothing explains; answer_s: by how much the measured one is later. lasting_s: a bias
    learnt in less time may be drift of the measured speed. seen_ticks, seen_rad_s, first_seen: cameras give the mean
    over this many calls, which draws the observer with this bandwidth when nothing else is measured, at first by this
    share. push_s: time constant with which a push decays after the accelerometers fall silent.
    """

    proportional: float = 1.6
    reference_rad_s: float = 4.2
    reference_damping: float = 0.69
    observer_rad_s: float = 0.8
    blind_observer_rad_s: float = 3.5
    observer_damping: float = 0.8
    tilt_rad_s: float = 12.5
    tilt_damping: float = 0.63
    dead_ticks: int = 4
    odometry_delay_s: float = 0.04
    drag: float = 0.15
    drag_per_m: float = 0.13
    accelerometer_gain: float = 0.92
    bias_m_s2: float = 2.0
    still: float = 0.02
    settle_s: float = 1.0
    standing_s: float = 2.0
    overshoot_m_s: float = 0.2
    disturbance_m_s2: float = 0.2
    doubt_m_s: float = 0.3
    doubt_m: float = 0.05
    answer_s: float = 0.3
    lasting_s: float = 10.0
    seen_ticks: int = SEEN_TICKS
    seen_rad_s: float = 2.0
    first_seen: float = 0.5
    push_s: float = 0.5


class Axis:
    """State of one axis; `bias_m_s2`, the true acceleration of level flight, outlives `start`."""

    def __init__(self, gains: Gains) -> None:
        self._gains = gains
        self.bias_m_s2 = self._rest_m_s2 = self._lasting_m_s2 = self._wind_m_s2 = 0.0
        self.start(0.0)

    def start(self, speed_m_s: float) -> None:
        """Begin from hovering at a speed."""
        self.speed_m_s = self.reference_m_s = speed_m_s
        self._reference_rate = self._tilt = self._tilt_rate = 0.0
        self._under_way = deque([0.0] * self._gains.dead_ticks)
        self._lately = deque([self.speed_m_s], self._gains.seen_ticks)
        self._unseen = self._push_m_s2 = 0.0
        self.flown_m_s = self.speed_m_s
        # By commands and accelerometers, drawn to the observer within `lasting_s`: the measured speed may be wrong.
        self._unmeasured = deque([self.speed_m_s], self._gains.seen_ticks)
        self._expected_m_s = self.flown_m_s
        self._unexplained_m = 0.0

    @property
    def contradicted(self) -> bool:
        """Return whether the measured speed contradicts the one that the commands must have caused."""
        return self._unexplained_m > self._gains.doubt_m

    @property
    def expected_m_s(self) -> float:
        """Return the speed that the commands should show in its reports by now."""
        return self._expected_m_s

    @property
    def in_wind(self) -> bool:
        """Return whether its accelerometers show a push that a wrong drag does not explain."""
        return self._wind_m_s2 != 0.0

    def stand(self, force_m_s2: float, dt_s: float) -> None:
        """Learn from a standing drone: after the flat trim these are its accelerometer readings when level."""
        share = min(1.0, dt_s / self._gains.standing_s)
        rest = -clamp(force_m_s2 / self._gains.accelerometer_gain, self._gains.bias_m_s2)
        self.bias_m_s2 += (rest - self.bias_m_s2) * share
        self._rest_m_s2 = self._lasting_m_s2 = self.bias_m_s2

    def distrust(self) -> None:
        """Forget conclusions from measured speeds that contradict the commanded ones."""
        self._shift(self.flown_m_s - self.speed_m_s)
        self._lasting_m_s2, self._unexplained_m = self._rest_m_s2, 0.0

    def brake(self) -> None:
        """Go on without the measured speed: its influence of the last seconds may have been drift."""
        self.bias_m_s2 = self._lasting_m_s2

    def see(self, seen_m_s: float, dt_s: float) -> None:
        """Correct the speed by the mean one that cameras saw over the last calls, at first by half of it."""
        error = seen_m_s - sum(self._lately) / len(self._lately)
        self._shift(min(1.0, max(self._unseen, self._gains.seen_rad_s * dt_s)) * error)
        self._unseen = 0.0

    def recover(self, seen_m_s: float) -> None:
        """Forget the measured speeds: take that by commands and accelerometers, half corrected by cameras.

        They saw a mean over the last calls, of places that the tracker carried on by the wrong speed.
        """
        self.speed_m_s = self._unmeasured[-1]
        self._lately = deque(self._unmeasured, self._gains.seen_ticks)
        self._shift(self._gains.first_seen * (seen_m_s - sum(self._lately) / len(self._lately)))
        self._unseen = self._unexplained_m = 0.0

    def _shift(self, correction_m_s: float) -> None:
        self.speed_m_s += correction_m_s
        self._lately = deque((speed + correction_m_s for speed in self._lately), self._lately.maxlen)

    def observe(
        self,
        measured_m_s: float | None,
        force_m_s2: float | None,
        turn_m_s2: float,
        dt_s: float,
        drift_m_s: float = 0.0,
    ) -> float:
        """Take a measurement; returns the acceleration by air and bias [m/s^2].

        measured_m_s: None if there is none; the speed is then integrated. force_m_s2: specific force, None if not
        measured; its last part besides drag then goes on. turn_m_s2: change of the speed by turning of its frame.
        drift_m_s: known error of the measured speed.
        """
        gains = self._gains
        blind = force_m_s2 is None
        air = self._air(force_m_s2, dt_s)
        outside = air + self.bias_m_s2
        self._wind_m_s2 = 0.0 if blind or self.contradicted else self._wind(air)
        acceleration = self._answer(dt_s) + outside + turn_m_s2
        unmeasured_m_s = self._unmeasured[-1] + (acceleration - self.bias_m_s2 + self._lasting_m_s2) * dt_s
        off_m_s = self.speed_m_s - self._unmeasured[-1]
        self._unmeasured.append(unmeasured_m_s + off_m_s * min(1.0, dt_s / gains.lasting_s))
        self.speed_m_s += acceleration * dt_s
        self._lately.append(self.speed_m_s)
        if measured_m_s is None:
            return outside
        error = measured_m_s - drift_m_s - (self.speed_m_s - gains.odometry_delay_s * acceleration)
        self._expected_m_s += (self.flown_m_s - self._expected_m_s) * min(1.0, dt_s / gains.answer_s)
        doubt = math.fabs(measured_m_s - self._expected_m_s) - gains.doubt_m_s
        self._unexplained_m = max(0.0, self._unexplained_m + doubt * dt_s)
        # In wind it is unknown how far the firmware leans against it by itself: the speed shows it.
        bandwidth = gains.blind_observer_rad_s if blind or self._wind_m_s2 else gains.observer_rad_s
        self.speed_m_s += min(1.0, 2 * gains.observer_damping * bandwidth * dt_s) * error
        self.bias_m_s2 = clamp(self.bias_m_s2 + bandwidth**2 * dt_s * error, gains.bias_m_s2)
        self._lasting_m_s2 += (self.bias_m_s2 - self._lasting_m_s2) * min(1.0, dt_s / gains.lasting_s)
        self._unseen = gains.first_seen
        return outside

    def _air(self, force_m_s2: float | None, dt_s: float) -> float:
        drag = self.drag(self.speed_m_s)
        if force_m_s2 is None:
            return self._push_m_s2 - drag
        air = force_m_s2 / self._gains.accelerometer_gain
        self._push_m_s2 += (air + drag - self._push_m_s2) * min(1.0, dt_s / self._gains.push_s)
        return air

    def _wind(self, air_m_s2: float) -> float:
        """Return the push by the accelerometers beyond what a wrong drag explains [m/s^2].

        Odometry has no part in it: the drag of a drone is judged by the speed that it must have flown.
        """
        push = air_m_s2 + self._rest_m_s2 + self.drag(self.flown_m_s)
        unexplained = push - clamp(push, self._gains.disturbance_m_s2)
        return clamp(2.0 * unexplained, math.fabs(push))

    def _answer(self, dt_s: float) -> float:
        """Advance the model of the tilt by the command of a dead time ago; returns its mean acceleration."""
        gains, asked, mean = self._gains, self._under_way.popleft(), 0.0
        step_s, tilt, rate = dt_s / _SUBSTEPS, self._tilt, self._tilt_rate
        stiffness, damping = gains.tilt_rad_s**2, 2 * gains.tilt_damping * gains.tilt_rad_s
        for _ in range(_SUBSTEPS):
            rate += (stiffness * (asked - tilt) - damping * rate) * step_s
            tilt += rate * step_s
            mean += tilt / _SUBSTEPS
        self._tilt, self._tilt_rate = tilt, rate
        return mean

    def wish(self, wanted_m_s: float, outside_m_s2: float, dt_s: float) -> float:
        """Return the acceleration to command by tilt [m/s^2], before it is limited."""
        gains, step_s = self._gains, dt_s / _SUBSTEPS
        stiffness, damping = gains.reference_rad_s**2, 2 * gains.reference_damping * gains.reference_rad_s
        reference, rate = self.reference_m_s, self._reference_rate
        for _ in range(_SUBSTEPS):
            rate += (stiffness * (wanted_m_s - reference) - damping * rate) * step_s
            reference += rate * step_s
        self.reference_m_s, self._reference_rate = reference, rate
        # Until a new command takes effect, earlier commands and outside pushes cause this much speed.
        lag_s = 2 * gains.tilt_damping / gains.tilt_rad_s
        coming = sum(self._under_way) * dt_s + self._tilt * lag_s + self._tilt_rate / gains.tilt_rad_s**2
        coming += outside_m_s2 * (len(self._under_way) * dt_s + lag_s)
        error = self.reference_m_s - self.speed_m_s - coming
        return self._reference_rate + gains.proportional * error - outside_m_s2

    def bounded(self, acceleration_m_s2: float, wanted_m_s: float, outside_m_s2: float, dt_s: float) -> float:
        """Return the permitted part of an acceleration: no more than the drag at the wanted speed.

        Commands make a drone fly `flown_m_s` in the surrounding air, at any measured speed. That may exceed the
        wanted speed only a little, so that a measured speed of 0 does not wind up tilt.
        """
        gains, wind, most_m_s2 = self._gains, self._wind_m_s2, self._gains.disturbance_m_s2
        # The firmware may lean against the wind by itself: any share of the wind may be left.
        push = outside_m_s2 + self.drag(self.speed_m_s)
        if wind:
            push += _LEARN_WIND * (self.speed_m_s - self.flown_m_s)
        push = min(max(push, min(wind, 0.0) - most_m_s2), max(wind, 0.0) + most_m_s2)
        slower = -self.drag(self.flown_m_s) + push
        fastest = max(wanted_m_s, self.reference_m_s, 0.0) + gains.overshoot_m_s
        slowest = min(wanted_m_s, self.reference_m_s, 0.0) - gains.overshoot_m_s
        # Towards the bound in about the time in which tilt answers, not sooner: a hard stop would oscillate.
        most = (fastest - self.flown_m_s) * gains.reference_rad_s - slower
        least = (slowest - self.flown_m_s) * gains.reference_rad_s - slower
        asked = min(max(acceleration_m_s2, least), most)
        self.flown_m_s += (asked + slower) * dt_s
        return asked

    def ask(self, acceleration_m_s2: float) -> None:
        """Note the command that was finally sent."""
        self._under_way.append(acceleration_m_s2)

    def drag(self, speed_m_s: float) -> float:
        """Return the deceleration by the air at a speed [m/s^2]."""
        return speed_m_s * (self._gains.drag + self._gains.drag_per_m * math.fabs(speed_m_s))


def clamp(value: float, limit: float) -> float:
    """Return the nearest value between -limit and limit."""
    return min(max(value, -limit), limit)
