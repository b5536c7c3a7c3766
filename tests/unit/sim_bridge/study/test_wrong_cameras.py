"""Cameras with wrong pictures: what they show, and from when on it shows."""

from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import pytest

from groundstation.bus.messages import Header, RelativeObservation
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.study.faults.wrong_cameras import WrongEye


def fault(kind: str, **more: Any) -> Fault:
    given: dict[str, Any] = {"entity": "a", "start_s": 10.0} | more
    return Fault(kind=FaultKind(kind), **given)


class Eye:
    """Gives one observation after the other; sees: whether anybody is in view, arrived: whether the picture comes."""

    name, period_s = "a", 0.1
    sees = arrived = True

    def __init__(self) -> None:
        self.bumps: list[float] = []
        self.n = 0

    def searched(self, *_picture: Any) -> Any:
        return "searched"

    def bump(self, angle_deg: float, axis_deg: float) -> None:
        self.bumps.append(angle_deg)

    def look(self, world: Any, stamp_ns: int, clock: str) -> list[Any]:
        if not (self.sees and self.arrived):
            return []
        self.n += 1
        header = Header(stamp_ns, clock, "a", "a_camera", self.n)
        return [
            RelativeObservation(
                header=header, observer="a", subject="b", camera="a_camera", position_m=(float(self.n), 0.0, 1.0),
                yaw_rad=0.0, covariance=(1.0, *(0.0,) * 4, 1.0, *(0.0,) * 4, 1.0, *(0.0,) * 4, 1.0), margin=2.0,
                roll_rad=0.0, pitch_rad=0.0,
            )
        ]  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "seen"),
    [
        ("picture_frozen", [1, 1, 1, 4]),
        *((kind, [1, 4]) for kind in ("picture_black", "camera_stall", "camera_held_back")),
    ],
)
def test_wrong_pictures_at_message_level(kind: str, seen: list[float]) -> None:
    eye: Any = Eye()
    camera = WrongEye(eye, [fault(kind, start_s=1.0, end_s=3.0)])
    found = []
    for t in (0.5, 1.0, 2.0, 3.0):
        world: Any = SimpleNamespace(time_s=t, drones=())
        eye.n = round(t)  # content of an honest picture
        found += camera.look(world, int(t * 1e9), "c")
    assert [one.position_m[0] for one in found] == seen
    assert len({(one.header.stamp_ns, one.header.seq) for one in found}) == len(found)


def test_a_black_picture_does_not_count_as_searched() -> None:
    camera = WrongEye(eye := Eye(), [fault("picture_black", start_s=1.0)])  # type: ignore[arg-type]
    told = []
    for t in (0.5, 1.5):
        world: Any = SimpleNamespace(time_s=t, drones=())
        told.append(camera.searched(camera.look(world, 0, "c"), 0, "c"))
    assert told == [eye.searched(), None]


def test_a_vehicles_camera_that_hangs_trembles_until_its_driver_knows_it() -> None:
    eye: Any = Eye()
    camera, found = WrongEye(eye, [fault("picture_frozen", start_s=1.0)]), []
    for k in range(40):
        world: Any = SimpleNamespace(time_s=0.5 + 0.1 * k, drones={camera.name: None})
        found += camera.look(world, int(k * 1e8), "c")
    unknown, known = found[5:20], found[20:]
    assert all(a.position_m != b.position_m for a, b in pairwise(unknown))
    assert {one.picture_ns for one in unknown} == {0} and {one.picture_ns for one in known} == {400_000_000}


def test_a_frozen_picture_shows_once_it_repeats_somebody() -> None:
    frozen, black = fault("picture_frozen", start_s=1.0), fault("picture_black", start_s=1.0)
    eye: Any = Eye()
    camera = WrongEye(eye, [frozen])
    assert camera.observable_s(frozen) is None
    for t in (0.5, 1.5, 2.0):
        world: Any = SimpleNamespace(time_s=t, drones=())
        camera.look(world, 0, "c")
    assert (camera.observable_s(frozen), camera.observable_s(black)) == (1.5, 1.0)


def test_a_bumped_camera_stays_turned_until_it_is_put_back() -> None:
    eye: Any = Eye()
    camera = WrongEye(eye, [fault("camera_bumped", start_s=1.0, end_s=2.0, value=4.0)])
    for t in (0.0, 1.0, 2.0):
        world: Any = SimpleNamespace(time_s=t, drones=())
        camera.look(world, 0, "c")
    assert eye.bumps == [0.0, 4.0, 0.0]


@pytest.mark.parametrize(
    ("sees", "arrived", "shown"), [(False, True, []), (True, False, [1.0])], ids=["nobody in view", "a lost picture"]
)
def test_the_picture_that_hangs_is_the_last_one_that_came(sees: bool, arrived: bool, shown: list[float]) -> None:
    """One that showed nobody hangs as such: the camera does not go back to an older one."""
    eye: Any = Eye()
    camera, world = WrongEye(eye, [fault("picture_frozen", start_s=1.0)]), SimpleNamespace(time_s=0.0, drones=())
    any_world: Any = world
    camera.look(any_world, 0, "c")
    eye.sees, eye.arrived, world.time_s = sees, arrived, 0.5
    assert camera.look(any_world, 1, "c") == []
    eye.sees, eye.arrived, world.time_s = True, True, 1.5
    assert [one.position_m[0] for one in camera.look(any_world, 2, "c")] == shown
    eye.arrived = False
    assert camera.look(any_world, 3, "c") == [], "a repeated picture can be lost as any other"
