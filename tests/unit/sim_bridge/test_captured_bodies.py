"""A real body's pose from motion capture frames: extrapolated to now, and not from refused frames."""

import math

import pytest

from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import BodyPose, BodyPoses
from groundstation.bus.topics import BODY_POSES
from sim_bridge.real.captured import CaptureFeed
from sim_bridge.world.puppet import OutsidePose

MS = 1_000_000
HALF = 0.5 * 0.4


class Hall:
    """A system that observes drone_1 on its way along x; times in ms."""

    def __init__(self) -> None:
        exchange = MemoryExchange()
        self._bus = MemoryBus(exchange, "lab", "mocap")
        self.feed = CaptureFeed("drone_1", "mocap", MemoryBus(exchange, "lab", "sim_bridge"))

    def frame(self, at_ms: int, x_m: float, system: str = "mocap", name: str = "drone_1", refused: str = "") -> None:
        body = BodyPose(name, (x_m, 0.2, 1.2), (math.cos(HALF), 0.0, 0.0, math.sin(HALF)))
        why = {name: refused} if refused else {}
        header = self._bus.header(system, at_ms * MS)
        self._bus.publish(BODY_POSES, BodyPoses(header=header, bodies=(body,), refused=why))

    def latest(self, at_ms: int) -> OutsidePose | None:
        return self.feed.latest(at_ms * MS)


@pytest.fixture
def hall() -> Hall:
    return Hall()


def test_a_body_is_carried_on_to_now_by_the_way_between_frames(hall: Hall) -> None:
    hall.frame(1000, 0.50)
    first = hall.latest(1010)
    assert first is not None and first.position == (0.5, 0.2, 1.2) and first.velocity == (0.0, 0.0, 0.0)
    hall.frame(1050, 0.52)
    pose = hall.latest(1075)
    assert pose is not None and pose.velocity == pytest.approx((0.4, 0.0, 0.0))
    assert pose.position == pytest.approx((0.53, 0.2, 1.2)) and pose.attitude == pytest.approx((0.0, 0.0, 0.4))
    assert hall.latest(1080) is None


def test_it_is_carried_on_no_farther_than_a_tenth_of_a_second_and_not_over_a_gap(hall: Hall) -> None:
    hall.frame(1000, 0.50)
    hall.frame(1050, 0.52)
    late = hall.latest(3000)
    assert late is not None and late.position[0] == pytest.approx(0.56)
    hall.frame(4000, 1.0)
    after = hall.latest(4050)
    assert after is not None and after.position[0] == 1.0 and after.velocity == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("wrong", [{"system": "other"}, {"name": "drone_2"}, {"refused": "jumped by 2.5 m"}])
def test_other_systems_other_bodies_and_refused_ones_are_passed_over(hall: Hall, wrong: dict[str, str]) -> None:
    hall.frame(1000, 0.5)
    assert hall.latest(1001) is not None
    hall.frame(1010, 3.0, **wrong)
    assert hall.latest(1011) is None
    hall.feed.close()
