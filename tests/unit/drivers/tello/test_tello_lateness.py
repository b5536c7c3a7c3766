"""Late telemetry of a Tello, by the whole seconds that its motors ran: found, and never where there is none."""

import dataclasses
import random

import pytest

from drivers.plausibility.health import Health, Sensor
from drivers.plausibility.motion import MotionMonitor, MotionSample
from drivers.plausibility.tick_watch import TickWatch
from drivers.tello.driver import LIMITS
from drivers.tello.wire.text import State
from drivers.watchdog_types import Action, DriverMode, WatchdogDecision
from groundstation.bus.messages import FlightState
from sim_bridge.devices.tello_text import state_text

S = 1_000_000_000
FLIGHT_S = 900.0


def states(seconds, rate=1.0, lost=0.0, jitter_s=0.03, seed=1):
    """Yield when each state of a flight was made, by our clock [s], and its count; 10 Hz, rate: of its counter."""
    draw = random.Random(seed)
    for number in range(round(10 * seconds)):
        made_s = 0.1 * number + draw.uniform(0.0, 0.01)
        if draw.random() >= lost:
            yield made_s, int(rate * (0.37 + made_s)), draw.uniform(0.0, jitter_s)


def delayed(told, delay):
    """Yield arrival [s] and count; delay(made_s): of the link. Nothing overtakes."""
    last_s = 0.0
    for made_s, count, jitter_s in told:
        last_s = max(last_s, made_s + delay(made_s) + jitter_s)
        yield last_s, count


def judged(arrivals):
    """Return the health of the clock at each arrival."""
    monitor, found = MotionMonitor(LIMITS), []
    for k, (at_s, count) in enumerate(arrivals):
        inertial = (0.001 * k, 0.0, -1.0)
        sample = MotionSample(S + round(at_s * S), (0.1, 0.0), 0.0, 0.0, inertial, counted_s=count)
        found.append((at_s, monitor.update(sample, FlightState.FLYING).of(Sensor.CLOCK)))
    return found


def stalls(*spans):
    """Return the delay of a link that holds back what was sent in some spans (begin, length) [s] until their end."""

    def delay(made_s):
        return next((begin + length - made_s for begin, length in spans if begin <= made_s < begin + length), 0.0)

    return delay


@pytest.mark.parametrize("rate", [0.95, 0.98, 0.99, 0.995, 1.0, 1.01, 1.02, 1.05])
@pytest.mark.parametrize("lost", [0.0, 0.3])
def test_a_healthy_one_is_never_late_whatever_the_rate_of_its_counter(rate, lost):
    found = judged(delayed(states(FLIGHT_S, rate, lost), lambda _: 0.0))
    assert {health for _, health in found} == {Health.GOOD}


@pytest.mark.parametrize("length_s", [0.5, 1.7, 2.3, 2.99])
@pytest.mark.parametrize("rate", [0.98, 1.0, 1.02])
def test_after_a_stall_of_the_link_a_healthy_one_is_not_bad(length_s, rate):
    """What was held back comes at once: the verdict is over before the driver's next turn, and all doubt with the
    next step of the counter."""
    spans = [(begin_s + 0.1 * k, length_s) for k, begin_s in enumerate(range(20, 120, 10))]
    found = judged(delayed(states(140.0, rate), stalls(*spans)))
    for begin_s, _ in spans:
        end_s = begin_s + length_s
        after = [(at_s, health) for at_s, health in found if end_s + 0.05 < at_s < end_s + 5.0]
        assert max(health for _, health in after) < Health.BAD
        assert {health for at_s, health in after if at_s > end_s + 1.2} == {Health.GOOD}


@pytest.mark.parametrize("rate", [0.98, 1.0, 1.02])
def test_a_delay_that_grows_is_found(rate):
    """By our clock the queue grows by 0.23 s/s, and the usual delay by 0.05: 1 s and a packet more after 6.3 s. Steps
    come every 1.3 s, and the second one counts."""
    found = judged(delayed(states(60.0, rate), lambda at_s: 0.3 * max(0.0, at_s - 30.0)))
    bad_s = next(at_s for at_s, health in found if health is Health.BAD)
    assert 33.0 <= bad_s <= 30.0 + 6.4 + 2 * 1.35
    assert found[-1][1] is Health.BAD


def test_a_delay_that_stays_is_kept_until_it_has_landed():
    found = judged(delayed(states(60.0), lambda at_s: 1.6 if at_s > 30.0 else 0.0))
    bad = [at_s for at_s, health in found if health is Health.BAD]
    assert bad[0] < 34.0 and bad[-1] - bad[0] > 4.0, "it lands after 3 s"


def test_one_late_step_alone_is_not_bad():
    watch = TickWatch()
    for k in range(5):
        assert watch.update(k * S, k) == (0.0, 0.0)
    watch.update(6 * S + S // 2, 4)
    assert watch.update(6 * S + 6 * S // 10, 5) == pytest.approx((1.4, 0.0), abs=0.1)
    assert watch.update(7 * S + 4 * S // 10, 5) == pytest.approx((1.4, 0.0), abs=0.1), "no step, nothing new"
    assert watch.update(7 * S + 5 * S // 10, 6) == pytest.approx((1.2, 1.2), abs=0.1)
    assert watch.update(7 * S + 51 * S // 100, 7) == pytest.approx((0.3, 0.3), abs=0.1)


def test_a_counter_that_starts_over_or_is_set_is_compared_anew():
    watch = TickWatch()
    for k in range(1, 5):
        watch.update(k * S, 100 + k)
    for k in range(5, 9):
        assert watch.update(k * S, k) == (0.0, 0.0)
    for k in range(9, 12):
        assert watch.update(k * S, 50 + k) == (0.0, 0.0)


def test_the_driver_takes_late_telemetry_for_silence(flight):
    still = State(-3, 2, -120, (0, 0, 0), 71, 50, 82, 14, (17.0, -4.0, -956.0))
    tello, k = flight.tello, 0
    tello.apply(S, WatchdogDecision(DriverMode.HOVER, Action.HOVER))
    for k, (at_s, count) in enumerate(delayed(states(40.0), lambda at_s: 0.3 * max(0.0, at_s - 30.0))):
        state = dataclasses.replace(still, time=count, acceleration=(17.0, -4.0, -956.0 - k % 7))
        tello._hear_state(S + round(at_s * S), state_text(state))
        if at_s < 30.0:
            assert tello.view(S + round(at_s * S)).unsound == ""
    assert k and "s late" in tello.view(S + round(at_s * S)).unsound
