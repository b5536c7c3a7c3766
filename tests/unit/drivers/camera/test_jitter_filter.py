"""Clocks that are put forward a little, links that recover, and links whose delay changes all the time."""

import numpy as np
import pytest

from drivers.camera.sources.jitter_filter import SenderClock

MS = 1_000_000
FPS = 15


def errors_ms(delays_ms: np.ndarray, ahead_ms: float = 0.0, batch: int = 1) -> np.ndarray:
    """Return the errors of the settled times from the 300th frame on; `ahead_ms`: the clock's jump before that one.

    The usual delay is 120 ms. batch: so many frames arrive together.
    """
    clock, wrong, waiting = SenderClock(), [], []
    for index, delay_ms in enumerate(delays_ms):
        exposed_ms = 1000.0 * index / FPS
        waiting.append((exposed_ms, round((exposed_ms + ahead_ms * (index >= 300)) * MS)))
        if len(waiting) == batch:
            settled = clock.settle([sent for _, sent in waiting], round((exposed_ms + delay_ms) * MS))
            wrong += [when / MS - exposed - 120.0 for when, (exposed, _) in zip(settled, waiting, strict=True)]
            waiting = []
    return np.array(wrong[300:])


def jitter(count: int = 600, seed: int = 1) -> np.ndarray:
    return 120.0 + np.random.default_rng(seed).uniform(-12.0, 12.0, count)


@pytest.mark.parametrize("batch", [1, 2])
@pytest.mark.parametrize("ahead_ms", [60.0, 100.0, 300.0, 900.0])
def test_a_clock_that_is_put_forward_by_part_of_a_second_dates_no_picture_late(ahead_ms: float, batch: int) -> None:
    """As by network time: 56 pictures in a row were dated 100 ms and more too late."""
    assert np.abs(errors_ms(jitter(320), ahead_ms, batch)).max() < 16.0
    assert np.median(np.abs(errors_ms(jitter(), ahead_ms, batch))) < 3.0


def test_a_clock_that_is_put_forward_while_a_frame_is_lost_is_noticed() -> None:
    clock, wrong = SenderClock(), []
    for index, delay_ms in enumerate(jitter()):
        exposed_ms = 1000.0 * index / FPS
        if index not in (300, 301):
            (settled,) = clock.settle(
                [round((exposed_ms + 200.0 * (index >= 300)) * MS)], round((exposed_ms + delay_ms) * MS)
            )
            wrong.append(settled / MS - exposed_ms - 120.0)
    assert np.abs(wrong[300:]).max() < 16.0


def test_a_link_that_recovers_dates_few_pictures_late() -> None:
    """From 400 to 120 ms: the median was that of the congestion for five more seconds."""
    delays = jitter()
    delays[:300] += 280.0
    wrong = np.abs(errors_ms(delays))
    assert wrong.max() < 16.0


@pytest.mark.parametrize(("quiet_ms", "frames"), [(60.0, 45), (60.0, 20), (30.0, 20)])
def test_a_link_that_is_quick_for_seconds_at_a_time_does_not_move_the_exposure(quiet_ms: float, frames: int) -> None:
    """Its stamps tell when pictures were sent; the mean of the arrivals of some seconds does not."""
    delays = jitter(900)
    delays[(np.arange(900) // frames) % 3 == 0] += quiet_ms - 120.0
    assert np.sqrt(np.mean(np.square(errors_ms(delays)))) < 15.0


def test_lost_frames_are_no_jump_of_the_clock() -> None:
    random, clock, wrong = np.random.default_rng(2), SenderClock(), []
    for index, delay_ms in enumerate(120.0 + random.exponential(40.0, 900) - 40.0 * np.log(2.0)):
        exposed_ms = 1000.0 * index / FPS
        if random.random() > 0.2:
            (settled,) = clock.settle([round(exposed_ms * MS)], round((exposed_ms + delay_ms) * MS))
            wrong.append(settled / MS - exposed_ms - 120.0)
    assert np.abs(wrong[60:]).max() < 16.0
