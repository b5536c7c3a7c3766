"""A vehicle's clock that jumps is told from telemetry that a radio has kept for a while."""

import pytest

from drivers.mavlink.texts import BootClock

MS = 1_000_000


def jumps(*arrivals: tuple[int, int]) -> list[int]:
    """Take (our time, vehicle's time) [ms]; return the jumps."""
    clock = BootClock()
    return [clock.take(now_ms * MS, boot_ms) for now_ms, boot_ms in arrivals]


def test_frames_that_a_radio_kept_are_no_jump_nor_are_those_in_time_again() -> None:
    """As recorded from an ArduCopter behind a SiK radio that carried its parameters."""
    assert jumps((0, 5000), (4050, 7514), (4930, 9710), (5930, 10_930)) == [0, 0, 0, 0]


def test_lateness_that_grows_by_little_steps_may_end_at_once() -> None:
    assert jumps(*((n * 1000, n * 400) for n in range(6)), (5100, 5100)) == [0] * 7


@pytest.mark.parametrize("late_ms", [0, 1500])
def test_a_clock_that_is_set_forward_jumps_however_late_it_was(late_ms: int) -> None:
    assert jumps((0, 5000), (4000, 9000 - late_ms), (4100, 12_100)) == [0, 0, 3000 + late_ms]


def test_a_clock_that_begins_anew_jumps_after_a_gap_too() -> None:
    assert jumps((0, 5000), (100, 100)) == [0, -5000]
    assert jumps((0, 5000), (400_000, 9000)) == [0, -396_000]


def test_of_two_vehicles_with_one_id_each_change_is_told() -> None:
    assert jumps((0, 5000), (20, 11_020), (40, 5040), (60, 11_060)) == [0, 6000, -6000, 6000]


@pytest.mark.parametrize(
    ("stamps_ms", "jump_ms", "why"),
    [
        ([1000, 1020], -14_980, "it stood still, or its telemetry was held back"),
        ([90_000, 500], -104_500, "it restarted, or two vehicles share its system id"),
        ([1000, 60_000], 44_000, "it restarted, or two vehicles share its system id"),
    ],
)
def test_a_clock_that_goes_on_behind_after_a_pause_belongs_to_no_restart(
    stamps_ms: list[int], jump_ms: int, why: str
) -> None:
    clock = BootClock()
    first, second = stamps_ms
    assert clock.take(10_000 * MS, first) == 0
    assert (clock.take(25_000 * MS, second), clock.why) == (jump_ms, why)
    assert clock.restarted is (second < first)
