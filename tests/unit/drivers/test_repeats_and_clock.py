"""How long a value, a velocity or a vehicle's clock has been constant, and how late values are: exact to the packet."""

import math

import pytest

from drivers.plausibility.clock_watch import ClockWatch
from drivers.plausibility.health import Finding, Health, HealthReport, Sensor
from drivers.plausibility.repeats import RepeatWatch, StandstillWatch

MS, S = 1_000_000, 1_000_000_000
LEAN_RAD = 0.1
LEAN_M_S2 = 9.80665 * math.tan(LEAN_RAD)


def held(watch, values, every_ms=10, begins_ms=1000):
    """Return for how long each value had been constant at its arrival [s]."""
    return [watch.update((begins_ms + i * every_ms) * MS, value) for i, value in enumerate(values)]


# -- repetition -------------------------------------------------------------------------------------------------------


def test_the_fourth_of_equal_values_stands_since_the_first():
    assert held(RepeatWatch(), [1.0] * 6) == pytest.approx([0.0, 0.0, 0.0, 0.03, 0.04, 0.05])
    assert held(RepeatWatch(), [1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 1.0]) == pytest.approx([0.0] * 6 + [0.03, 0.0])


def test_a_value_that_did_not_come_for_longer_than_the_gap_stands_anew():
    assert held(RepeatWatch(), [1.0] * 5, every_ms=300) == pytest.approx([0.0, 0.0, 0.0, 0.9, 1.2])
    assert held(RepeatWatch(), [1.0] * 5, every_ms=301) == [0.0] * 5
    assert held(RepeatWatch(gap_s=0.1), [1.0] * 5, every_ms=101) == [0.0] * 5


def test_values_before_a_reset_do_not_count():
    watch = RepeatWatch()
    held(watch, [1.0] * 4)
    watch.reset()
    assert held(watch, [1.0] * 4, begins_ms=1040) == pytest.approx([0.0, 0.0, 0.0, 0.03])


def stood(watch, velocities, lean_rad=LEAN_RAD, begins_ms=1000):
    """Return (how long it had been constant, change of speed by the tilt) at each velocity."""
    return [watch.update((begins_ms + i * 10) * MS, speed, lean_rad) for i, speed in enumerate(velocities)]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_tilt_tells_by_how_much_a_standing_velocity_should_have_changed(sign):
    found = stood(StandstillWatch(), [0.3] * 8, sign * LEAN_RAD)
    assert [at for at, _ in found] == pytest.approx([0.0, 0.0, 0.0, 0.03, 0.04, 0.05, 0.06, 0.07])
    assert [change for _, change in found] == pytest.approx([0.01 * LEAN_M_S2 * max(0, i - 2) for i in range(8)])


def test_the_change_of_speed_is_counted_anew_where_the_velocity_moved_or_the_watch_began_anew():
    watch = StandstillWatch()
    *_, moved, _, _, again = stood(watch, [0.3] * 6 + [0.4] * 4)
    assert moved == (0.0, 0.0) and again == pytest.approx((0.03, 0.01 * LEAN_M_S2))
    watch.reset()
    assert stood(watch, [0.4] * 4, begins_ms=1100)[-1] == pytest.approx((0.03, 0.01 * LEAN_M_S2))


# -- the vehicle's clock ----------------------------------------------------------------------------------------------


def test_a_clock_stands_since_it_last_moved():
    watch = ClockWatch()
    assert [watch.update((10 + i) * S, min(i, 2) * S)[0] for i in range(5)] == pytest.approx([0.0, 0.0, 0.0, 1.0, 2.0])


def late(watch, *spans):
    """Return the lateness told at the end of each span: (its length [s], lateness of its values [s]), 10 Hz."""
    told, at_ns = [], max(1000 * S, watch._least_at_ns)
    for length_s, late_s in spans:
        for _ in range(round(10 * length_s)):
            at_ns += S // 10
            found = watch.update(at_ns, at_ns - 900 * S - round(late_s * S))[1]
        told.append(found)
    return told


@pytest.mark.parametrize("slower", [200e-6, 0.005])
def test_lateness_is_kept_for_minutes_and_forgotten_as_slow_clocks_demand(slower):
    watch = ClockWatch(slower=slower)
    late(watch, (5.0, 0.0))
    watch.update(watch._least_at_ns + 2 * S, watch._least_at_ns - 900 * S + S // 10)
    told = late(watch, (20.0, 2.0), (200.0, 2.0))
    assert told == pytest.approx([2.0 - 22.0 * slower, 2.0 - 222.0 * slower], abs=0.02)


def test_a_lag_that_grows_slowly_is_seen():
    watch = ClockWatch()
    grows = [(0.1, 0.02 * at_s / 10) for at_s in range(600)]
    assert late(watch, *grows)[-1] == pytest.approx(1.2, abs=0.05)


def test_a_clock_that_runs_slower_than_ours_is_not_late():
    watch = ClockWatch(slower=0.005)
    assert max(late(watch, *[(1.0, 0.004 * at_s) for at_s in range(300)])) < 0.01


def test_fresher_values_define_the_usual_delay_once_three_in_a_row_are():
    watch = ClockWatch()
    told = late(watch, (1.0, 0.5), (0.1, 0.0), (1.0, 0.5))
    assert told == pytest.approx([0.0] * 3, abs=1e-3), "a single one may have a wrong stamp"
    assert late(watch, (0.3, 0.0), (0.5, 0.5)) == pytest.approx([0.0, 0.5], abs=1e-3)


def test_a_clock_that_was_set_back_counts_anew_after_two_minutes():
    watch = ClockWatch()
    told = late(watch, (5.0, 0.0), (100.0, 2.0), (21.0, 2.0), (5.0, 2.0))
    assert told == pytest.approx([0.0, 2.0, 0.0, 0.0], abs=0.06)


def test_one_that_was_delayed_meanwhile_never_goes_back():
    watch = ClockWatch()
    late(watch, (5.0, 0.0))
    at_ns = 1005 * S + 1200 * MS
    told = [watch.update(at_ns + i * S // 10, at_ns + i * S // 10 - 901_200 * MS)[1] for i in range(1, 2000)]
    assert min(told) > 1.0, "a silence of 1.2 s, and that late from then on"


def test_a_clock_set_back_over_three_seconds_counts_as_a_restart():
    watch = ClockWatch()
    watch.update(100 * S, 50 * S)
    assert watch.update(101 * S, 47 * S) == pytest.approx((0.0, 4.0), abs=1e-3)
    assert watch.update(102 * S, 44 * S - 1) == (0.0, 0.0)
    assert watch.update(103 * S, 45 * S - 1) == (0.0, 0.0)
    assert watch.update(104 * S, 45 * S - 1) == pytest.approx((1.0, 1.0), abs=1e-3), "judged by what came since"


def test_a_clock_that_starts_over_goes_on_each_time_and_may_still_be_late():
    watch = ClockWatch(wrap_s=10.0)
    told = [watch.update((100 + i) * S, (i % 10) * S) for i in range(35)]
    assert told == [(0.0, 0.0)] * 35
    assert watch.update(135 * S, 4 * S + S // 2) == pytest.approx((0.0, 0.5), abs=1e-3)
    assert watch.update(136 * S, 4 * S) == pytest.approx((0.0, 2.0), abs=2e-3), "half a second back is no turn"


def test_lateness_is_kept_when_the_clock_wraps():
    """Fresh for 4 s, then a second late, while a clock of 4 s wraps twice."""
    watch = ClockWatch(wrap_s=4.0)
    told = [watch.update((100 + at_s) * S, (at_s % 4) * S)[1] for at_s in range(4)]
    told += [watch.update((100 + at_s) * S, ((at_s - 1) % 4) * S)[1] for at_s in range(5, 12)]
    assert told == pytest.approx([0.0] * 4 + [1.0] * 7, abs=0.01)


# -- reported texts ---------------------------------------------------------------------------------------------------


def test_a_reason_is_told_of_what_is_bad_enough_and_asked_for():
    stuck = Finding(Sensor.VELOCITY, Health.BAD, "stuck")
    report = HealthReport((stuck, Finding(Sensor.CLOCK, Health.SUSPECT, "late")))
    both, clock = frozenset({Sensor.VELOCITY, Sensor.CLOCK}), frozenset({Sensor.CLOCK})
    assert report.reason(Health.BAD, both) == "stuck" and report.reason(Health.BAD, clock) == ""
    assert report.reason(Health.SUSPECT, clock) == "late" and report.reason(Health.SUSPECT, both) == "stuck"
    assert report.of(Sensor.CLOCK) is Health.SUSPECT and report.of(Sensor.IMU) is Health.GOOD
    assert Health.GOOD < Health.SUSPECT < Health.BAD
