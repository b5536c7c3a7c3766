"""Corrects an autopilot's velocity error as cameras see it, and holds places by the belief. Pure.

An autopilot follows a velocity by its own estimate: with an error of 0.3 m/s it flies off at that speed on a command
of 0 (docs/reference/mavlink.md 2.1). The tracker knows both velocities, so the commands are corrected. Nothing
here moves a vehicle by itself: without the tracker's estimate the correction fades, and hovering is zero velocity
again.
"""

import math

from drivers.mavlink.smoothing import share_of, towards
from drivers.mavlink.undershoot import Undershoot
from groundstation.bus.messages import EntityEstimate, Vector3
from groundstation.time_units import NS_PER_MS, NS_PER_S
from groundstation.vectors import Vector2

# Velocities of the belief have noise of 0.05 m/s.
_SMOOTHING_S = 0.12
# The belief shows an error half a second late (sightings are late, and learning takes time); an error that grows
# with a tilt has changed by then as much as it did in that time before.
_LATELY_S = 0.6
# An error of the climb rate sways within a second or two (docs/reference/mavlink.md 2.1). Heights show it sooner than
# the belief's own climb rate, which is mostly the autopilot's; sought faster than this, it would be their noise.
_CLIMB_PER_S, _MOST_CLIMB_M_S = 6.0, 0.3
_GAP_S, _HEIGHT_JUMP_M, _STEP_S = 0.3, 0.3, 0.1
# A velocity error that is no longer seen counts in full for this long, then fades with this time constant. Measured
# (docs/reference/mavlink.md 2.1): 0.73 of it is left half a second after it was seen, 0.33 after a second.
_LASTS_S, _FORGETS_S = 0.35, 0.6
_FRESH_NS = 300 * NS_PER_MS
# A sudden error is not that of a working estimator: commands are not corrected then, and the limits of the control
# error act. A large one is corrected up to this, which 7 degrees of tilt explain: a correction that ended there would
# itself be a step of that size.
_MOST_M_S = 1.5
_SUDDEN_M_S, _SUDDEN_M_S2 = 0.45, 0.8
_TRUSTED_AGAIN_NS = NS_PER_S
# Right after lift-off a large error begins at once (docs/reference/mavlink.md 2.1), and one second of it is half a
# metre.
_LIFT_OFF_NS = 3 * NS_PER_S
# Up to this difference it does not matter which velocity is wrong.
_SMALL_M_S = 0.2
_RESPONSE_S = 0.6  # time constant of a vehicle's response to a velocity
_JUDGED_S = 0.5  # window over which reported and seen velocities are compared with commands
_EVEN_M_S = 0.1  # within this the two fit equally well
# [1/s], sideways and upwards: a climb rate answers within 0.35 s, and the error of a climb rate that is not yet known
# costs its share of this in height.
_HOLD_GAIN, _HOLD_UP_GAIN = 0.8, 2.0
# Below the control error's tolerance for a vehicle commanded to stand still.
_HOLD_M_S = 0.2
_SEEN_S = 0.5
# A vehicle commanded to stop has stopped once it is this slow for this long, at least two pictures, and after this
# long at most: one that still moves then drifts.
_STOPPED_M_S, _PACE_NS, _STOPS_WITHIN_NS = 0.1, 500 * NS_PER_MS, NS_PER_S
_STILL: Vector3 = (0.0, 0.0, 0.0)


class Obedience:
    """Judges whether a vehicle follows its commands by its own reported velocity rather than by the cameras'.

    A vehicle with a wrong estimator obeys by that estimate. If cameras see the commanded velocity, only the report is
    wrong, not the estimate that the vehicle flies by.
    """

    def __init__(self) -> None:
        self._expected: Vector2 = (0.0, 0.0)
        self._told_ns = self._heard_ns = 0
        self._reported_off = self._seen_off = 0.0

    def note_command(self, now_ns: int, velocity: Vector2) -> None:
        """Note the velocity sent [m/s; base_stabilized]."""
        share = share_of(now_ns - self._told_ns, _RESPONSE_S)
        self._expected, self._told_ns = towards(self._expected, velocity, share), now_ns

    def take(self, now_ns: int, reported: Vector2, seen: Vector2) -> bool:
        """Take its reported and its seen velocity; return whether it flies by the reported one."""
        share, self._heard_ns = share_of(now_ns - self._heard_ns, _JUDGED_S), now_ns
        self._reported_off += share * (math.dist(reported, self._expected) - self._reported_off)
        self._seen_off += share * (math.dist(seen, self._expected) - self._seen_off)
        return self._reported_off <= self._seen_off + _EVEN_M_S


class ClimbError:
    """The error of the climb rate, from the drift of estimated height against the integrated reported rate.

    error_m_s: reported less true climb rate.
    """

    def __init__(self) -> None:
        self.error_m_s = 0.0
        self._height_m, self._at_ns = 0.0, 0

    def take(self, now_ns: int, height_m: float, reported_m_s: float) -> None:
        """Take a height [world] that cameras keep accurate, and the climb rate reported meanwhile."""
        elapsed_s, self._at_ns = (now_ns - self._at_ns) / NS_PER_S, now_ns
        expected_m = self._height_m + elapsed_s * (reported_m_s - self.error_m_s)
        off_m = height_m - expected_m
        if elapsed_s > _GAP_S or abs(off_m) > _HEIGHT_JUMP_M:
            self._height_m = height_m
            return
        step_s = min(elapsed_s, _STEP_S)
        self._height_m = expected_m + 1.4 * _CLIMB_PER_S * step_s * off_m
        self.error_m_s -= _CLIMB_PER_S**2 * step_s * off_m


class ComingToRest:
    """Finds the place to hold of a vehicle that may still move as its hover begins: where it comes to rest.

    If it held the place where the hover began, it would fly back by its stopping distance.
    """

    def __init__(self, now_ns: int, place: Vector3) -> None:
        self._until_ns, self._height_m = now_ns + _STOPS_WITHIN_NS, place[2]
        self._place, self._at_ns = place, now_ns
        self._rests = False

    def place(self, now_ns: int, here: Vector3) -> Vector3:
        """Return the place to hold: the present one, at the first height, until it rests."""
        elapsed_ns = now_ns - self._at_ns
        if not self._rests and elapsed_ns >= _PACE_NS:
            slow = math.dist(here[:2], self._place[:2]) < _STOPPED_M_S * elapsed_ns / NS_PER_S
            self._rests = slow or now_ns >= self._until_ns
            self._place, self._at_ns = here, now_ns
        x, y, _ = self._place if self._rests else here
        return x, y, self._height_m


class DriftFeedback:
    """Compares the belief of one flying vehicle [world, FLU] with the velocity that its autopilot reports.

    top_m: no place that it holds is higher [m; world].
    """

    def __init__(self) -> None:
        self.top_m = math.inf
        self.reset()

    def reset(self) -> None:
        """Forget everything, for a vehicle on the floor."""
        self._drift: Vector2 = (0.0, 0.0)
        self._lately: Vector2 = (0.0, 0.0)
        self._climb, self._undershoot = ClimbError(), Undershoot()
        self._stands = False
        self._at_ns: int | None = None
        self._seen_ns = 0
        self._believed_ns: int | None = None
        self._doubted_until_ns = 0
        self._stood_ns: int | None = None
        self._obedience, self._obeys = Obedience(), True
        self._place: Vector3 = _STILL
        self._yaw_rad = 0.0
        self._held: Vector3 | None = None
        self._coming: ComingToRest | None = None

    def stand(self, now_ns: int) -> None:
        """Note that it has not lifted off yet: the error of its climb rate sways there, and does not count."""
        self._stands, self._stood_ns = True, now_ns

    def lift(self) -> None:
        """Note that it has left the floor."""
        self._stands = False

    def forget_undershoot(self) -> None:
        """Forget what is missing of the commands, while the vehicle does not fly by them."""
        self._undershoot = Undershoot()

    def note_command(self, now_ns: int, asked_m_s: Vector3) -> None:
        """Note the velocity command [base_stabilized], without the correction."""
        forward, left = asked_m_s[:2]
        self._undershoot.note_command(now_ns, self._in_world(forward, left))
        drift = self._corrected(now_ns, self._drift_by_now())
        self._obedience.note_command(now_ns, (forward + drift[0], left + drift[1]))

    def take(self, now_ns: int, estimate: EntityEstimate, reported_m_s: Vector3) -> None:
        """Take a good estimate and the velocity [base_stabilized] that was reported last."""
        x, y, z, yaw = estimate.mean[:4]
        self._place, self._yaw_rad, self._believed_ns = (x, y, z), yaw, now_ns
        if estimate.age_s > _SEEN_S:
            return  # dead reckoning with the same velocity that is being judged
        self._seen_ns = now_ns - round(estimate.age_s * NS_PER_S)
        vx, vy = estimate.velocity_m_s[:2]
        forward, left = reported_m_s[:2]
        self._obeys = self._obedience.take(now_ns, (forward, left), self._in_heading(vx, vy, 0.0)[:2])
        self._climb.take(now_ns, z, reported_m_s[2])
        reported_x, reported_y = self._in_world(forward, left)
        self._correct(now_ns, (reported_x - vx, reported_y - vy))
        if self._corrects(now_ns) and not self._stands:
            self._undershoot.take(now_ns, (vx, vy))

    def see_place(self, now_ns: int, place: Vector3, yaw_rad: float) -> None:
        """Take the place where a picture showed a vehicle of unknown velocity: it holds its place by that.

        The learnt velocity error is dropped: it came from a velocity that was wrong already before that was noticed.
        """
        self._place, self._yaw_rad, self._believed_ns, self._at_ns = place, yaw_rad, now_ns, None

    def _correct(self, now_ns: int, error: Vector2) -> None:
        first, since_ns = self._at_ns is None, now_ns - (self._at_ns or now_ns)
        if not first and math.dist(error, self._drift) > _SUDDEN_M_S + _SUDDEN_M_S2 * since_ns / NS_PER_S:
            self._doubted_until_ns = now_ns + _TRUSTED_AGAIN_NS
        self._drift = towards(self._drift, error, 1.0 if first else share_of(since_ns, _SMOOTHING_S))
        self._lately = towards(self._lately, error, 1.0 if first else share_of(since_ns, _LATELY_S))
        self._at_ns = now_ns

    def drift(self, now_ns: int) -> Vector3:
        """Return reported less true velocity [m/s; base_stabilized]: limited, fading unseen, 0 while doubted."""
        return self._corrected(now_ns, self._drift)

    def correction(self, now_ns: int) -> Vector3:
        """Return the correction of a command [m/s; base_stabilized]: drift, extrapolated to now, and undershoot."""
        (x, y), (missing_x, missing_y) = self._drift_by_now(), self._undershoot.missing
        return self._corrected(now_ns, (x + missing_x, y + missing_y))

    def _drift_by_now(self) -> Vector2:
        x, y = (2.0 * seen - before for seen, before in zip(self._drift, self._lately, strict=True))
        return x, y

    def _corrects(self, now_ns: int) -> bool:
        """Return whether commands are corrected now."""
        doubted = now_ns < self._doubted_until_ns or (math.hypot(*self._drift) > _SMALL_M_S and not self._obeys)
        lifts_off = self._stood_ns is not None and now_ns - self._stood_ns <= _LIFT_OFF_NS
        return self._at_ns is not None and (lifts_off or not doubted)

    def _corrected(self, now_ns: int, drift: Vector2) -> Vector3:
        """Return the part of a drift [world] that is corrected [base_stabilized]."""
        if not self._corrects(now_ns):
            return _STILL
        fades = math.exp(-max(0.0, (now_ns - self._seen_ns) / NS_PER_S - _LASTS_S) / _FORGETS_S)
        x, y = drift
        left_over = fades * min(1.0, _MOST_M_S / max(math.hypot(x, y), _MOST_M_S))
        up = 0.0 if self._stands else fades * self._climb.error_m_s
        return self._in_heading(left_over * x, left_over * y, max(-_MOST_CLIMB_M_S, min(_MOST_CLIMB_M_S, up)))

    @property
    def size_m_s(self) -> float:
        """Return the smoothed difference between reported and seen velocity [m/s], whether corrected or not."""
        return math.hypot(*self._drift)

    def place(self, now_ns: int) -> Vector3 | None:
        """Return its place [world], or None without a fresh belief."""
        if self._believed_ns is None or now_ns - self._believed_ns > _FRESH_NS:
            return None
        return self._place

    def let_go(self) -> None:
        """Release the place: the next hover holds the one where the vehicle comes to rest."""
        self._held = self._coming = None

    def hold_at(self, place: Vector3) -> None:
        """Hold a given place [world] from now on, rather than the one where it comes to rest."""
        self._held = place

    def hold(self, now_ns: int, height_m: float | None = None, back: Vector2 | None = None) -> Vector3:
        """Return the velocity [base_stabilized] back to the place held, 0.2 m/s at most; zero without a fresh belief.

        height_m: the height to hold, None for that of the place. back: the tracker's velocity to the place where it
        wants the vehicle; the place held goes along.
        """
        place = self.place(now_ns)
        if place is None:
            self.let_go()
            return _STILL
        x, y, z = self._held or self._place_to_rest(now_ns, place)
        climb_m = (min(z, self.top_m) if height_m is None else height_m) - place[2]
        up = max(-_HOLD_M_S, min(_HOLD_M_S, _HOLD_UP_GAIN * climb_m))
        if back is not None:
            self._held = (place[0], place[1], z)
            return *back, up
        way = (x - place[0], y - place[1])
        size = math.hypot(*way)
        gain = min(_HOLD_GAIN, _HOLD_M_S / size) if size > 0.0 else 0.0
        return self._in_heading(gain * way[0], gain * way[1], up)

    def _place_to_rest(self, now_ns: int, here: Vector3) -> Vector3:
        self._coming = self._coming or ComingToRest(now_ns, here)
        return self._coming.place(now_ns, here)

    def _in_world(self, forward: float, left: float) -> Vector2:
        c, s = math.cos(self._yaw_rad), math.sin(self._yaw_rad)
        return c * forward - s * left, s * forward + c * left

    def _in_heading(self, x: float, y: float, up: float) -> Vector3:
        c, s = math.cos(self._yaw_rad), math.sin(self._yaw_rad)
        return c * x + s * y, c * y - s * x, up
