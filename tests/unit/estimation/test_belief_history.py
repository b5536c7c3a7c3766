"""Pictures are judged by the belief at their time."""

from dataclasses import replace

import numpy as np

from groundstation.estimation.belief import JointBelief
from groundstation.estimation.belief_history import BeliefHistory
from groundstation.estimation.layout import StateLayout
from groundstation.time_units import NS_PER_MS

BELIEF = JointBelief(np.zeros(0), np.zeros((0, 0)), StateLayout(()), 0)


def test_the_nearest_belief_of_the_last_second_counts() -> None:
    history = BeliefHistory()
    assert history.at(0) is None
    for turn in range(60):
        history.append(replace(BELIEF, stamp_ns=20 * turn * NS_PER_MS))
    found = history.at(911 * NS_PER_MS)
    assert found is not None and found.stamp_ns == 920 * NS_PER_MS
    assert history.at(199 * NS_PER_MS) is None, "older than what is kept"
    assert history.at(1181 * NS_PER_MS) is None, "newer than any belief"


def test_as_old_a_picture_counts_where_beliefs_come_at_200_hz() -> None:
    history = BeliefHistory()
    for turn in range(400):
        history.append(replace(BELIEF, stamp_ns=5 * turn * NS_PER_MS))
    found = history.at(1100 * NS_PER_MS)
    assert found is not None and found.stamp_ns == 1100 * NS_PER_MS
