"""Link quality by sequence numbers: losses count, reordering does not."""

import numpy as np
import pytest

from drivers.mavlink.traffic import Traffic

S = 1_000_000_000
MS = 1_000_000


def quality(sequences):
    traffic = Traffic()
    for rank, sequence in enumerate(sequences):
        traffic.count(S + rank * MS, int(sequence) % 256)
    return traffic.rates(S + len(sequences) * MS)[1]


def test_lost_frames_lower_the_link_quality():
    kept = [n for n in range(900) if n % 5]
    assert quality(kept) == pytest.approx(0.8, abs=0.01)


def test_reordered_frames_are_not_lost():
    rng = np.random.default_rng(1)
    order = np.argsort(np.arange(900) + rng.uniform(0.0, 6.0, 900))
    assert quality(order) == pytest.approx(1.0, abs=0.01)


def test_of_reordered_frames_the_lost_ones_are_missing():
    rng = np.random.default_rng(2)
    order = np.argsort(np.arange(900) + rng.uniform(0.0, 6.0, 900))
    assert quality([n for n in order if rng.random() < 0.8]) == pytest.approx(0.8, abs=0.04)


def test_a_restart_is_no_loss():
    assert quality([*range(100), *range(200)]) == pytest.approx(1.0, abs=0.01)
