"""Commands to an autopilot: HOLD in a climb stops it at once, a plain hover continues to the requested height."""

import pytest

from drivers.mavlink.commands import Orders
from drivers.mavlink.requests import Requests
from drivers.mavlink.settings import VehicleSettings
from drivers.mavlink.wire.names import ARMED, Flavour, Landed, MavCmd, guided_mode
from drivers.watchdog_types import Action, DriverMode, WatchdogDecision
from groundstation.bus.messages import EntityEstimate

SURE = (1e-4, *(0.0,) * 4, 1e-4, *(0.0,) * 4, 1e-4, *(0.0,) * 4, 1e-4)
TAKE_OFF_M = 0.8


class Climb:
    """Follows its setpoints; seen: the tracker knows its position; sluggish: by 1 m/s^2, not at once."""

    def __init__(self, flavour, seen, sluggish=False):
        vehicle = VehicleSettings(name="v", system_id=1, flavour=flavour.name.lower(), take_off_m=TAKE_OFF_M)
        self.flavour, self.seen = flavour, seen
        self.orders = Orders(vehicle, flavour, Requests(1))
        self.now_ns, self.height_m, self.climb_m_s = 10**9, 0.0, 0.0
        self._most_m_s = 0.05 if sluggish else 10.0

    def turn(self, mode, action):
        self.now_ns += 50_000_000
        if self.seen:
            place = EntityEstimate(name="v", kind="robot", mean=(0.0, 0.0, self.height_m, 0.0), covariance=SURE,
                                   velocity_m_s=(0.0, 0.0, self.climb_m_s), converged=True, age_s=0.0)  # fmt: skip
            self.orders.see(self.now_ns, place, (0.0, 0.0, self.climb_m_s))
        landed = Landed.IN_AIR if self.height_m > 0.02 else Landed.ON_GROUND
        told = self.orders.step(
            self.now_ns, WatchdogDecision(mode, action), ARMED, guided_mode(self.flavour), landed, self.height_m,
            self.climb_m_s,
        )  # fmt: skip
        if told is not None:
            self._go(-told.vz)
        elif self.flavour is Flavour.ARDUPILOT and action is Action.TAKE_OFF:
            self._go(0.4)  # by its own take-off
        self.height_m = max(0.0, self.height_m + 0.05 * self.climb_m_s)

    def _go(self, climb_m_s):
        self.climb_m_s += max(-self._most_m_s, min(self._most_m_s, climb_m_s - self.climb_m_s))

    def rise_to(self, height_m):
        for _ in range(200):
            if self.height_m >= height_m:
                return
            self.turn(DriverMode.TAKING_OFF, Action.TAKE_OFF)
        raise AssertionError("it did not climb")


@pytest.mark.parametrize("seen", [True, False])
@pytest.mark.parametrize("flavour", [Flavour.PX4, Flavour.ARDUPILOT])
def test_hold_in_a_climb_stops_it_where_it_is(flavour, seen):
    climb = Climb(flavour, seen)
    climb.rise_to(0.3)
    for _ in range(60):
        climb.turn(DriverMode.HOLD, Action.HOVER)
    assert 0.2 <= climb.height_m <= 0.45
    assert abs(climb.climb_m_s) < 0.02


@pytest.mark.parametrize("lifted_m", [0.04, 0.15])
@pytest.mark.parametrize("flavour", [Flavour.PX4, Flavour.ARDUPILOT])
def test_hold_in_a_climb_with_momentum_does_not_take_it_back_to_the_floor(flavour, lifted_m):
    """A real ArduCopter rose from 0.13 to 0.72 m, and sank to 0.10 m again."""
    climb = Climb(flavour, True, sluggish=True)
    climb.rise_to(lifted_m)
    heights = []
    for _ in range(120):
        climb.turn(DriverMode.HOLD, Action.HOVER)
        heights.append(climb.height_m)
    assert max(heights) > lifted_m + 0.02, "it has momentum"
    assert climb.height_m > max(heights) - 0.04
    assert abs(climb.climb_m_s) < 0.02


@pytest.mark.parametrize("seen", [True, False])
def test_a_hover_after_the_take_off_goes_on_to_its_height_and_a_later_hold_keeps_it(seen):
    climb = Climb(Flavour.PX4, seen)
    climb.rise_to(0.3)
    for _ in range(100):
        climb.turn(DriverMode.HOVER, Action.HOVER)
    assert climb.height_m == pytest.approx(TAKE_OFF_M, abs=0.08)
    reached_m = climb.height_m
    for _ in range(40):
        climb.turn(DriverMode.HOLD, Action.HOVER)
    assert climb.height_m == pytest.approx(reached_m, abs=0.05)


@pytest.mark.parametrize("flavour", [Flavour.PX4, Flavour.ARDUPILOT])
def test_a_track_in_the_climb_ends_it_since_heights_are_the_trackers_from_then_on(flavour):
    climb = Climb(flavour, seen=True)
    climb.rise_to(0.3)
    for _ in range(40):
        climb.turn(DriverMode.TRACK, Action.FLY)  # commanded to stay where it is
    assert climb.height_m == pytest.approx(0.3, abs=0.05)


def test_an_ardupilot_that_ends_its_take_off_is_told_nothing_and_so_not_judged_by_it():
    climb = Climb(Flavour.ARDUPILOT, seen=True)
    climb.rise_to(0.3)
    climb.turn(DriverMode.HOVER, Action.HOVER)
    assert climb.orders.climbs_by_itself(climb.now_ns)
    climb.height_m = TAKE_OFF_M + 0.1
    climb.turn(DriverMode.HOVER, Action.HOVER)
    assert not climb.orders.climbs_by_itself(climb.now_ns)
    px4 = Climb(Flavour.PX4, seen=True)
    px4.rise_to(0.3)
    px4.turn(DriverMode.HOVER, Action.HOVER)
    assert not px4.orders.climbs_by_itself(px4.now_ns)


@pytest.mark.parametrize(("flavour", "pilots"), [(Flavour.PX4, 3 << 16), (Flavour.ARDUPILOT, 5)])
def test_what_a_pilot_flies_is_not_taken_for_missing_of_our_commands(flavour, pilots):
    """It was asked to stand meanwhile; after RESUME it flew off by the difference, beyond the limiter's margin."""
    orders, guided = Climb(flavour, True).orders, guided_mode(flavour)
    told = []
    for turn in range(450):
        now_ns = 10**9 + turn * 20_000_000
        flown_m_s = -1.0 if 100 <= turn < 250 else 0.0
        place = EntityEstimate("v", "robot", (0.0, 0.0, 0.8, 0.0), SURE, (flown_m_s, 0.0, 0.0), True, 0.1)
        orders.see(now_ns, place, (flown_m_s, 0.0, 0.0))
        resumed = turn >= 300
        decision = WatchdogDecision(DriverMode.TRACK, Action.FLY, setpoint_ns=turn + 1, entered_ns=1 + resumed)
        mode = pilots if 100 <= turn < 300 else guided
        setpoint = orders.step(now_ns, decision, ARMED, mode, Landed.IN_AIR, 0.8)
        told += [setpoint.vx] if resumed and setpoint is not None else []
    assert len(told) > 30 and max(map(abs, told)) < 0.01


def stands(orders, seconds, action, mode, reported=(0.2, 0.0, 0.1), at_m=(0.0, 0.0)):
    """Let it stand somewhere, motors on, with a velocity of its own; returns its last setpoint."""
    told = None
    for turn in range(round(seconds * 20)):
        now_ns = 10**9 + turn * 50_000_000
        place = EntityEstimate("v", "robot", (*at_m, 0.02, 0.0), SURE, (0.0, 0.0, 0.0), True, 0.1)
        orders.see(now_ns, place, reported)
        decision = WatchdogDecision(mode, action)
        # PX4 reports flight long before it flies.
        landed = Landed.IN_AIR if action is Action.TAKE_OFF and turn > 20 else Landed.ON_GROUND
        told = orders.step(now_ns, decision, ARMED, guided_mode(Flavour.PX4), landed, 0.0) or told
    return told


def px4():
    vehicle = VehicleSettings(name="v", system_id=1, flavour="px4", take_off_m=TAKE_OFF_M)
    return Orders(vehicle, Flavour.PX4, Requests(1))


def test_on_the_floor_an_error_of_its_velocity_is_corrected_before_it_leans_against_it():
    orders = px4()
    told = stands(orders, 3.0, Action.TAKE_OFF, DriverMode.TAKING_OFF)
    assert not orders.lift.lifted
    assert told.vx == pytest.approx(0.2, abs=0.02) and told.vy == pytest.approx(0.0, abs=0.02)
    assert told.vz == pytest.approx(-0.4), "what its climb rate sways by there is left alone"


def test_drift_is_not_corrected_on_the_floor_without_a_takeoff_command():
    orders = px4()
    stands(orders, 1.0, Action.IDLE, DriverMode.LANDED)
    assert orders.drift.drift(2 * 10**9) == (0.0, 0.0, 0.0)


def test_a_disarm_that_nobody_acknowledged_is_not_repeated_into_the_take_off_after_it():
    vehicle = VehicleSettings(name="v", system_id=1, flavour="ardupilot", take_off_m=TAKE_OFF_M)
    requests = Requests(1)
    orders = Orders(vehicle, Flavour.ARDUPILOT, requests)

    def asked(now_s, mode, action):
        now_ns = round(now_s * 1e9)
        guided = guided_mode(Flavour.ARDUPILOT)
        orders.step(now_ns, WatchdogDecision(mode, action), ARMED, guided, Landed.ON_GROUND, 0.0)
        return [(one.command, one.param1) for one in requests.due(now_ns)]

    disarm = (MavCmd.COMPONENT_ARM_DISARM, 0.0)
    assert disarm in asked(1.0, DriverMode.CUT, Action.CUT)
    for tenth in range(1, 30):
        assert disarm not in asked(1.0 + 0.1 * tenth, DriverMode.TAKING_OFF, Action.TAKE_OFF)


@pytest.mark.parametrize("flavour", [Flavour.PX4, Flavour.ARDUPILOT])
def test_one_that_flies_although_its_motors_were_cut_does_not_fly_on_at_its_last_velocity(flavour):
    climb = Climb(flavour, seen=True)
    climb.rise_to(0.6)
    fast = WatchdogDecision(DriverMode.TRACK, Action.FLY, (0.5, 0.0, 0.0), setpoint_ns=1, entered_ns=1)
    where = (ARMED, guided_mode(flavour), Landed.IN_AIR, 0.8)
    told = climb.orders.step(climb.now_ns + 10**8, fast, *where)
    assert told is not None and told.vx == pytest.approx(0.5, abs=0.1)
    told = climb.orders.step(climb.now_ns + 2 * 10**8, WatchdogDecision(DriverMode.CUT, Action.CUT), *where)
    assert told is not None and told.vx == pytest.approx(0.0, abs=0.1)


def test_a_change_of_mode_is_explained_by_what_was_said_before_it_and_by_nothing_later():
    orders = px4()
    decision = WatchdogDecision(DriverMode.HOVER, Action.HOVER)
    for tenth in range(40):
        now_ns, left = 10**9 + tenth * 10**8, tenth >= 10
        if tenth in (9, 20):
            orders.said.take(now_ns, "Failsafe: Hold" if tenth == 9 else "something else")
        orders.step(now_ns, decision, ARMED, 4 << 16 if left else guided_mode(Flavour.PX4), Landed.IN_AIR, 1.0)
    ((_, told),) = orders.events
    assert told.endswith("not ours to fly until RESUME (Failsafe: Hold)")
    assert orders.yields.endswith("not ours to fly until RESUME")
