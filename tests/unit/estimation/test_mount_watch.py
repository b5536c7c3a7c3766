"""A bumped fixed camera is identified by its own and the robots' mutual observations; no other camera is blamed."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from msgspec.structs import replace

from groundstation.bus.messages import Header, RelativeObservation, Severity, Verdict
from groundstation.bus.notice import Notice
from groundstation.estimation.event_log import FAR, OTHER_POSE
from groundstation.estimation.measurement import Correction
from groundstation.estimation.mount_watch import MountWatch
from groundstation.estimation.parameters import parameters_from_field
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.rotations import world_from_downward_optical

DRONES = ("drone_1", "drone_2")
BUMPED_S, TURN_DEG, SECONDS = 3.0, 5.0, 6.0
Place = Callable[[str, float], np.ndarray]


def circling(name: str, at_s: float) -> np.ndarray:
    angle = 0.4 * at_s + (0.0 if name == "drone_1" else 2.5)
    return np.array([0.9 * math.cos(angle), 0.8 * math.sin(angle), 1.4 + 0.1 * math.sin(at_s)])


def turned(angle_deg: float) -> np.ndarray:
    """Return a camera's turn about an axis between right and down in its picture."""
    angle, x, y = math.radians(angle_deg), 0.6, 0.8
    cross = np.array([[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross


def mount_watch(field: ResolvedField) -> MountWatch:
    return MountWatch(parameters_from_field(field))


class Room:
    """A ceiling camera's observations of two drones, and the drones' reported velocities.

    lie: error of a drone's velocity [m/s; world]. hangs_s: from when until when the last picture is repeated.
    """

    def __init__(self, field: ResolvedField, place: Place = circling, lie: dict[str, float] | None = None) -> None:
        self.watch, self.place, self.lie = mount_watch(field), place, lie or {}
        camera = field.cameras["ceiling"]
        self.down, self.eye = world_from_downward_optical(camera.rotation_deg), np.array(camera.position_m)
        self.rng, self.told = np.random.default_rng(1), list[Notice]()
        self.visible = dict.fromkeys(DRONES, True)
        self.hangs_s, self.last = (0.0, 0.0), dict[str, np.ndarray]()

    def fly(self, seconds: float, turn_deg: float, bumped_s: float = BUMPED_S) -> list[Notice]:
        for tick in range(round(50 * seconds)):
            now_s = 0.02 * tick
            if tick % 3 == 0 and now_s > 0.5:
                self._look(now_s - 0.16, turn_deg if now_s - 0.16 >= bumped_s else 0.0)
            velocities = {
                name: (
                    (self.place(name, now_s + 1e-4) - self.place(name, now_s)) / 1e-4 + self.lie.get(name, 0.0)
                ).tolist()
                for name in DRONES
            }
            self.told += self.watch.advance(round(now_s * 1e9), velocities, (), DRONES)
        return self.told

    def _look(self, at_s: float, turn_deg: float) -> None:
        rotation = self.down @ turned(turn_deg)
        for name in DRONES:
            if self.visible[name]:
                fresh = rotation.T @ (self.place(name, at_s) - self.eye) + 0.005 * self.rng.standard_normal(3)
                hangs = self.hangs_s[0] < at_s < self.hangs_s[1]
                seen = self.last[name] = self.last[name] if hangs else fresh
                self.watch.see(sighting(name, at_s, seen))


def sighting(name: str, at_s: float, seen: np.ndarray) -> RelativeObservation:
    return RelativeObservation(
        header=Header(round(at_s * 1e9), "c", "ceiling", "ceiling", 1),
        observer="ceiling",
        subject=name,
        camera="ceiling",
        position_m=tuple(seen.tolist()),
        yaw_rad=0.0,
        covariance=tuple((1e-4 * np.eye(4)).ravel().tolist()),
    )


@pytest.mark.parametrize("turn_deg", [3.0, 5.0, 8.75])
def test_a_bump_is_told_at_once_with_its_size_and_a_remedy(lab_field: ResolvedField, turn_deg: float) -> None:
    room = Room(lab_field)
    (notice,) = room.fly(BUMPED_S + 0.6, turn_deg)
    assert notice.entity == "ceiling"
    assert notice.severity is Severity.ERROR
    assert notice.remedy
    size = float(notice.text.split("turned by ")[1].split()[0])
    assert size == pytest.approx(turn_deg, rel=0.25)
    assert room.watch.distrusts("ceiling")
    assert room.watch.is_rootless


def test_a_small_bump_is_told_and_stops_nobody(lab_field: ResolvedField) -> None:
    room = Room(lab_field)
    (notice,) = room.fly(SECONDS, 1.7)
    assert notice.entity == "ceiling"
    assert notice.severity is Severity.WARNING
    assert not room.watch.is_rootless


def test_one_drone_is_enough_where_it_jumps_farther_than_it_can_fly(lab_field: ResolvedField) -> None:
    room = Room(lab_field)
    room.visible["drone_2"] = False
    (notice,) = room.fly(SECONDS, TURN_DEG)
    assert notice.entity == "ceiling"


@pytest.mark.parametrize("lie", [{}, {"drone_1": 0.5}, {"drone_1": 0.5, "drone_2": 0.5}], ids=["none", "one", "both"])
def test_nothing_is_told_of_a_camera_that_hangs_still(lab_field: ResolvedField, lie: dict[str, float]) -> None:
    assert Room(lab_field, lie=lie).fly(SECONDS, 0.0) == []


def test_a_drone_that_is_carried_off_is_no_bump(lab_field: ResolvedField) -> None:
    def carried(name: str, at_s: float) -> np.ndarray:
        off = 0.3 * (name == "drone_1" and at_s >= BUMPED_S)
        return circling(name, at_s) + np.array([off, 0.0, 0.0])

    assert Room(lab_field, carried).fly(SECONDS, 0.0) == []


def test_a_picture_that_hangs_for_a_moment_is_no_bump(lab_field: ResolvedField) -> None:
    room = Room(lab_field)
    room.hangs_s = (BUMPED_S, BUMPED_S + 0.3)
    assert room.fly(SECONDS, 0.0) == []


def test_trust_returns_when_all_have_landed(lab_field: ResolvedField) -> None:
    room = Room(lab_field)
    room.fly(SECONDS, TURN_DEG)
    room.watch.advance(7_000_000_000, {}, (), ())
    assert not room.watch.is_rootless
    assert not room.watch.distrusts("ceiling")


def far(subject: str, gap: tuple[float, float, float] = (0.0, -0.5, 0.0)) -> Correction:
    return Correction("ceiling", subject, Verdict.IMPLAUSIBLE, FAR, (*gap, 0.0), nis=120.0)


def agreed(observer: str, subject: str) -> Correction:
    return Correction(observer, subject, Verdict.ACCEPTED, "", (0.0,) * 4, nis=2.0)


@pytest.mark.parametrize(
    ("beside", "culprits"),
    [
        ((), []),
        ((agreed("drone_1", "drone_2"),), ["ceiling"]),
        ((agreed("drone_1", "turtlebot"), agreed("drone_2", "turtlebot")), ["ceiling"]),
        ((agreed("drone_1", "turtlebot"),), []),
        ((agreed("drone_1", "drone_2"), agreed("ceiling", "drone_1")), []),
        ((far("drone_1"),), ["ceiling"]),
        ((replace(far("drone_1"), reason=f"{FAR}; {OTHER_POSE}"),), ["ceiling"]),
        ((far("drone_1", (0.5, 0.5, 0.4)),), []),
    ],
    ids=[
        "one alone", "seen by the other", "one target", "a target of one", "the other agrees", "both",
        "both, one by its other pose", "both apart",
    ],
)  # fmt: skip
def test_robots_that_agree_with_each_other_convict_the_bumped_camera(
    lab_field: ResolvedField, beside: tuple[Correction, ...], culprits: list[str]
) -> None:
    """After a bump that put all drones out of its view, the camera sees one of them again."""
    watch, told = mount_watch(lab_field), list[Notice]()
    for picture in range(8):
        now_s = 10.0 + picture / 15.0
        for name, place in (("drone_1", (-0.8, 0.2, 2.6)), ("drone_2", (0.9, -0.4, 2.5))):
            watch.see(sighting(name, now_s - 0.1, np.array(place)))
        told += watch.advance(round(now_s * 1e9), {}, (far("drone_2"), *beside), DRONES)
    assert [notice.entity for notice in told] == culprits


@pytest.mark.parametrize(
    ("pause_s", "gap_m", "culprits"),
    [(0.15, 0.4, ["ceiling"]), (0.15, 0.25, []), (0.35, 0.5, []), (0.5, 2.0, [])],
    ids=["jumped", "may have flown", "may have flown for longer", "nobody looked"],
)
def test_one_that_was_just_where_it_should_be_is_not_lost_by_more_than_it_can_fly(
    lab_field: ResolvedField, pause_s: float, gap_m: float, culprits: list[str]
) -> None:
    watch, told = mount_watch(lab_field), list[Notice]()
    for picture in range(8):
        now_s = 10.0 + picture / 15.0
        watch.see(sighting("drone_2", now_s - 0.1, np.array((0.9, -0.4, 2.5))))
        if not picture:
            told += watch.advance(round((now_s - pause_s) * 1e9), {}, (agreed("ceiling", "drone_2"),), DRONES)
        told += watch.advance(round(now_s * 1e9), {}, (far("drone_2", (0.0, -gap_m, 0.0)),), DRONES)
    assert [notice.entity for notice in told] == culprits


@pytest.mark.parametrize("away_s", [1.0, 12.0])
def test_a_misread_marker_before_a_robot_was_away_says_nothing_about_its_return(
    lab_field: ResolvedField, away_s: float
) -> None:
    """Its odometry was off meanwhile. The gap would be a jump if it had begun at the misread marker."""
    watch, told = mount_watch(lab_field), list[Notice]()
    misread = (agreed("ceiling", "drone_2"),), (far("drone_2", (1.5, 0.4, 0.1)),)
    for tick, corrections in enumerate(misread):
        told += watch.advance(round((10.0 - away_s + 0.1 * tick) * 1e9), {}, corrections, DRONES)
    for picture in range(8):
        now_s = 11.6 + picture / 15.0
        watch.see(sighting("drone_2", now_s - 0.1, np.array((0.9, -0.4, 2.5))))
        told += watch.advance(round(now_s * 1e9), {}, (far("drone_2", (0.0, -2.0, 0.0)),), DRONES)
    assert told == []


def test_a_misread_marker_long_ago_does_not_hide_a_bump(lab_field: ResolvedField) -> None:
    watch, told = mount_watch(lab_field), list[Notice]()
    watch.advance(round(5.0 * 1e9), {}, (far("drone_1", (1.5, 0.4, 0.1)),), DRONES)
    watch.advance(round(8.0 * 1e9), {}, (agreed("ceiling", "drone_2"),), DRONES)
    for picture in range(8):
        now_s = 10.0 + picture / 15.0
        for name, place in (("drone_1", (-0.8, 0.2, 2.6)), ("drone_2", (0.9, -0.4, 2.5))):
            watch.see(sighting(name, now_s - 0.1, np.array(place)))
        told += watch.advance(round(now_s * 1e9), {}, (far("drone_1"), far("drone_2")), DRONES)
    assert [notice.entity for notice in told] == ["ceiling"]
