"""Whether plans come, and what the operator is told if they do not."""

from groundstation.control.plan_watch import PlanWatch

TICK_NS = 20_000_000


def told(watch: PlanWatch, ticks: range, stamp_ns: int | None, flying: bool = True) -> list[str]:
    return [n.text for tick in ticks for n in watch.advance(tick * TICK_NS, stamp_ns, flying=flying)]


def test_a_plan_grows_stale_and_the_alarm_is_repeated_until_the_next_one() -> None:
    watch = PlanWatch(1.0)
    assert told(watch, range(51), 0) == [] and not watch.is_stale(50 * TICK_NS)
    assert told(watch, range(51, 320), 0) == 2 * ["no new plan for 1 s: drones that track hover"]
    assert watch.is_stale(320 * TICK_NS)
    assert told(watch, range(320, 330), 320 * TICK_NS) == [] and not watch.is_stale(330 * TICK_NS)


def test_a_planner_that_never_delivers_is_told_as_soon_as_somebody_flies() -> None:
    watch = PlanWatch(1.0)
    assert told(watch, range(200), None, flying=False) == []
    assert len(told(watch, range(200, 210), None)) == 1
