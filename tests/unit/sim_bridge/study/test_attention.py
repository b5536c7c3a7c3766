"""At message level a camera searches as its driver does: rarely all over, and where the belief has a marker."""

import msgspec
import pytest

from groundstation.bus.messages import EntityEstimate, Estimate, Header, TargetSearch
from groundstation.field.resolved import ResolvedField
from sim_bridge.mounting import generator_of_eye
from sim_bridge.scenario import Scenario, parse_scenario
from sim_bridge.site import parse_site
from sim_bridge.study.camera_model import Eye
from sim_bridge.world.world import World

FRAME_NS = 66_666_667
PLACE = (1.2, 0.0)


def scenario() -> Scenario:
    return parse_scenario('{"schema_version": 1, "cameras": {"frame_loss": 0.0, "mounting_errors": false}}')


class Lab:
    """The lab with a drone in the air that looks at the target, and its camera's observations."""

    def __init__(self, field: ResolvedField) -> None:
        site, told = parse_site(msgspec.to_builtins(field)), scenario()
        self.world = World(site, told, 1)
        frame = self.world.drones["drone_1"].airframe
        frame.x, frame.y, frame.z, frame.yaw = 0.0, 0.0, 1.3, 0.0
        mount = site.drones["drone_1"]
        assert mount.camera is not None
        self.eye = Eye(
            "drone_1", mount.camera.calibration, mount, site, told.cameras, 0.0, generator_of_eye(1, "drone_1")
        )
        self.frames = 0

    def look(self, count: int) -> tuple[int, int | None]:
        """Return the number of pictures searched whole, and the first one that shows the target."""
        searches, first = 0, None
        for k in range(count):
            stamp_ns = self.frames * FRAME_NS
            self.world.ticks = round(stamp_ns / 5e6)
            seen = self.eye.look(self.world, stamp_ns, "c")
            searches += self.eye.searched(seen, stamp_ns, "c") is not None
            if first is None and any(sighting.subject == "turtlebot" for sighting in seen):
                first = k
            self.frames += 1
        return searches, first

    def take(self, place: tuple[float, float] | None, age_s: float, *searched: str) -> None:
        """Give the camera the target's believed position, for the next second."""
        covariance = tuple(0.0004 if row == column else 0.0 for row in range(4) for column in range(4))
        mean = (0.0, 0.0, 1.3, 0.0)
        entities = [EntityEstimate("drone_1", "robot", mean, covariance, (0.0, 0.0, 0.0), True, 0.1)]
        mean = (-3.0, 2.0, 1.3, 0.0)
        entities.append(EntityEstimate("drone_2", "robot", mean, covariance, (0.0, 0.0, 0.0), True, 0.1))
        if place is not None:
            flat = (0.0025, 0.0, 0.0, 0.0025)
            entities.append(EntityEstimate("turtlebot", "target", place, flat, (0.0, 0.0), True, age_s))
        searches = tuple(TargetSearch(name, "SEARCH", 1.0, (0.0, 0.0), 0.1, None, "") for name in searched)
        for k in range(0, 60, 3):
            header = Header((self.frames + k) * FRAME_NS, "c", "team", "tracker", k)
            self.eye.take(Estimate(header=header, entities=tuple(entities), epoch=1, searches=searches))


@pytest.fixture
def lab(lab_field: ResolvedField) -> Lab:
    lab = Lab(lab_field)
    lab.world.targets["turtlebot"].place(9.0, 9.0)
    return lab


def test_a_camera_that_hears_nothing_searches_twice_a_second(lab: Lab) -> None:
    assert lab.look(60)[0] == 8


def test_a_camera_that_sees_nobody_says_so_twice_a_second_wherever_the_belief_has_them(lab: Lab) -> None:
    lab.take((-3.0, -2.0), 0.1)
    assert lab.look(60)[0] == 8


def test_a_camera_that_sees_all_that_it_should_searches_seldom(lab: Lab) -> None:
    lab.world.targets["turtlebot"].place(*PLACE)
    lab.take(PLACE, 0.1)
    lab.look(10)
    assert lab.look(50)[0] <= 2


@pytest.mark.parametrize(("place", "age_s", "searched"), [((-3.0, -2.0), 0.8, ()), (None, 0.0, ("turtlebot",))])
def test_a_target_that_no_camera_sees_is_found_in_the_second_picture(
    lab: Lab, place: tuple[float, float] | None, age_s: float, searched: tuple[str, ...]
) -> None:
    lab.look(1)
    lab.take(place, age_s, *searched)
    assert lab.look(59)[0] == 30
    lab.world.targets["turtlebot"].place(*PLACE)
    assert lab.look(3)[1] in (0, 1)


def test_a_marker_is_found_at_once_where_the_belief_has_it_and_only_there(lab: Lab) -> None:
    lab.look(1)
    lab.world.targets["turtlebot"].place(*PLACE)
    lab.take((PLACE[0] + 0.05, PLACE[1]), 0.1)
    assert lab.look(1) == (0, 0)


def test_a_marker_is_not_found_at_once_where_the_belief_does_not_have_it(lab: Lab) -> None:
    lab.take((-3.0, -2.0), 0.1)
    lab.look(5)
    lab.world.targets["turtlebot"].place(*PLACE)
    lab.take((-3.0, -2.0), 0.1)
    assert lab.look(5) == (0, None)
