"""Feeds targets' reports of their own motion to the filter, and drops reporters that cameras contradict.

Wheels slip, a lifted robot's wheels turn on, a base sends another one's figures. Reports beyond the gate are refused
one by one; reports that pull the belief along are detected by sightings to one side of the belief. A dropped target's
reports are only compared, and used again once all have agreed for a while, longer each time.
"""

import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np

from groundstation.bus.messages import ReportedMotion, Severity, Verdict
from groundstation.bus.notice import Notice
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.measurement import Correction, SensorReading
from groundstation.estimation.records import VX, VY
from groundstation.field.targets import odometry_name
from groundstation.time_units import NS_PER_S

# Without sightings nothing contradicts a report: none is used later than this after the last sighting [s].
_UNSEEN_S = 1.0
# Number of reports in a row beyond the gate, and their duration [s], after which the target's reports are dropped.
_REFUSED, _REFUSED_S = 5, 0.5
# Weight of the newest sighting in the mean of their offsets, its largest offset there, so that a misread marker alone
# contradicts nothing, and the mean that contradicts [deviations].
_SHARE, _FARTHEST, _AHEAD = 0.1, 4.0, 1.4
# A comparison needs an innovation of no larger deviation [m/s].
_TELLING_M_S = 0.25
# Time for which all reports must agree [s]: at first, and at most.
_PROBATION_S, _LONGEST_S = 2.0, 64.0
# An estimated speed of this many deviations has a direction.
_MOVES = 3.0
_REMEDY = (
    "look whether its wheels slip or it is lifted, and whether the topic is its own; cameras track it all the same"
)


@dataclass(slots=True)
class _Trust:
    """heeded: whether reports are used; refused, since_ns: reports in a row beyond the gate, and the first.

    agreed_ns: since when they agree; probation_s: for how long they must; ahead: mean offset of the sightings from the
    belief [deviations; world].
    """

    heeded: bool = True
    refused: int = 0
    since_ns: int = 0
    agreed_ns: int | None = None
    probation_s: float = _PROBATION_S
    ahead: tuple[float, float] = (0.0, 0.0)


class ReportIntake:
    """Call `take` with each report, and `advance` once a tick with all corrections."""

    def __init__(self, joint: FixedLagFilter, targets: Collection[str]) -> None:
        self._filter = joint
        self._trust = {name: _Trust() for name in targets}
        self._notices: list[Notice] = []

    def take_notices(self) -> list[Notice]:
        """Return and forget the notices for the operator."""
        notices, self._notices = self._notices, []
        return notices

    def heeds(self, target: str) -> bool:
        """Return whether a target's reports are used."""
        return self._trust[target].heeded

    def take(self, key: str, message: ReportedMotion, stamp_ns: int, now_ns: int) -> Verdict:
        """Take one report with checked numbers; ACCEPTED if it may count."""
        name, variance = message.header.entity, message.std_m_s**2
        if name not in self._trust:
            return Verdict.UNKNOWN_ENTITY
        covariance = (variance, 0.0, 0.0, variance)
        reading = SensorReading(stamp_ns, odometry_name(name), name, message.velocity_m_s, covariance)
        used = self._trust[name].heeded and self._filter.age_s(name) <= _UNSEEN_S
        return self._filter.add_report(reading, f"{key}#{message.header.seq}", now_ns, used=used) or Verdict.ACCEPTED

    def advance(self, now_ns: int, corrections: Iterable[Correction]) -> None:
        """Judge the targets by the verdicts on their reports and the offsets of their sightings."""
        for one in corrections:
            trust = self._trust.get(one.subject)
            if trust is None or one.nis is None:
                continue
            if one.is_report:
                self._judge(one, trust, now_ns)
            elif trust.heeded:
                trust.ahead = _mean(trust.ahead, (0.0, 0.0) if one.joined else _bounded(one.ahead))
                if self._lag(one.subject, trust) > _AHEAD:
                    self._drop(one.subject, trust)

    def _judge(self, one: Correction, trust: _Trust, now_ns: int) -> None:
        if one.verdict is not Verdict.ACCEPTED:
            trust.agreed_ns = None
            trust.since_ns = now_ns if trust.refused == 0 else trust.since_ns
            trust.refused += 1
            lasted = now_ns - trust.since_ns >= _REFUSED_S * NS_PER_S
            if trust.heeded and lasted and trust.refused >= _REFUSED:
                self._drop(one.subject, trust)
            return
        trust.refused = 0
        if trust.heeded or math.sqrt(one.covariance[0]) > _TELLING_M_S:
            return
        trust.agreed_ns = now_ns if trust.agreed_ns is None else trust.agreed_ns
        if now_ns - trust.agreed_ns >= trust.probation_s * NS_PER_S:
            self._believe(one.subject, trust)

    def _lag(self, name: str, trust: _Trust) -> float:
        """Return how far a target's sightings lie from the belief, ahead or behind, along its direction [deviations].

        A standing target has no direction: the whole offset counts.
        """
        belief = self._filter.belief()
        if name not in belief.layout:
            return 0.0
        vx, vy = belief.mean_of(name)[VX : VY + 1].tolist()
        deviation = math.sqrt(float(np.trace(belief.covariance_of(name)[VX : VY + 1, VX : VY + 1])))
        speed = math.hypot(vx, vy)
        if speed <= _MOVES * deviation:
            return math.hypot(*trust.ahead)
        return float(abs(vx * trust.ahead[0] + vy * trust.ahead[1]) / speed)

    def _drop(self, name: str, trust: _Trust) -> None:
        trust.heeded, trust.agreed_ns = False, None
        text = f"{name} reports another motion than cameras see: its reports are not used"
        self._notices.append(Notice(Severity.WARNING, text, _REMEDY, name))

    def _believe(self, name: str, trust: _Trust) -> None:
        trust.heeded, trust.refused, trust.ahead = True, 0, (0.0, 0.0)
        trust.probation_s = min(2.0 * trust.probation_s, _LONGEST_S)
        text = f"{name} agrees with the cameras again: its reports are used"
        self._notices.append(Notice(Severity.INFO, text, entity=name))


def _mean(mean: tuple[float, float], new: tuple[float, float]) -> tuple[float, float]:
    return mean[0] + _SHARE * (new[0] - mean[0]), mean[1] + _SHARE * (new[1] - mean[1])


def _bounded(offset: tuple[float, float]) -> tuple[float, float]:
    share = min(1.0, _FARTHEST / max(math.hypot(*offset), _FARTHEST))
    return share * offset[0], share * offset[1]
