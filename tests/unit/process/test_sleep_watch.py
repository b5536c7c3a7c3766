"""Detection of a computer's sleep, by two clocks of which one stops."""

from groundstation.process.sleep_watch import SleepWatch

MS, S = 1_000_000, 1_000_000_000


class Clocks:
    def __init__(self) -> None:
        self.awake_ns, self.asleep_ns, self.read_ns = 100 * S, 7 * S, 1000
        self.watch = SleepWatch(self.awake, lambda: self.awake_ns + self.asleep_ns)

    def awake(self) -> int:
        self.awake_ns += self.read_ns
        return self.awake_ns

    def wait(self, awake_s: float, asleep_s: float = 0.0) -> float:
        self.awake_ns += round(awake_s * S)
        self.asleep_ns += round(asleep_s * S)
        return self.watch.slept_s()


def test_a_sleep_is_reported_once_and_none_before_the_start() -> None:
    clocks = Clocks()
    assert clocks.wait(0.0) == 0.0
    assert clocks.wait(10.0) == 0.0, "it was busy, or frozen, and awake"
    assert round(clocks.wait(0.1, 12.0), 3) == 12.0
    assert clocks.wait(0.1) == 0.0


def test_a_pause_between_two_readings_is_no_sleep_and_hides_none() -> None:
    clocks = Clocks()
    clocks.wait(0.0)
    clocks.read_ns = 2 * S
    assert clocks.wait(0.1, 3.0) == 0.0
    clocks.read_ns = 1000
    assert round(clocks.wait(0.1), 3) == 3.0


def test_this_computer_does_not_sleep_now() -> None:
    watch = SleepWatch()
    assert [watch.slept_s() for _ in range(100)] == [0.0] * 100
