"""Whom to blame for an observation far beyond the gate: marker, observer, outlier, or the belief of the subject."""

import math

import numpy as np

from groundstation.estimation.filter_state import Belief, Deferred, Hypothesis, Settings
from groundstation.estimation.linear import copy_matrix
from groundstation.estimation.records import (
    IMPLAUSIBLE,
    KIND_ROBOT,
    KIND_TARGET,
    MISTAKEN,
    OBSERVER_DOUBTED,
    OBSERVER_HASTY,
    PENDING,
    EntityMemory,
    EventRow,
    Innovation,
    SensorRow,
    Streak,
)
from groundstation.estimation.update import linearise
from groundstation.kernel import kernel

_INNOVATION = Innovation.dtype
# What is seen farther than this from where another is believed is not that one: a belief that is wide fits all [m].
_SAME_M = 0.5
# Contradictions that are so far apart are not in a row.
_IN_A_ROW_S = 5.0
# For one observer: between two robots whose beliefs are given up, and how many at most, one more every so often.
_BETWEEN_S, _AT_MOST, _FORGOTTEN_S = 3.0, 3.0, 10.0
# A sighting stands for so much time at most.
_SEEN_S, _LIE_FORGOTTEN_S = 0.2, 1.0
_FIRST_DOUBT_M_S, _DOUBT_GROWS, _MOST_DOUBT_M_S = 0.2, 2.0, 1.0


@kernel(inlined=True)
def apart_m(sensor: SensorRow, innovation: Innovation) -> float:
    """Return how far what was seen is from where it was expected [m]; angles left out."""
    square = 0.0
    for i in range(innovation.prediction.size):
        if sensor.is_angle[i] == 0:
            square += innovation.y[i] * innovation.y[i]
    return math.sqrt(square)


@kernel()
def fits_another(
    belief: Belief, deferred: Deferred, sensor: SensorRow, settings: Settings, event: EventRow, rows: int,
    hypothesis: Hypothesis,
) -> bool:  # fmt: skip
    """Return whether what was seen is where the belief has another robot or target: its marker was misread."""
    subject = event.subject
    work, HP = np.empty(1, _INNOVATION), np.empty((4, belief.mean.shape[0]))
    found = False
    for other in range(belief.entities.shape[0]):
        entity = belief.entities[other]
        if other in (subject, event.observer) or belief.memory[other].active == 0:
            continue
        if entity.kind != KIND_ROBOT and entity.kind != KIND_TARGET:
            continue
        shared = rows if rows < 4 or entity.at_yaw >= 0 else 3
        event.subject = other
        copy_matrix(hypothesis.innovations[0].R, work[0].R)
        linearise(belief, deferred, sensor, event, shared, hypothesis.z, work[0], HP)
        fits = 0.0 <= work[0].nis <= settings.wild_gates * settings.gates[shared]
        found = found or (fits and apart_m(sensor, work[0]) <= _SAME_M)
    event.subject = subject
    return found


@kernel()
def is_doubted(memory: EntityMemory, settings: Settings, at: float) -> bool:
    """Return whether an entity was itself seen far from its place, more than once and until just now."""
    return memory.wild.count >= 2 and at - memory.wild_at <= settings.divergence_s


@kernel()
def insists(streak: Streak, settings: Settings, at: float) -> bool:
    """Count one more contradiction in a row; True when they are enough, and last long enough, to be believed."""
    if streak.count == 0:
        streak.since = at
    streak.count += 1
    return at - streak.since >= settings.divergence_s and streak.count >= settings.divergence_count


@kernel()
def has_diverged(memory: EntityMemory, settings: Settings, at: float) -> bool:
    """Count a wild innovation of one entity; True when they last long enough to blame the belief.

    `observe` ends the count when the entity is seen within the gate. What has joined by one observation and was never
    confirmed since has nothing to set against another.
    """
    if memory.unconfirmed != 0:
        return True
    if at - memory.wild_at > _IN_A_ROW_S:
        memory.wild.count = 0
    memory.wild_at = at
    return insists(memory.wild, settings, at)


@kernel()
def given_up_lately(observer: EntityMemory, at: float) -> float:
    """Return how many beliefs were given up for one observer, each forgotten after a while."""
    return max(0.0, observer.gave_up - (at - observer.gave_up_at) / _FORGOTTEN_S)


@kernel()
def is_hasty(observer: EntityMemory, subject: int, at: float) -> bool:
    """Return whether a robot's belief may not be given up yet: another one just was, or it were too many.

    Several robots that one camera contradicts at once speak against the camera; one that is re-initialised again and
    again is not mended by it. Whoever is refused so counts as unseen, and the robot flies back or lands.
    """
    lately = given_up_lately(observer, at)
    if lately > 0.0 and observer.gave_up_whom != subject and at - observer.gave_up_at < _BETWEEN_S:
        return True
    return lately > _AT_MOST - 1.0


@kernel()
def note_given_up(observer: EntityMemory, subject: int, at: float) -> None:
    """Note that a robot's belief was given up for what one observer saw."""
    observer.gave_up = given_up_lately(observer, at) + 1.0
    observer.gave_up_at, observer.gave_up_whom = at, subject


@kernel()
def doubt_velocity(memory: EntityMemory) -> None:
    """Doubt what a vehicle says of its velocity: a fixed camera saw it beyond the gate.

    One surprise says little, and one that is wild nothing of a velocity: such a jump has another cause.
    """
    memory.velocity_doubt = min(_MOST_DOUBT_M_S, _FIRST_DOUBT_M_S + _DOUBT_GROWS * memory.velocity_doubt)


@kernel()
def forget_lie(memory: EntityMemory, at: float) -> None:
    """Forget that a velocity was wrong, while the vehicle is seen: what is wrong still, is noted again."""
    memory.velocity_lie *= math.exp(-min(at - memory.corrected_at, _SEEN_S) / _LIE_FORGOTTEN_S)
    memory.unseen_s = 0.0


@kernel()
def blame(
    belief: Belief, deferred: Deferred, sensor: SensorRow, settings: Settings, event: EventRow, rows: int,
    hypothesis: Hypothesis,
) -> int:  # fmt: skip
    """Return why a wild observation is refused, or PENDING when the subject's belief has to be given up for it.

    belief: of the first mode, as is the noise of the hypothesis that counts.
    """
    if is_doubted(belief.memory[event.observer], settings, event.at):
        return OBSERVER_DOUBTED
    if fits_another(belief, deferred, sensor, settings, event, rows, hypothesis):
        return MISTAKEN
    subject, robot = belief.memory[event.subject], belief.entities[event.subject].kind == KIND_ROBOT
    confirmed = subject.unconfirmed == 0
    if not has_diverged(subject, settings, event.at):
        return IMPLAUSIBLE
    if robot and confirmed and is_hasty(belief.memory[event.observer], event.subject, event.at):
        return OBSERVER_HASTY
    return PENDING
