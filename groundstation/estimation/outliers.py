"""Finds the cause of an observation far beyond the gate: marker, observer, outlier, or the subject's belief."""

import math

import numpy as np

from groundstation.arrays import Vector
from groundstation.estimation.filter_state import Belief, Deferred, Hypothesis, Settings
from groundstation.estimation.linear import copy_matrix
from groundstation.estimation.model_kernels import call_locate
from groundstation.estimation.models.driven import SILENT_S
from groundstation.estimation.records import (
    IMPLAUSIBLE,
    KIND_LANDMARK,
    KIND_ROBOT,
    KIND_TARGET,
    MISTAKEN,
    OBSERVER_DOUBTED,
    OBSERVER_HASTY,
    PENDING,
    POSE,
    TURNED,
    YAW,
    EntityMemory,
    EventRow,
    Innovation,
    SensorRow,
    Streak,
    X,
    Y,
)
from groundstation.estimation.update import linearise
from groundstation.kernel import kernel

_INNOVATION = Innovation.dtype
# A sighting farther than this from another entity's estimate is not of that entity: a wide belief would fit anything
# [m].
_SAME_M = 0.5
# Contradictions farther apart than this are not in a row.
_IN_A_ROW_S = 5.0
# A lost body is displaced from its belief by the same way from one contradiction to the next, to this [m], and as far
# as body and belief drift apart meanwhile [m/s]; outliers are not.
_SAME_WAY_M, _DRIFTS_M_S = 0.5, 1.0
# For one observer: the time between giving up two robots' beliefs, the largest number, and the time after which one
# more is permitted.
_BETWEEN_S, _AT_MOST, _FORGOTTEN_S = 3.0, 3.0, 10.0
# A sighting counts for this time at most; while seen, a wrong velocity is forgotten with this time constant.
_SEEN_S, _ERROR_FORGOTTEN_S = 0.2, 1.0
# A vehicle's own heading is as good as a sighting's for this time after it was confirmed; a jump of it that the filter
# took for a turn is smaller than this angle (0301).
_CONFIRMED_S, _JUMP_RAD = 5.0, math.radians(40.0)
# While the reported velocity seems wrong by more than this, the heading by which it is turned may be: if it is, then
# that is what the way shows.
_ASTRAY_M_S = 0.1
_FIRST_DOUBT_M_S, _DOUBT_GROWS, _MOST_DOUBT_M_S = 0.2, 2.0, 1.0


@kernel(inlined=True)
def apart_m(sensor: SensorRow, innovation: Innovation) -> float:
    """Return the distance between a sighting and its prediction [m]; angles do not count."""
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
    """Return whether the sighting is at the place of another robot or target: its marker was misread."""
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
        copy_matrix(hypothesis.R, work[0].R)
        linearise(belief, deferred, sensor, event, shared, hypothesis.z, work[0], HP)
        fits = 0.0 <= work[0].nis <= settings.wild_gates * settings.gates[shared]
        found = found or (fits and apart_m(sensor, work[0]) <= _SAME_M)
    event.subject = subject
    return found


@kernel()
def agree(memory: EntityMemory, at: float, rows: int) -> None:
    """Note a sighting within the gate: it ends all contradictions."""
    memory.wild.count = memory.astray.count = memory.refused.count = memory.unconfirmed = 0
    if rows == POSE:
        memory.keeps_heading, memory.heading_at = 1, at


@kernel()
def is_turned(
    belief: Belief, deferred: Deferred, sensor: SensorRow, settings: Settings, event: EventRow, rows: int,
    hypothesis: Hypothesis,
) -> bool:  # fmt: skip
    """Return whether only a sighting's heading contradicts the belief, and the vehicle's own heading does not.

    No vehicle turns so far without turning by its own heading, but a rigid body of motion capture does (0317).
    """
    memory = belief.memory[event.subject]
    if rows != POSE or sensor.is_angle[YAW] == 0 or abs(hypothesis.innovations[0].y[YAW]) < _JUMP_RAD:
        return False
    if memory.keeps_heading == 0 or memory.yaw_age_s > SILENT_S or event.at - memory.heading_at > _CONFIRMED_S:
        return False
    if memory.noted_error > _ASTRAY_M_S:
        return False
    work, HP = np.empty(1, _INNOVATION), np.empty((4, belief.mean.shape[0]))
    copy_matrix(hypothesis.R, work[0].R)
    linearise(belief, deferred, sensor, event, YAW, hypothesis.z, work[0], HP)
    return bool(0.0 <= work[0].nis <= settings.wild_gates * settings.gates[YAW])


@kernel()
def is_doubted(memory: EntityMemory, settings: Settings, at: float) -> bool:
    """Return whether the entity was seen far from its place, or saw landmarks so, more than once and until just now."""
    seen = memory.wild.count >= 2 and at - memory.wild.last <= settings.divergence_s
    return seen or (memory.astray.count >= 2 and at - memory.astray.last <= settings.divergence_s)


@kernel()
def insists(streak: Streak, settings: Settings, at: float) -> bool:
    """Count one more contradiction in a row; True when their number and duration suffice to accept them."""
    if streak.count == 0 or at - streak.last > _IN_A_ROW_S:
        streak.count, streak.since = 0, at
    streak.count += 1
    streak.last = at
    return at - streak.since >= settings.divergence_s and streak.count >= settings.divergence_count


@kernel()
def is_outlier(belief: Belief, sensor: SensorRow, event: EventRow, z: Vector) -> bool:
    """Return whether a reading by bearing puts the subject elsewhere than the contradictions before it.

    It takes one from their count; at zero the next one begins a new row. Boards that give a pose carry checked codes:
    their sightings may be seldom, noisy or by cameras that differ, but are hardly ever of somebody else.
    """
    if sensor.is_angle[X] == 0 and sensor.is_angle[Y] == 0:
        return False
    memory, start, pose = belief.memory[event.subject], belief.entities[event.subject].start, np.zeros(POSE)
    if not call_locate(sensor.locate, (belief, sensor, event, z, pose)):
        return False
    ahead_x, ahead_y = pose[X] - belief.mean[start + X], pose[Y] - belief.mean[start + Y]
    apart, waited_s = math.hypot(ahead_x - memory.wild_x, ahead_y - memory.wild_y), event.at - memory.wild.last
    if memory.wild.count > 0 and waited_s <= _IN_A_ROW_S and apart > _SAME_WAY_M + _DRIFTS_M_S * waited_s:
        memory.wild.count -= 1
        return True
    memory.wild_x, memory.wild_y = ahead_x, ahead_y
    return False


@kernel()
def has_diverged(memory: EntityMemory, settings: Settings, at: float) -> bool:
    """Count a wild innovation of one entity; True when they last long enough to blame the belief.

    `observe` ends the count when the entity is seen within the gate. An entity that joined by one observation and was
    never confirmed cannot outweigh another one.
    """
    if memory.unconfirmed != 0:
        return True
    return insists(memory.wild, settings, at)


@kernel()
def given_up_lately(observer: EntityMemory, at: float) -> float:
    """Return the number of beliefs recently given up for one observer; it sinks by one in 10 s."""
    return max(0.0, observer.gave_up - (at - observer.gave_up_at) / _FORGOTTEN_S)


@kernel()
def is_hasty(observer: EntityMemory, subject: int, at: float) -> bool:
    """Return whether it is too early to give up a robot's belief: another one just was, or there were too many.

    If one camera contradicts several robots at once, the camera is likely wrong; repeated re-initialisation does not
    help a robot either. A robot whose sightings are refused counts as unseen, and flies back or lands.
    """
    lately = given_up_lately(observer, at)
    if lately > 0.0 and observer.gave_up_whom != subject and at - observer.gave_up_at < _BETWEEN_S:
        return True
    return lately > _AT_MOST - 1.0


@kernel()
def note_given_up(observer: EntityMemory, subject: int, at: float) -> None:
    """Note that a robot's belief was given up for one observer's sightings."""
    observer.gave_up = given_up_lately(observer, at) + 1.0
    observer.gave_up_at, observer.gave_up_whom = at, subject


@kernel()
def doubt_velocity(memory: EntityMemory) -> None:
    """Doubt a vehicle's reported velocity, after a fixed camera saw it beyond the gate.

    A single sighting beyond the gate says little about a velocity, and a wild one nothing: such a jump has another
    cause.
    """
    memory.velocity_doubt = min(_MOST_DOUBT_M_S, _FIRST_DOUBT_M_S + _DOUBT_GROWS * memory.velocity_doubt)


@kernel()
def forget_noted_error(memory: EntityMemory, at: float) -> None:
    """Let a noted velocity error decay while the vehicle is seen: if the velocity is still wrong, it is noted again."""
    memory.noted_error *= math.exp(-min(at - memory.corrected_at, _SEEN_S) / _ERROR_FORGOTTEN_S)
    memory.unseen_s = 0.0


@kernel()
def blame(
    belief: Belief, deferred: Deferred, sensor: SensorRow, settings: Settings, event: EventRow, rows: int,
    hypothesis: Hypothesis,
) -> int:  # fmt: skip
    """Return why a wild observation is refused, or PENDING if the subject's belief must be given up for it.

    TURNED: it counts without its heading. belief: that of the first mode; hypothesis: its z and the first mode's noise
    count. A landmark has no belief: PENDING then means that of the robot which reads it (lost_observer.py).
    """
    if belief.entities[event.subject].kind == KIND_LANDMARK:
        if fits_another(belief, deferred, sensor, settings, event, rows, hypothesis):
            return MISTAKEN
        robot = belief.entities[event.observer].kind == KIND_ROBOT
        return PENDING if robot and insists(belief.memory[event.observer].astray, settings, event.at) else IMPLAUSIBLE
    if is_doubted(belief.memory[event.observer], settings, event.at):
        return OBSERVER_DOUBTED
    if fits_another(belief, deferred, sensor, settings, event, rows, hypothesis):
        return MISTAKEN
    subject, robot = belief.memory[event.subject], belief.entities[event.subject].kind == KIND_ROBOT
    confirmed = subject.unconfirmed == 0
    if confirmed and is_turned(belief, deferred, sensor, settings, event, rows, hypothesis):
        subject.heading_at = event.at
        return TURNED
    if confirmed and is_outlier(belief, sensor, event, hypothesis.z):
        return IMPLAUSIBLE
    if not has_diverged(subject, settings, event.at):
        return IMPLAUSIBLE
    if robot and confirmed and is_hasty(belief.memory[event.observer], event.subject, event.at):
        return OBSERVER_HASTY
    return PENDING
