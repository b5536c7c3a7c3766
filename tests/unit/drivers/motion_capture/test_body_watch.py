"""Plausibility of motion capture poses: healthy flight, freezing, jumps, exchanged names."""

import math
import random

from drivers.motion_capture.body_watch import BodyWatch

STEP_NS = 10_000_000


class Hall:
    """Two drones on circles about places 1.5 m apart, 0.6 m/s, with noise of 0.3 mm."""

    def __init__(self) -> None:
        self.watch, self.noise, self.ticks = BodyWatch(5.0), random.Random(1), 0

    def at(self, name: str) -> tuple[float, float, float]:
        angle = self.ticks * 0.006 / 0.5
        x, y = {"a": (0.0, 0.0), "b": (1.5, 0.0)}[name]
        jitter = [self.noise.gauss(0.0, 0.0003) for _ in range(3)]
        return x + 0.5 * math.cos(angle) + jitter[0], y + 0.5 * math.sin(angle) + jitter[1], 1.0 + jitter[2]

    def look(self, **poses: tuple[float, float, float]) -> dict[str, str]:
        self.ticks += 1
        return self.watch.look(self.ticks * STEP_NS, {"a": self.at("a"), "b": self.at("b")} | poses)

    def fly(self, ticks: int = 100) -> None:
        for _ in range(ticks):
            assert set(self.look().values()) == {""}


def test_a_healthy_flight_is_believed_also_with_frames_that_are_lost() -> None:
    hall = Hall()
    hall.fly(1000)
    hall.ticks += 12  # 120 ms without a frame
    hall.fly(100)


def test_a_pose_that_repeats_to_the_last_bit_is_frozen_after_a_fifth_of_a_second() -> None:
    hall = Hall()
    hall.fly()
    frozen = hall.at("a")
    told = [hall.look(a=frozen)["a"] for _ in range(60)]
    assert told[10] == "" and "frozen" in told[25] and "frozen" in told[-1]
    assert hall.look()["b"] == ""


def test_a_body_that_flew_on_while_its_stream_was_frozen_is_believed_at_once() -> None:
    hall = Hall()
    hall.fly()
    frozen = {"a": hall.at("a"), "b": hall.at("b")}
    told = [hall.look(**frozen) for _ in range(150)]
    assert "frozen" in told[-1]["a"] and "frozen" in told[-1]["b"]
    assert math.dist(frozen["a"], hall.at("a")) > 0.5
    hall.fly()


def test_a_jump_is_refused_until_the_body_is_back() -> None:
    hall = Hall()
    hall.fly()

    def aside() -> tuple[float, float, float]:
        x, y, z = hall.at("a")
        return x + 0.4, y, z

    told = [hall.look(a=aside()) for _ in range(300)]
    assert all("jumped by 0.4" in one["a"] and one["b"] == "" for one in told)
    hall.fly()


def test_exchanged_names_are_refused_for_both_until_they_are_exchanged_back_wherever_they_flew() -> None:
    hall = Hall()
    hall.fly()
    told = [hall.look(a=hall.at("b"), b=hall.at("a")) for _ in range(170)]
    assert all("exchanged with that of b" in one["a"] and "exchanged" in one["b"] for one in told)
    hall.fly()


def test_a_body_that_was_out_of_sight_for_long_may_be_anywhere() -> None:
    hall = Hall()
    hall.fly()
    for _ in range(130):
        hall.ticks += 1
        hall.watch.look(hall.ticks * STEP_NS, {"b": hall.at("b")})
    assert hall.look(a=(-2.0, 1.0, 0.1))["a"] == ""
