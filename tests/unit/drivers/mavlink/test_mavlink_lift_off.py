"""Lift-off is detected by a vehicle's height or climb, not by its reported flight state."""

import pytest

from drivers.mavlink.lift_off import LiftOff
from drivers.mavlink.wire.names import Landed

MS = 1_000_000


def hear(lift, seconds, landed, climb_m_s=0.0, begin_m=0.0, starting=True, from_s=0.0):
    """Feed it the telemetry of a steady climb 50 times a second; returns the time of lift-off [s]."""
    for turn in range(round(seconds * 50)):
        elapsed_s = turn / 50
        lift.take(round((from_s + elapsed_s) * 1000) * MS, starting, landed, begin_m + climb_m_s * elapsed_s, climb_m_s)
        if lift.lifted:
            return elapsed_s
    return None


def test_a_word_alone_is_no_lift_off():
    lift = LiftOff()
    assert hear(lift, 2.0, Landed.ON_GROUND, begin_m=0.3) is None
    assert hear(lift, 5.0, Landed.IN_AIR, climb_m_s=0.01, begin_m=0.3, from_s=2.0) is None
    assert hear(lift, 2.0, Landed.IN_AIR, climb_m_s=0.2, begin_m=0.35, from_s=7.0) is not None


def test_a_climb_counts_sooner_than_the_height_that_it_brings():
    lift = LiftOff()
    hear(lift, 1.0, Landed.ON_GROUND)
    assert 0.25 < hear(lift, 2.0, Landed.IN_AIR, climb_m_s=0.12, from_s=1.0) < 0.4


def test_a_jolt_is_no_climb():
    lift = LiftOff()
    hear(lift, 1.0, Landed.ON_GROUND)
    for turn in range(20):
        climb_m_s = 0.4 if turn % 10 < 5 else -0.4  # 0.1 s each
        lift.take(10_000 * MS + turn * 20 * MS, True, Landed.IN_AIR, 0.0, climb_m_s)
    assert not lift.lifted


def test_a_vehicle_without_a_takeoff_command_flies_by_its_own_report():
    lift = LiftOff()  # a driver that was started again in flight
    assert hear(lift, 0.1, Landed.IN_AIR, begin_m=1.2, starting=False) == 0.0


def test_it_stays_lifted_until_it_stands_again():
    lift = LiftOff()
    hear(lift, 1.0, Landed.ON_GROUND)
    hear(lift, 1.0, Landed.TAKE_OFF, climb_m_s=0.4, from_s=1.0)
    lift.take(3_000 * MS, False, Landed.LANDING, 0.02, -0.1)
    assert lift.lifted
    assert lift.take(4_000 * MS, False, Landed.ON_GROUND, 0.04, 0.0) == 0.0
    assert not lift.lifted


def stands(lift, height_m, starting=True):
    """The tracker has it on the floor for half a second, with errors of 3 cm."""
    for turn in range(25):
        lift.take(turn * 20 * MS, starting, Landed.ON_GROUND, 0.0, 0.0)
        lift.see(turn * 20 * MS, (1.0, 2.0, height_m + (0.03 if turn % 2 else -0.03)), 0.2)


def test_observed_height_counts_before_the_reported_flight_state():
    lift = LiftOff()
    stands(lift, 0.06)
    assert lift.stood == pytest.approx((1.0, 2.0, 0.06), abs=0.002)
    lift.take(1_000 * MS, True, Landed.IN_AIR, 0.0, 0.0)
    lift.see(1_000 * MS, (1.0, 2.0, 0.14), 0.2)
    assert not lift.lifted, "sightings err by 3 cm"
    lift.see(1_000 * MS, (1.1, 2.0, 0.17), 0.2)
    assert lift.lifted and lift.stood == pytest.approx((1.0, 2.0, 0.06), abs=0.002)


def climbs_by_its_own_word(lift, age_s, height_m=0.12):
    """For a second it reports 0.13 m/s, and is observed in its place; returns whether it has lifted."""
    for turn in range(26, 76):
        lift.take(turn * 20 * MS, True, Landed.IN_AIR, height_m, 0.13)
        lift.see(turn * 20 * MS, (1.0, 2.0, 0.06), age_s)
    return lift.lifted


def test_its_own_climb_rate_does_not_lift_it_where_cameras_see_it_stand():
    """A real PX4 (SIH) reported 0.13 m/s on the floor, and counted as airborne 1.9 s too early."""
    lift = LiftOff()
    stands(lift, 0.06)
    assert not climbs_by_its_own_word(lift, age_s=0.2)
    assert climbs_by_its_own_word(lift, age_s=0.2, height_m=0.45), "its word alone counts at last"


def test_old_observations_do_not_prevent_the_detection_of_a_lift_off():
    lift = LiftOff()
    stands(lift, 0.06)
    assert climbs_by_its_own_word(lift, age_s=0.8)


def test_a_vehicles_report_decides_lift_off_if_first_observed_airborne():
    lift = LiftOff()
    hear(lift, 1.0, Landed.ON_GROUND)
    for turn in range(20):
        lift.take((1_000 + turn * 20) * MS, True, Landed.IN_AIR, 0.0, 0.13)
        lift.see((1_000 + turn * 20) * MS, (1.0, 2.0, 0.3), 0.1)
    assert lift.lifted


def test_where_it_stood_is_that_of_this_take_off():
    lift = LiftOff()
    stands(lift, 0.06)
    lift.take(2_000 * MS, False, Landed.ON_GROUND, 0.0, 0.0)  # it landed on a table
    assert lift.stood is None
    stands(lift, 0.7)
    assert not lift.lifted and lift.stood == pytest.approx((1.0, 2.0, 0.7), abs=0.002)
