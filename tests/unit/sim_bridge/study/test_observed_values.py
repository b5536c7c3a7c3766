"""The time from which a wrong value shows in a vehicle's reports, and the fault that it is credited to."""

from typing import Any

import pytest

from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.study.faults.observed import ObservedValues
from sim_bridge.world.readings import Readings

PERIOD_S = 0.05


def fault(kind: str, **more: Any) -> Fault:
    given: dict[str, Any] = {"entity": "a", "start_s": 10.0} | more
    return Fault(kind=FaultKind(kind), **given)


def shown_s(*faults: Fault) -> list[float | None]:
    """Return when each fault shows, in reports of a drone that stands until 12 s and then flies forward."""
    values = ObservedValues(faults)
    for n in range(400):
        t = n * PERIOD_S
        values.report(t, Readings(n, (0.3 if t > 12 else 0.0, 0.0, 0.0), 0, 0, 0, (0, 0, 0), (0, 0, 9.8), 1.0))
    return [values.observable_s(one) for one in faults]


def test_a_stuck_velocity_shows_once_the_drone_moves() -> None:
    stuck, frozen = fault("velocity_stuck"), fault("telemetry_frozen", start_s=30.0)
    values = ObservedValues((stuck, frozen))
    for n in range(400):
        t = n * PERIOD_S
        honest = Readings(n, (0.3 if t > 12 else 0.0, 0.0, 0.0), 0, 0, 0, (0, 0, 0), (0, 0, 9.8), 1.0)
        values.report(t, honest)
    assert values.observable_s(stuck) == pytest.approx(12.05)
    assert values.observable_s(frozen) == 30.0
    assert ObservedValues((stuck,)).observable_s(stuck) is None


@pytest.mark.parametrize(
    ("other", "its_s"),
    [
        (fault("heading_jumping", value=30.0), 10.0),
        (fault("velocity_jumping", value=0.5, direction_deg=90.0, end_s=11.0), 10.0),
        (fault("battery_stuck", value=0.1), 10.0),
        (fault("battery_stuck", value=0.95), None),
    ],
    ids=lambda value: value.kind if isinstance(value, Fault) else "",
)
def test_what_another_fault_does_is_not_credited_to_a_stuck_velocity(other: Fault, its_s: float | None) -> None:
    found = shown_s(fault("velocity_stuck", start_s=10.1), other)
    assert found[0] == pytest.approx(12.05) and found[1] == (its_s and pytest.approx(its_s))


def test_a_fault_that_another_one_covers_does_not_show() -> None:
    assert shown_s(fault("velocity_jumping", value=0.5), fault("velocity_stuck")) == [None, pytest.approx(12.05)]


def test_of_two_that_do_the_same_both_show() -> None:
    assert shown_s(fault("velocity_stuck"), fault("uniform_floor")) == pytest.approx([12.05, 12.05])


def test_two_that_cancel_out_do_not_show() -> None:
    against = fault("velocity_jumping", value=0.5, direction_deg=180.0)
    assert shown_s(fault("velocity_jumping", value=0.5), against) == [None, None]


def over_a_floor(speed_m_s: float, report: float) -> float | None:
    """Return when a uniform floor from 10 s on shows below a level drone at a constant speed."""
    floor = fault("uniform_floor", value=report)
    values = ObservedValues((floor,))
    for n in range(round(14.0 / 0.005)):
        honest = Readings(n, (speed_m_s, 0.0, 0.0), 0, 0, 0, (0, 0, 0), (0, 0, 9.8), 1.0)
        values.report(n * 0.005, honest)
    return values.observable_s(floor)


def test_noise_about_zero_shows_at_once_where_no_drone_could_brake_so() -> None:
    assert over_a_floor(0.35, 1.0) == pytest.approx(10.05, abs=0.05)
    assert over_a_floor(0.15, 1.0) is None


def test_an_integral_of_the_tilts_shows_in_means_beyond_what_healthy_floors_mislead_by() -> None:
    # It leaks within 2 s: 0.3 m/s (1 - exp(-t / 2 s)) are missing, a quarter of a second later in the mean.
    assert over_a_floor(0.3, 2.0) == pytest.approx(10.0 + 2.6 + 0.25, abs=0.2)
    assert over_a_floor(0.2, 2.0) is None
