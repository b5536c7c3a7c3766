"""Numbers of navdata: they rise, or begin anew after a pause."""

import pytest

from drivers.ardrone.link import SequenceFilter

MS = 1_000_000
S = 1_000_000_000


def test_navdata_numbers_must_rise():
    numbers = SequenceFilter()
    now = 10 * S
    assert [numbers.accept(now + i * MS, n) for i, n in enumerate((5, 6, 6, 5, 9, 1))] == [
        True, True, False, False, True, False,
    ]  # fmt: skip
    rate, quality = numbers.arrivals.rates(now + 6 * MS)
    assert rate == 3 and quality == pytest.approx(3 / 5)


def test_a_lower_number_after_a_pause_is_a_new_session():
    numbers = SequenceFilter()
    assert numbers.accept(10 * S, 4_000_000_000)
    assert not numbers.accept(10 * S + 200 * MS, 1)
    assert numbers.accept(10 * S + 301 * MS, 1)
    assert numbers.accept(10 * S + 306 * MS, 2)
    assert numbers.arrivals.rates(20 * S) == (0, None)
