"""Velocity errors of autopilots: estimated from the belief and corrected, unless only the telemetry is wrong."""

import itertools
import math
import random
import statistics

import pytest

from drivers.mavlink.drift import DriftFeedback
from groundstation.bus.messages import EntityEstimate

S = 1_000_000_000
STEP_NS = 20_000_000
YAW = 0.7


class Vehicle:
    """Follows its setpoints with a lag of 0.4 s, by a velocity of its own [world]."""

    def __init__(self):
        self.now_ns = S
        self.place = [0.0, 0.0, 0.8]
        self.velocity = [0.0, 0.0]
        self.error = (0.0, 0.0)
        self.lie = (0.0, 0.0)
        self.missing = (0.0, 0.0)  # shortfall, in its own velocity as well
        self.feedback = DriftFeedback()
        self.seen = True

    def _world(self, velocity, sign=1.0):
        c, s = math.cos(YAW), sign * math.sin(YAW)
        return c * velocity[0] - s * velocity[1], s * velocity[0] + c * velocity[1]

    def step(self, wanted=None):
        self.now_ns += STEP_NS
        feedback, drift = self.feedback, self.feedback.correction(self.now_ns)
        if wanted is None:
            wanted = feedback.hold(self.now_ns)
        else:
            feedback.let_go()
        told = (wanted[0] + drift[0], wanted[1] + drift[1])
        feedback.note_command(self.now_ns, wanted)
        goal = self._world(told)
        for axis in (0, 1):
            off = self.error[axis] + self.missing[axis]
            self.velocity[axis] += 0.05 * (goal[axis] - off - self.velocity[axis])
            self.place[axis] += self.velocity[axis] * 0.02
        if self.seen:
            entity = EntityEstimate(
                "v", "robot", (*self.place, YAW), (1e-4,) * 16, (*self.velocity, 0.0), True, 0.1
            )  # fmt: skip
            reported = [v + e + lie for v, e, lie in zip(self.velocity, self.error, self.lie, strict=True)]
            feedback.take(self.now_ns, entity, (*self._world(reported, -1.0), 0.0))

    def fly(self, seconds, wanted=None):
        for _ in range(round(seconds * 50)):
            self.step(wanted)


def test_a_place_is_held_although_its_velocity_grows_wrong():
    vehicle = Vehicle()
    vehicle.fly(1.0)
    for _ in range(50):  # 0.5 m/s within a second
        vehicle.error = (vehicle.error[0] + 0.01, 0.0)
        vehicle.step()
    vehicle.fly(2.0)
    assert math.hypot(*vehicle.place[:2]) < 0.3
    vehicle.fly(8.0)
    assert math.hypot(*vehicle.place[:2]) < 0.05
    assert math.hypot(*vehicle.feedback.drift(vehicle.now_ns)[:2]) == pytest.approx(0.5, abs=0.05)


def test_setpoints_are_flown_at_the_true_velocity():
    vehicle = Vehicle()
    vehicle.fly(0.5)
    vehicle.error = (-0.3, 0.3)
    vehicle.fly(3.0, (0.4, 0.0, 0.0))
    assert vehicle._world(vehicle.velocity, -1.0) == pytest.approx((0.4, 0.0), abs=0.03)


def test_a_vehicle_that_flies_slower_than_told_by_its_own_velocity_too_is_told_more():
    """A PX4 whose tilt is wrong by a degree does so for seconds: neither of its velocities is wrong."""
    vehicle = Vehicle()
    vehicle.fly(0.5)
    vehicle.missing = (0.1, 0.15)
    vehicle.fly(5.0, (0.4, 0.0, 0.0))
    assert vehicle._world(vehicle.velocity, -1.0) == pytest.approx((0.4, 0.0), abs=0.03)
    assert vehicle.feedback.drift(vehicle.now_ns) == pytest.approx((0.0, 0.0, 0.0)), "its report is right"


def test_the_velocity_correction_is_limited():
    vehicle = Vehicle()
    vehicle.missing = (0.8, 0.0)
    vehicle.fly(8.0, (0.4, 0.0, 0.0))
    assert math.hypot(*vehicle.feedback.correction(vehicle.now_ns)[:2]) == pytest.approx(0.25, abs=1e-6)


def test_a_healthy_vehicle_is_hardly_told_more_than_asked_as_it_speeds_up_and_stops():
    vehicle, most = Vehicle(), 0.0
    for wanted in ((0.5, 0.0, 0.0), (0.0, 0.0, 0.0), (-0.5, 0.0, 0.0)):
        for _ in range(100):
            vehicle.step(wanted)
            most = max(most, math.hypot(*vehicle.feedback.correction(vehicle.now_ns)[:2]))
    assert most < 0.05


def test_a_report_that_is_wrong_while_it_obeys_is_not_corrected():
    vehicle = Vehicle()
    vehicle.fly(1.0)
    vehicle.lie = (0.4, 0.0)
    vehicle.fly(2.0)
    assert math.hypot(*vehicle.velocity) < 0.05
    assert vehicle.feedback.drift(vehicle.now_ns) == (0.0, 0.0, 0.0)


def test_a_sudden_error_is_no_drift():
    vehicle = Vehicle()
    vehicle.fly(1.0)
    vehicle.error = (0.7, 0.0)
    vehicle.step()
    assert vehicle.feedback.drift(vehicle.now_ns) == (0.0, 0.0, 0.0)


def test_at_lift_off_a_sudden_error_is_corrected_at_once():
    vehicle = Vehicle()
    vehicle.feedback.stand(vehicle.now_ns)
    vehicle.fly(0.5)
    vehicle.error = (0.7, 0.0)
    vehicle.fly(1.0)
    assert math.hypot(*vehicle.feedback.drift(vehicle.now_ns)[:2]) == pytest.approx(0.7, abs=0.15)
    vehicle.fly(3.0)
    vehicle.error = (-0.5, 0.0)
    vehicle.step()
    assert vehicle.feedback.drift(vehicle.now_ns) == (0.0, 0.0, 0.0), "three seconds later it is no drift"


def test_an_error_that_changes_evenly_is_corrected_by_what_it_is_by_now():
    """The belief contains an error 0.45 s late."""
    feedback, grows_m_s2, late_s = DriftFeedback(), 0.2, 0.45
    for turn in range(200):
        learnt = grows_m_s2 * (turn * 0.02 - late_s)
        entity = EntityEstimate("v", "robot", (0.0, 0.0, 0.8, 0.0), (1e-4,) * 16, (0.1, 0.0, 0.0), True, 0.1)
        feedback.note_command(S + turn * STEP_NS, (0.1, 0.0, 0.0))
        feedback.take(S + turn * STEP_NS, entity, (0.1 + learnt, 0.0, 0.0))
    now = grows_m_s2 * 199 * 0.02
    assert feedback.correction(S + 199 * STEP_NS)[0] == pytest.approx(now, abs=0.03)
    assert feedback.drift(S + 199 * STEP_NS)[0] < now - 0.09, "what it was seen to be"


class Climber:
    """Rises at 0.1 m/s, its own climb rate off by an error; cameras measure its height, the belief uses its rate."""

    def __init__(self):
        self.feedback, self.now_ns, self.height_m = DriftFeedback(), S, 0.8

    def rise(self, *errors_m_s):
        for error in errors_m_s:
            self.now_ns += STEP_NS
            self.height_m += 0.02 * 0.1
            place = (0.0, 0.0, self.height_m, 0.0)
            entity = EntityEstimate("v", "robot", place, (1e-4,) * 16, (0.0, 0.0, 0.1 + error), True, 0.1)
            self.feedback.take(self.now_ns, entity, (0.0, 0.0, 0.1 + error))

    @property
    def corrected(self):
        return self.feedback.correction(self.now_ns)[2]


def test_an_error_of_a_climb_rate_is_found_by_heights_within_half_a_second():
    """A real PX4's sways from -0.2 to +0.2 m/s within two seconds: a late correction adds to it."""
    climber = Climber()
    climber.rise(*[-0.2] * 150)
    assert climber.corrected == pytest.approx(-0.2, abs=0.02)
    climber.rise(*[0.2] * 25)
    assert climber.corrected == pytest.approx(0.2, abs=0.05)


def test_heights_that_are_noisy_by_a_centimetre_hardly_move_the_correction_of_a_climb():
    climber, noise, corrected = Climber(), random.Random(1), []
    for _ in range(500):
        climber.height_m += (offset := noise.gauss(0.0, 0.01))
        climber.rise(0.0)
        climber.height_m -= offset
        corrected.append(climber.corrected)
    assert statistics.pstdev(corrected[100:]) < 0.04


def test_a_step_of_the_believed_height_is_no_climb():
    climber = Climber()
    climber.rise(*[0.1] * 100)
    climber.height_m += 0.5
    climber.rise(*[0.1] * 10)
    assert climber.corrected == pytest.approx(0.1, abs=0.02)


def test_an_error_of_a_climb_rate_counts_from_lift_off_on():
    climber = Climber()
    climber.feedback.stand(climber.now_ns)
    climber.rise(*[0.1] * 100)
    assert climber.corrected == 0.0
    climber.feedback.lift()
    assert climber.corrected == pytest.approx(0.1, abs=0.01)


def test_an_error_beyond_what_is_corrected_is_corrected_as_far():
    """Without any correction the error is largest, and a correction dropped at a limit is a step of that size."""
    vehicle = Vehicle()
    vehicle.fly(1.0)
    corrected = []
    for _ in range(200):  # 2 m/s within four seconds
        vehicle.error = (vehicle.error[0] + 0.01, 0.0)
        vehicle.step()
        corrected.append(math.hypot(*vehicle.feedback.correction(vehicle.now_ns)[:2]))
    assert max(corrected) == pytest.approx(1.5)
    assert max(abs(b - a) for a, b in itertools.pairwise(corrected)) < 0.05
    assert math.hypot(*vehicle.velocity) < 0.7


def test_without_the_tracker_no_more_is_corrected_than_is_left_of_an_error_and_no_place_is_held():
    """Of a measured estimator's error 0.73, 0.33 and 0.09 remain 0.5, 1 and 1.5 s after its observation."""
    vehicle = Vehicle()
    vehicle.error = (0.3, 0.0)
    vehicle.fly(3.0)
    vehicle.seen, left = False, []
    vehicle.fly(0.4)  # the last observation was 0.1 s old
    for _ in range(3):
        left.append(math.hypot(*vehicle.feedback.drift(vehicle.now_ns)) / 0.3)
        vehicle.fly(0.5)
    assert left == pytest.approx([0.73, 0.33, 0.09], abs=0.08)
    assert vehicle.feedback.hold(vehicle.now_ns) == (0.0, 0.0, 0.0)


def test_on_the_floor_nothing_is_known():
    vehicle = Vehicle()
    vehicle.error = (0.3, 0.0)
    vehicle.fly(2.0)
    vehicle.feedback.reset()
    assert vehicle.feedback.drift(vehicle.now_ns) == (0.0, 0.0, 0.0)
    assert vehicle.feedback.place(vehicle.now_ns) is None


def test_the_error_of_a_climb_rate_is_corrected_up_to_a_limit():
    for error, corrected in ((0.2, 0.2), (0.9, 0.3)):
        climber = Climber()
        climber.rise(*[error] * 150)
        assert climber.feedback.drift(climber.now_ns)[2] == pytest.approx(corrected, abs=0.01)


def test_a_place_that_is_given_is_held_instead_of_the_one_where_it_comes_to_rest():
    vehicle = Vehicle()
    vehicle.fly(1.0)
    vehicle.feedback.hold_at((0.3, -0.1, 0.8))
    vehicle.fly(8.0)
    assert vehicle.place[:2] == pytest.approx((0.3, -0.1), abs=0.03)


@pytest.mark.parametrize("seen", [True, False])
def test_a_hover_that_begins_in_flight_holds_the_place_where_it_comes_to_rest(seen):
    """Held where it began, the vehicle would fly back by 0.2 m. Pictures come ten times a second, 0.2 s late."""
    vehicle = Vehicle()
    vehicle.fly(3.0, wanted=(0.5, 0.0))
    vehicle.seen, began, shown = seen, tuple(vehicle.place), []
    for step in range(400):
        x, y, z = vehicle.place
        shown.append((x, y, z))
        if not seen and step % 5 == 0:
            vehicle.feedback.see_place(vehicle.now_ns, shown[max(0, step - 10)], YAW)
        vehicle.step()
    farthest = max(math.dist(place[:2], began[:2]) for place in shown)
    assert math.hypot(*vehicle.velocity) < 0.02
    assert math.dist(vehicle.place[:2], began[:2]) > farthest - 0.07


def test_a_vehicle_that_drifts_as_its_hover_begins_is_held_a_second_later():
    vehicle = Vehicle()
    vehicle.fly(0.5)
    vehicle.feedback.let_go()
    vehicle.seen, vehicle.error = False, (-0.15, 0.0)
    for _ in range(500):
        x, y, z = vehicle.place
        vehicle.feedback.see_place(vehicle.now_ns, (x, y, z), YAW)
        vehicle.step()
    assert math.hypot(*vehicle.velocity) < 0.02 and math.hypot(*vehicle.place[:2]) < 0.4


def test_a_vehicle_whose_velocity_nobody_knows_holds_its_place_by_pictures():
    """Ten a second, 0.2 s late; holding by its own velocity alone it flies off at that velocity's error."""
    vehicle = Vehicle()
    vehicle.seen, vehicle.error = False, (-0.15, 0.05)
    shown = []
    for step in range(500):
        x, y, z = vehicle.place
        shown.append((x, y, z))
        if step % 5 == 0 and step >= 10:
            vehicle.feedback.see_place(vehicle.now_ns, shown[step - 10], YAW)
        vehicle.step()
    assert math.hypot(*vehicle.velocity) < 0.02
    assert math.hypot(*vehicle.place[:2]) < 0.3


def test_a_vehicle_moved_while_hovering_holds_its_new_place():
    vehicle = Vehicle()
    for _ in range(150):
        vehicle.step()
    for _ in range(100):
        wanted = vehicle.feedback.hold(vehicle.now_ns, back=(0.1, -0.05))
        assert wanted[:2] == (0.1, -0.05)
        vehicle.place = [one + 0.02 * v for one, v in zip(vehicle.place[:2], (0.1, -0.05), strict=True)] + [0.8]
        vehicle.now_ns += STEP_NS
        entity = EntityEstimate("v", "robot", (*vehicle.place, YAW), (1e-4,) * 16, (0.0, 0.0, 0.0), True, 0.1)
        vehicle.feedback.take(vehicle.now_ns, entity, (0.0, 0.0, 0.0))
    assert math.hypot(*vehicle.feedback.hold(vehicle.now_ns)[:2]) < 0.01
