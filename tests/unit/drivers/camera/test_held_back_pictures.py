"""Pictures that a stalled link delivers late, by their arrivals alone: cameras of several rates, and uneven ones."""

import itertools
import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np
import pytest

from drivers.camera.sources import mjpeg
from drivers.camera.sources.held_back import Cadence
from groundstation.time_units import NS_PER_S

DELAY_S = 0.1
Stall = tuple[float, float]


def arrivals(
    exposed_s: Iterable[float], stalls: Sequence[Stall] = (), picture_s: float = 0.011, most_jitter_s: float = 0.01
) -> list[tuple[float, float]]:
    """Return exposure and arrival of each picture; picture_s: how long the link needs for one."""
    random, free_s, found = np.random.default_rng(1), 0.0, []
    for exposed in exposed_s:
        ready = exposed + DELAY_S + random.uniform(-most_jitter_s, most_jitter_s)
        ready = max([ready, *(end for begin, end in stalls if begin <= ready < end)])
        free_s = max(ready, free_s + picture_s)
        found.append((exposed, free_s))
    return found


def shown(pictures: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return when the pictures that are not withheld came [s], and by how much too late [s]."""
    cadence = Cadence()
    return [
        (arrival, arrival - exposed - DELAY_S)
        for exposed, arrival in pictures
        if not cadence.holds_back(round(arrival * NS_PER_S))
    ]


def every(interval_s: float, until_s: float = 60.0) -> list[float]:
    return list(np.arange(0.0, until_s, interval_s))


@pytest.mark.parametrize("picture_s", [0.0, 0.011, 0.02])
@pytest.mark.parametrize("stall_s", [0.4, 0.6, 1.0, 1.9])
@pytest.mark.parametrize("fps", [7, 15, 30])
def test_pictures_that_a_stall_held_back_are_withheld(fps: int, stall_s: float, picture_s: float) -> None:
    if picture_s * fps > 0.5:
        picture_s = 0.5 / fps
    pictures = arrivals(every(1 / fps), [(at, at + stall_s) for at in (10.0, 20.0, 40.0)], picture_s)
    found = shown(pictures)
    assert max(late for _, late in found) < 0.1
    assert all(any(0.0 <= when - at - stall_s < 2.0 * stall_s for when, _ in found) for at in (10.0, 20.0, 40.0))
    prompt = sum(arrival - exposed - DELAY_S < 0.05 for exposed, arrival in pictures)
    assert sum(late < 0.05 for _, late in found) > 0.95 * prompt


def test_a_link_that_stalls_again_while_it_catches_up_shows_none_of_them() -> None:
    stalls = [(10.0, 10.6), (10.63, 11.1)]
    assert max(late for _, late in shown(arrivals(every(1 / 15), stalls, 0.02))) < 0.1


def test_a_camera_that_takes_no_pictures_for_a_while_loses_one_more() -> None:
    exposed = [at for at in every(1 / 15) if not 20.0 < at < 21.0]
    assert len(exposed) - len(shown(arrivals(exposed))) == 1


def alternating(*rates_hz: float) -> list[float]:
    """Return exposures whose rate changes every 10 s."""
    found, now_s = list[float](), 0.0
    while now_s < 60.0:
        now_s += 1.0 / rates_hz[int(now_s / 10.0) % len(rates_hz)]
        found.append(now_s)
    return found


def drawn(interval_s: Callable[[np.random.Generator], float]) -> list[float]:
    random = np.random.default_rng(5)
    return list(itertools.accumulate(interval_s(random) for _ in range(600)))


@pytest.mark.parametrize(
    ("exposed", "lost"),
    [
        (alternating(15, 7), 0.0),
        (alternating(30, 5), 0.01),
        (alternating(30, 2), 0.01),
        (drawn(lambda random: random.uniform(1 / 30, 1 / 10)), 0.0),
        (drawn(lambda random: random.uniform(1 / 30, 0.3)), 0.0),
        (drawn(lambda random: float(np.exp(random.uniform(np.log(0.033), np.log(0.5))))), 0.08),
        (drawn(lambda random: 1 / 15 * (1 + (random.random() < 0.1))), 0.015),
        (drawn(lambda random: 1 / 7 * (1 + (random.random() < 0.1))), 0.015),
    ],
    ids=["dark", "30-5", "30-2", "10-30", "3-30", "2-30", "missing-15", "missing-7"],
)
def test_a_camera_of_another_or_uneven_rate_keeps_its_pictures(exposed: list[float], lost: float) -> None:
    pictures = arrivals(exposed)
    found = shown(pictures)
    assert len(found) >= (1.0 - lost) * len(pictures)
    assert max(after - before for (before, _), (after, _) in itertools.pairwise(found)) < 1.1


@pytest.mark.parametrize("together", [2, 3])
def test_pictures_that_always_come_together_are_shown(together: int) -> None:
    exposed = every(1 / 15)
    pictures = [(at, exposed[min(k - k % together + together - 1, len(exposed) - 1)]) for k, at in enumerate(exposed)]
    assert len(shown(pictures)) == len(pictures)


def test_no_pattern_of_arrivals_withholds_pictures_for_ever() -> None:
    random = np.random.default_rng(3)
    for _ in range(60):
        pattern = random.choice([0.0, 0.005, 0.03, 0.07, 0.3, 0.6, 1.5], random.integers(1, 8))
        times = np.cumsum(np.concatenate([np.full(20, random.choice([0.03, 0.07, 0.2])), np.resize(pattern, 400)]))
        when = [0.0, *(arrival for arrival, _ in shown((at, at) for at in times)), float(times[-1])]
        assert max(after - before for before, after in itertools.pairwise(when)) < 2 * 1.5 + 0.5 + 1.5


@pytest.mark.parametrize("smooth_s", [0.0, 10.0])
@pytest.mark.parametrize(("fps", "bunch_s"), [(30, 0.2), (30, 0.3), (15, 0.25), (15, 0.4)])
@pytest.mark.parametrize("missing", [0.0, 0.05])
def test_pictures_that_begin_to_come_in_bunches_are_soon_shown(
    fps: int, bunch_s: float, missing: float, smooth_s: float
) -> None:
    random = np.random.default_rng(2)
    exposed = [at for at in every(1 / fps, smooth_s + 30.0) if random.random() >= missing]
    ways = [at if at < smooth_s else (math.floor(at / bunch_s) + 1) * bunch_s for at in exposed]
    pictures = [(at, way + random.uniform(0.0, 0.004)) for at, way in zip(exposed, ways, strict=True)]
    found = [when for when, _ in shown(sorted(pictures, key=lambda one: one[1]))]
    apart = [(after - before, before) for before, after in itertools.pairwise(found)]
    assert max(apart)[0] < 3 * bunch_s + 0.5
    assert max(gap for gap, begin in apart if begin > smooth_s + 5.0) < 1.2 * bunch_s


@pytest.mark.parametrize(("slow", "fast", "pause_s"), [(10, 15, 1.8), (15, 30, 1.0), (7, 30, 0.5)])
def test_a_camera_that_is_faster_after_a_pause_is_soon_shown(slow: int, fast: int, pause_s: float) -> None:
    exposed = [*every(1 / slow, 20.0), *(20.0 + pause_s + at for at in every(1 / fast, 20.0))]
    found = [when for when, _ in shown(arrivals(exposed))]
    assert max(after - before for before, after in itertools.pairwise(found)) < 2 * pause_s + 0.8


@pytest.mark.parametrize("end", ["missing", "frozen"])
def test_stamps_that_end_or_stand_still_leave_the_judgement_to_the_cadence(end: str) -> None:
    """Before a stall their pictures are dated by stamps that had proven true; after it, by nothing."""
    dates, delay_ns, period_ns = mjpeg._Dates(), 100_000_000, NS_PER_S // 15
    stall_ns = 45 * period_ns
    held_back = []
    for number in range(70):
        taken_ns = NS_PER_S + number * period_ns
        held = 40 <= number < 45
        arrival_ns = NS_PER_S + (stall_ns if held else number * period_ns) + delay_ns + (number - 40) * held * 5_000_000
        stamp_ns = taken_ns if number < 35 else None if end == "missing" else NS_PER_S + 34 * period_ns
        (unit,) = dates.units([b"jpeg"], [stamp_ns], arrival_ns)
        if 20 <= number < 35:
            assert unit.settled_ns == pytest.approx(taken_ns + delay_ns, abs=1_000_000) and not unit.held_back
        elif number >= 36:
            assert unit.settled_ns == unit.arrival_ns
        held_back += [number] * unit.held_back
    assert held_back and set(held_back) <= {40, 41, 42, 43, 44}
