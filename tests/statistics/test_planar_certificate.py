"""The planner's certificate on random beliefs: same answer as warm brute force, and no bound above a cost.

With 500 beliefs and no exception, the share of exceptions is below 0.6 % at 95 % confidence (rule of three);
with the 10 000 of `SKEIN_BELIEFS=10000` below 0.03 %.
"""

import os

import pytest

from groundstation.experiments.planar.verification import verify


def test_same_answer_as_brute_force() -> None:
    verdict = verify(100, seed=1)
    assert (verdict.different, verdict.violated) == (0, 0)
    assert verdict.solved_share < 0.5


@pytest.mark.slow
@pytest.mark.statistics
def test_same_answer_as_brute_force_many_times() -> None:
    verdict = verify(int(os.environ.get("SKEIN_BELIEFS", "500")), seed=2)
    assert (verdict.different, verdict.violated) == (0, 0)
