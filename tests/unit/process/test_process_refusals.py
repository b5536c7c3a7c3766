"""Refusals reach the operator once, in words, and not as a flood."""

from groundstation.process.refusals import Refusals
from groundstation.time_units import NS_PER_S

WORDS = {"unsigned": "unsigned frames", "signature": "forged frames"}


def test_counts_that_rise_are_told_once() -> None:
    refusals = Refusals(WORDS)
    assert refusals.news(0, {}) == ""
    assert refusals.news(1, {"unsigned": 3, "truncated": 9}) == "3 unsigned frames"
    assert refusals.news(20 * NS_PER_S, {"unsigned": 3, "truncated": 12}) == ""


def test_a_flood_is_summed_up_every_10_s() -> None:
    refusals = Refusals(WORDS)
    told = [refusals.news(n * NS_PER_S, {"unsigned": 10 * n, "signature": n // 5}) for n in range(1, 22)]
    assert [text for text in told if text] == [
        "10 unsigned frames",
        "100 unsigned frames, 2 forged frames",
        "100 unsigned frames, 2 forged frames",
    ]
