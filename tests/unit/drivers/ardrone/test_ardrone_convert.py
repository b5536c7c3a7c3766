"""Units, frames and signs of the AR.Drone, worked out by hand from docs/reference/ardrone.md 4.5."""

import math

import pytest

from drivers.ardrone.commands import motion_from_attitude, orders_from_decision
from drivers.ardrone.convert import (
    HeadingWatch,
    NavdataMotion,
    charge_from_demo,
    flight_state_from_navdata,
    motion_from_demo,
    says_no_vision,
)
from drivers.ardrone.desired_config import Scale
from drivers.ardrone.velocity_loop import HOVER, AttitudeRequest
from drivers.ardrone.wire import at, options
from drivers.ardrone.wire.errors import WireError
from drivers.ardrone.wire.navdata import Navdata
from drivers.ardrone.wire.state import ControlState, StateBit, join_control_state
from drivers.watchdog_types import Action
from groundstation.bus.messages import FlightState
from groundstation.geometry.angles import quaternion_from_euler
from groundstation.geometry.rotations import rotation_from_euler

FLY = int(StateBit.FLY)
MS = 1_000_000


def packet(state=FLY, altitude=None, phys=None, **demo):
    payloads = [(0, options.DEMO.encode(options.Demo(**demo)))]
    if phys is not None:
        payloads.append((3, options.PHYS_MEASURES.encode(phys)))
    if altitude is not None:
        payloads.append((10, options.ALTITUDE.encode(altitude)))
    return Navdata(state, 1, 0, tuple(payloads))


def motion(**values):
    sent = packet(**values)
    return motion_from_demo(sent, sent.read(options.DEMO))


def test_velocity_forward_right_becomes_forward_left():
    assert motion(vx_mm_s=300.0, vy_mm_s=200.0).velocity_m_s == pytest.approx((0.3, -0.2, 0.0))


def test_climb_comes_from_the_altitude_option():
    result = motion(altitude=options.Altitude(vz_mm_s=250.0), vz_mm_s=-999.0)
    assert result.velocity_m_s[2] == pytest.approx(0.25)
    assert motion(vz_mm_s=-120.0).velocity_m_s[2] == pytest.approx(0.12), "demo mode: body z points down"


def test_nose_up_is_negative_pitch_right_side_down_positive_roll_clockwise_negative_yaw():
    result = motion(theta_mdeg=10_000.0, phi_mdeg=5_000.0, psi_mdeg=90_000.0)
    assert math.degrees(result.pitch_rad) == pytest.approx(-10)
    assert math.degrees(result.roll_rad) == pytest.approx(5)
    assert math.degrees(result.yaw_rad) == pytest.approx(-90)


def test_yaw_stays_in_the_half_open_circle():
    assert motion(psi_mdeg=180_000.0).yaw_rad == pytest.approx(math.pi)
    assert abs(motion(psi_mdeg=-180_000.0).yaw_rad) == pytest.approx(math.pi)


def test_height_is_unknown_on_the_ground_and_until_it_is_measured():
    assert motion(altitude_mm=1250).height_m == pytest.approx(1.25)
    assert motion(altitude_mm=0).height_m is None
    assert motion(altitude_mm=261, state=0).height_m is None


def test_a_drone_at_rest_feels_gravity_upwards():
    result = motion(phys=options.PhysMeasures(accelerations_mg=(100.0, 50.0, -1000.0)))
    assert result.specific_force_m_s2 == pytest.approx((0.980665, -0.4903325, 9.80665))


def test_rates_turn_with_the_axes():
    result = motion(phys=options.PhysMeasures(rates_deg_s=(10.0, 20.0, 30.0)))
    assert [math.degrees(rate) for rate in result.rates_rad_s] == pytest.approx([10, -20, -30])


@pytest.mark.parametrize("field", ["theta_mdeg", "phi_mdeg", "psi_mdeg", "vx_mm_s", "vy_mm_s", "vz_mm_s"])
@pytest.mark.parametrize(
    ("value", "reason"), [(math.nan, "not_finite"), (math.inf, "not_finite"), (1e9, "implausible")]
)
def test_numbers_that_measure_nothing_are_refused(field, value, reason):
    with pytest.raises(WireError) as error:
        motion(**{field: value})
    assert error.value.reason == reason


def test_non_finite_imu_and_climb_are_refused():
    for bad in (
        options.PhysMeasures(rates_deg_s=(0.0, math.nan, 0.0)),
        options.PhysMeasures(accelerations_mg=(math.inf, 0.0, 0.0)),
    ):
        with pytest.raises(WireError):
            motion(phys=bad)
    with pytest.raises(WireError):
        motion(altitude=options.Altitude(vz_mm_s=math.nan))


def test_implausible_rates_accelerations_and_heights_are_refused():
    for bad in (
        options.PhysMeasures(rates_deg_s=(0.0, 3e38, 0.0)),
        options.PhysMeasures(accelerations_mg=(-3e38, 0.0, 0.0)),
    ):
        with pytest.raises(WireError, match="implausible"):
            motion(phys=bad)
    with pytest.raises(WireError, match="implausible"):
        motion(altitude_mm=2**31 - 1)


@pytest.mark.parametrize(
    ("state", "phase", "expected"),
    [
        (0, ControlState.LANDED, FlightState.LANDED),
        (0, None, FlightState.LANDED),
        (0, ControlState.TRANS_TAKEOFF, FlightState.TAKING_OFF),
        (0, ControlState.TRANS_LANDING, FlightState.LANDED),
        (FLY, ControlState.TRANS_TAKEOFF, FlightState.TAKING_OFF),
        (FLY, ControlState.LANDED, FlightState.TAKING_OFF),
        (FLY, ControlState.HOVERING, FlightState.HOVERING),
        (FLY, ControlState.FLYING, FlightState.FLYING),
        (FLY, ControlState.TRANS_GOTOFIX, FlightState.FLYING),
        (FLY, ControlState.TRANS_LANDING, FlightState.LANDING),
        (FLY, ControlState.DEFAULT, FlightState.FLYING),
        (FLY, None, FlightState.FLYING),
        (FLY | StateBit.EMERGENCY, ControlState.FLYING, FlightState.EMERGENCY),
    ],
)
def test_flight_state(state, phase, expected):
    control_state = None if phase is None else join_control_state(phase, 1)
    assert flight_state_from_navdata(state, control_state) is expected


@pytest.mark.parametrize("angles", [(0.1, -0.2, 0.3), (0.0, 0.0, 3.0), (-0.3, 0.2, -2.0)])
def test_quaternion_is_the_rotation_of_the_angles(angles):
    w, x, y, z = quaternion_from_euler(*angles)
    r = rotation_from_euler(*angles)
    assert w * w + x * x + y * y + z * z == pytest.approx(1)
    assert (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)) == pytest.approx(tuple(r[:, 0]))


# -- heading jumps ----------------------------------------------------------------------------------------------------


def turning(yaw_deg, rate_deg_s=0.0, height=1.0):
    rates = (0.0, 0.0, math.radians(rate_deg_s))
    return NavdataMotion((0.0, 0.0, 0.0), 0.0, 0.0, math.radians(yaw_deg), height, rates, (0.0, 0.0, 9.8))


def count_resets(samples, period_ms=5):
    watch = HeadingWatch()
    return [watch.update((i + 1) * period_ms * MS, sample) for i, sample in enumerate(samples)]


def test_the_jump_of_the_recorded_flight_counts_once():
    counts = count_resets([turning(1), turning(1.1), turning(-142.4), turning(-142.3), turning(-142.4)])
    assert counts == [1, 1, 2, 2, 2]


def test_lift_off_counts_by_itself():
    assert count_resets([turning(0, height=None), turning(0, height=None), turning(0), turning(0)]) == [0, 0, 1, 1]


def test_a_height_that_is_missing_in_flight_is_no_new_lift_off():
    flight = [turning(0, height=height)._replace(flies=True) for height in (None, 0.8, None, 0.8, None, None, 0.8)]
    assert count_resets(flight) == [0, 1, 1, 1, 1, 1, 1]
    assert count_resets([*flight, turning(0, height=None), *flight])[-1] == 2, "but the next flight is"


def test_turning_and_wrapping_are_no_jumps():
    turn = [turning((179 + 0.3 * i + 180) % 360 - 180, 60) for i in range(50)]
    assert set(count_resets(turn)) == {1}
    lost_datagrams = [turning(12 * i, 120) for i in range(20)]
    assert set(count_resets(lost_datagrams, period_ms=100)) == {1}


def test_a_silence_voids_the_increment_on_the_floor_and_a_long_one_in_flight():
    assert count_resets([turning(0, height=None), turning(1, height=None)], period_ms=600) == [0, 1]
    assert count_resets([turning(0), turning(50)], period_ms=1500) == [1, 1], "it may have turned on"
    assert count_resets([turning(0), turning(1)], period_ms=6000) == [1, 2]


# -- commands ---------------------------------------------------------------------------------------------------------

SCALE = Scale(tilt_rad=0.2, climb_m_s=0.5, yaw_rate_rad_s=1.0)


def test_forward_left_up_and_counter_clockwise_in_the_drones_signs():
    forward = motion_from_attitude(AttitudeRequest(pitch_rad=0.1), SCALE)
    assert (forward.flags, forward.phi) == (1, 0.0)
    assert forward.theta == pytest.approx(-0.5), "theta < 0 flies forward"
    left = motion_from_attitude(AttitudeRequest(roll_rad=-0.1), SCALE)
    assert left.phi == pytest.approx(-0.5), "phi < 0 flies left"
    other = motion_from_attitude(AttitudeRequest(climb_m_s=0.25, yaw_rate_rad_s=0.5), SCALE)
    assert (other.gaz, other.yaw) == pytest.approx((0.5, -0.5)), "yaw < 0 turns counter-clockwise"
    assert motion_from_attitude(HOVER, SCALE) == at.ProgressiveMotion()


def orders(action, attitude=HOVER, state=0, flight_state=FlightState.HOVERING, stale=False):
    commands = orders_from_decision(action, attitude, state, flight_state, SCALE, stale)
    return {command.name: command.arguments for command in commands}


BASE = 0x11540000
EMERGENCY = int(StateBit.EMERGENCY)


@pytest.mark.parametrize(
    ("action", "state", "flight_state", "bits"),
    [
        (Action.IDLE, 0, FlightState.LANDED, 0),
        (Action.TAKE_OFF, 0, FlightState.LANDED, 1 << 9),
        (Action.TAKE_OFF, EMERGENCY, FlightState.EMERGENCY, 0),
        (Action.CLEAR, EMERGENCY, FlightState.EMERGENCY, 1 << 8),
        (Action.CLEAR, 0, FlightState.LANDED, 0),
        (Action.HOVER, FLY, FlightState.HOVERING, 1 << 9),
        (Action.HOVER, 0, FlightState.LANDED, 0),
        (Action.HOVER, FLY, FlightState.LANDING, 0),
        (Action.FLY, FLY, FlightState.FLYING, 1 << 9),
        (Action.FLY, 0, FlightState.LANDED, 0),
        (Action.LAND, FLY, FlightState.FLYING, 0),
        (Action.CUT, FLY, FlightState.FLYING, 1 << 8),
        (Action.CUT, EMERGENCY, FlightState.EMERGENCY, 0),
    ],
)
def test_reference_bits(action, state, flight_state, bits):
    assert orders(action, state=state, flight_state=flight_state)["REF"] == (BASE | bits,)


def test_only_a_flying_or_hovering_drone_is_steered():
    tilted = AttitudeRequest(pitch_rad=0.1)
    for action in Action:
        flag = orders(action, tilted)["PCMD"][0]
        assert flag == (1 if action in (Action.FLY, Action.HOVER) else 0)
    assert orders(Action.HOVER, HOVER)["PCMD"][0] == 0, "nor one that holds its place by itself"


def test_waiting_says_nothing_about_flying():
    assert list(orders(Action.WAIT)) == ["COMWDG", "PCMD"]
    assert list(orders(Action.IDLE)) == ["REF", "PCMD"]
    assert list(orders(Action.IDLE, state=int(StateBit.COM_WATCHDOG))) == ["COMWDG", "REF", "PCMD"]


@pytest.mark.parametrize("action", list(Action))
def test_a_drone_that_was_not_heard_for_long_is_landed_or_cut_but_never_lifted(action):
    sent = orders(action, state=FLY, stale=True)
    assert ("REF" in sent) is (action in (Action.IDLE, Action.CLEAR, Action.LAND, Action.CUT))
    assert sent.get("REF", (0,))[0] & 1 << 9 == 0
    assert "REF" in sent or list(sent) == ["COMWDG", "PCMD"]


@pytest.mark.parametrize(("percent", "charge"), [(0, 0.0), (73, 0.73), (100, 1.0), (101, None), (4_000_000_000, None)])
def test_a_charge_that_is_no_share_is_not_known(percent: int, charge: float | None) -> None:
    """Garbage counted as a full battery; a drone with unknown charge does not take off."""
    assert charge_from_demo(options.Demo(battery_percent=percent)) == charge


@pytest.mark.parametrize(
    ("phase", "minor", "blind"),
    [(ControlState.FLYING, 6, True), (ControlState.FLYING, 4, False), (ControlState.HOVERING, 6, False)],
)
def test_only_a_flying_drone_says_that_it_has_no_vision(phase, minor, blind):
    assert says_no_vision(join_control_state(phase, minor)) is blind
