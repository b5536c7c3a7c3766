"""A camera's delay error from headings alone: required robots, time needed, and cases without evidence."""

import math

import numpy as np
import pytest

from groundstation.estimation.camera_latency import LatenessWatch

SECOND = 1_000_000_000


def turning(t: float) -> float:
    return 3.0 + math.sin(1.7 * t) + 0.4 * math.sin(4.0 * t)


def fly(
    watch: LatenessWatch, late_s: float, seconds: float = 40.0, turns: float = 1.0, observer: str = "ceiling",
    subjects: tuple[str, ...] = ("drone_1",), reset_every_s: float = 1e9,
) -> None:  # fmt: skip
    """Feed headings at 100 Hz, pictures at 15 Hz that arrive 0.12 s after their stamp; `late_s` older than stamped."""
    rng = np.random.default_rng(1)
    due = 0.0
    for tick in range(round(100 * seconds)):
        now = 100.0 + tick / 100.0
        reset = int(now / reset_every_s)
        for name in (*subjects, observer):
            if name.startswith("drone"):
                sign = 1.0 if name != observer else -0.6
                own = math.remainder(sign * turns * turning(now) + 2.0 * reset, math.tau)
                watch.turned(name, round(now * SECOND), own, reset)
        if now >= due:
            due = now + 1.0 / 15.0
            stamp = now - 0.12
            for name in subjects:
                seen = turns * turning(stamp - late_s)
                if observer.startswith("drone"):
                    seen += 0.6 * turns * turning(stamp - late_s)
                yaw = math.remainder(seen + rng.normal(0.0, 0.01), math.tau)
                watch.saw(observer, observer, name, round(stamp * SECOND), yaw)


@pytest.mark.parametrize("late_s", [0.0, 0.04, 0.12, -0.05])
def test_the_lateness_of_a_fixed_camera_is_told(late_s: float) -> None:
    watch = LatenessWatch()
    fly(watch, late_s)
    (one,) = watch.told()
    assert one.sensor == "ceiling"
    assert one.offset_s == pytest.approx(late_s, abs=0.005)
    assert 0.0 < one.std_s < 0.01


def test_a_camera_on_a_drone_is_dated_by_the_drones_that_it_sees() -> None:
    watch = LatenessWatch()
    fly(watch, 0.04, observer="drone_2")
    (one,) = watch.told()
    assert one.sensor == "drone_2" and one.offset_s == pytest.approx(0.04, abs=0.005)


def test_lateness_needs_turning_robots_observed_with_heading() -> None:
    watch = LatenessWatch()
    fly(watch, 0.04, turns=0.0)
    assert watch.told() == ()
    watch.saw("ceiling", "ceiling", "turtlebot", 200 * SECOND, 0.0)
    watch.saw("ceiling", "ceiling", "drone_1", 200 * SECOND, None)
    assert watch.told() == ()


def test_a_heading_that_jumps_is_not_taken_for_a_turn() -> None:
    watch = LatenessWatch()
    fly(watch, 0.04, reset_every_s=7.0)
    (one,) = watch.told()
    assert one.offset_s == pytest.approx(0.04, abs=0.006)


def test_a_large_team_costs_no_more_than_four_robots_do() -> None:
    watch = LatenessWatch()
    fly(watch, 0.04, seconds=12.0, subjects=tuple(f"drone_{n}" for n in range(8)))
    (one,) = watch.told()
    assert one.offset_s == pytest.approx(0.04, abs=0.006)
    assert len(watch._sights) == 4
