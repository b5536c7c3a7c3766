"""Sightings of a target that teach nothing about velocities: only a robot that nobody sees sees it (decision 0374).

Such a robot sees the target move relative to itself. It cannot know which of the two moved otherwise than predicted; a
target that turns does so more often, and by more, than a model with white acceleration noise expects.
"""

import numpy as np

from groundstation.arrays import IntVector, Matrix
from groundstation.estimation.filter_state import Belief, Deferred
from groundstation.estimation.records import KIND_ROBOT, KIND_TARGET, EventRow, Innovation
from groundstation.estimation.update import correct
from groundstation.kernel import kernel

# A robot in view is seen more often; and for how long a target that somebody in view saw counts as known [s].
_SEEN_S, _KNOWN_S = 0.2, 0.5


@kernel(inlined=True)
def is_unseen(belief: Belief, e: int) -> bool:
    """Return whether an entity is a robot that nobody sees."""
    return bool(belief.entities[e].kind == KIND_ROBOT and belief.memory[e].unseen_s > _SEEN_S)


@kernel(inlined=True)
def note_witness(belief: Belief, event: EventRow) -> None:
    """Note that a target was seen by somebody who is seen, or is fixed in the room."""
    if not is_unseen(belief, event.observer):
        target = belief.memory[event.subject]
        target.witnessed_at, target.witness = event.at, event.observer


@kernel(inlined=True)
def is_unwitnessed(belief: Belief, event: EventRow) -> bool:
    """Return whether an observation is of a target that lately only robots have seen that nobody sees."""
    if belief.entities[event.subject].kind != KIND_TARGET or not is_unseen(belief, event.observer):
        return False
    target = belief.memory[event.subject]
    return bool(target.witness == event.observer or event.at - target.witnessed_at > _KNOWN_S)


@kernel()
def velocity_errors(belief: Belief, at: IntVector) -> int:
    """Write the entries of the velocity errors of all unseen robots; returns their number."""
    count = 0
    for e in range(belief.entities.shape[0]):
        entity = belief.entities[e]
        if belief.memory[e].active != 0 and entity.at_velocity_bias_x >= 0 and is_unseen(belief, e):
            at[count], at[count + 1] = (
                entity.start + entity.at_velocity_bias_x,
                entity.start + entity.at_velocity_bias_y,
            )
            count += 2
    return count


@kernel()
def correct_all_but_velocities(
    belief: Belief, deferred: Deferred, headings: IntVector, innovation: Innovation, HP: Matrix, factor: float
) -> None:  # fmt: skip
    """Apply a linearised correction that leaves the velocity errors of unseen robots, and their covariance, as before.

    Schmidt's consider update: their rows of the gain are taken as zero. P differs from that of the full correction,
    P - V^T V, in their own block alone.
    """
    at = np.empty(belief.mean.shape[0], np.int64)
    count, rows = velocity_errors(belief, at), innovation.prediction.size
    kept = belief.mean[at[:count]]
    correct(belief, deferred, headings, innovation, HP, factor)
    V = deferred.V[deferred.used[0] - rows : deferred.used[0]]
    for a in range(count):
        belief.mean[at[a]] = kept[a]
        for b in range(count):
            for i in range(rows):
                belief.P[at[a], at[b]] += V[i, at[a]] * V[i, at[b]]
