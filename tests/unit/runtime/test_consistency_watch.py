"""Operator warnings about sensors that contradict the belief for seconds, with the remedy; outliers give none."""

from groundstation.bus.messages import Header, Odometry, Severity, Verdict
from groundstation.bus.notice import Notice
from groundstation.estimation.measurement import Correction
from groundstation.runtime.consistency_watch import ConsistencyWatch

NAMES = ("ceiling", "drone_1", "drone_2", "turtlebot")
RIGHT, FAR = 1.0, 9.0
Pairs = dict[tuple[str, str], float]


class Flight:
    """Observations at 10 Hz with a given NIS per degree of freedom."""

    def __init__(self) -> None:
        self.watch, self.now_ns = ConsistencyWatch(NAMES), 1_000_000_000_000

    def fly(self, seconds: float, pairs: Pairs, joined: bool = False) -> list[Notice]:
        told = []
        for tick in range(round(10 * seconds)):
            self.now_ns += 100_000_000
            seen = [
                Correction(o, s, Verdict.ACCEPTED, residual=(0.1,) * 4, nis=4.0 * nis, joined=joined)
                for (o, s), nis in pairs.items()
            ]
            self.watch.take(seen, self.now_ns)
            if tick % 10 == 9:
                told += self.watch.notices(self.now_ns)
        return told


def test_a_belief_that_agrees_says_nothing_and_a_wild_sighting_now_and_then_neither() -> None:
    flight = Flight()
    for _ in range(10):
        assert flight.fly(2.0, {("ceiling", "drone_1"): RIGHT, ("drone_1", "turtlebot"): 1.5}) == []
        assert flight.fly(0.1, {("ceiling", "drone_1"): 1e6}) == []


def test_a_subject_that_all_contradict_is_named_once_and_called_right_again() -> None:
    flight = Flight()
    both = {("ceiling", "drone_1"): FAR, ("drone_2", "drone_1"): FAR}
    assert flight.fly(2.0, both) == [], "a manoeuvre may last as long"
    (warning,) = flight.fly(20.0, both)
    assert (warning.entity, warning.severity) == ("drone_1", Severity.WARNING)
    assert "ceiling and drone_2" in warning.text and "NIS 9" in warning.text and "marker" in warning.remedy
    (over,) = flight.fly(20.0, dict.fromkeys(both, RIGHT))
    assert (over.entity, over.severity) == ("drone_1", Severity.INFO)


def test_one_camera_against_the_others_is_the_one_that_is_named() -> None:
    for pairs in (
        {("drone_1", "turtlebot"): FAR, ("drone_2", "turtlebot"): RIGHT},
        {("drone_1", "turtlebot"): FAR, ("drone_1", "drone_2"): FAR, ("ceiling", "drone_2"): FAR},
    ):
        told = Flight().fly(10.0, pairs)
        named = {notice.entity for notice in told}
        assert "drone_1" in named and "turtlebot" not in named
        assert all("mounted" in notice.remedy for notice in told if notice.entity == "drone_1")


def test_between_near_and_far_what_was_told_stays_told() -> None:
    flight = Flight()
    pair = ("ceiling", "drone_1")
    assert len(flight.fly(10.0, {pair: FAR})) == 1
    assert flight.fly(20.0, {pair: 3.0}) == [], "neither told again nor withdrawn"
    assert flight.fly(20.0, {}) == [], "and nobody seen proves nothing"


def test_seconds_without_a_sighting_are_none_of_a_contradiction() -> None:
    flight = Flight()
    pair = ("ceiling", "drone_1")
    assert flight.fly(2.0, {pair: FAR}) == []
    flight.fly(30.0, {})
    assert flight.fly(2.0, {pair: FAR}) == [], "what lasts 3 s is told, not what comes again after 30"
    assert len(flight.fly(3.0, {pair: FAR})) == 1


def test_joining_says_nothing_of_the_belief_before_it_and_strangers_are_not_kept() -> None:
    flight = Flight()
    assert flight.fly(10.0, {("ceiling", "drone_1"): FAR}, joined=True) == []
    assert flight.fly(10.0, {("stranger", "drone_1"): FAR, ("ceiling", "ghost"): FAR}) == []


def test_a_sensor_that_hangs_is_named_and_so_is_its_return() -> None:
    flight = Flight()
    header = Header(flight.now_ns, "host", "drone_1", "drone_1", 1)
    frozen = Odometry(
        header=header,
        velocity_m_s=(0.0, 0.0, 0.0),
        velocity_covariance=(1.0,) * 9,
        yaw_rad=0.0,
        roll_rad=0.0,
        pitch_rad=0.0,
    )
    flight.watch.refused(frozen, Verdict.LATE, flight.now_ns)
    assert flight.watch.notices(flight.now_ns) == []
    flight.watch.refused(frozen, Verdict.FROZEN, flight.now_ns)
    (warning,) = flight.watch.notices(flight.now_ns)
    assert warning.entity == "drone_1" and "odometry" in warning.text and warning.remedy
    assert flight.watch.notices(flight.now_ns + 500_000_000) == [], "still within what may be a gap"
    (over,) = flight.watch.notices(flight.now_ns + 2_000_000_000)
    assert over.severity is Severity.INFO
