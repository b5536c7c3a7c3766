"""Motion capture of drones on their pads: right, exchanged, turned, not tracked."""

import math

import msgspec
import numpy as np
import pytest

from groundstation.doctor.finding import Level
from groundstation.field.resolved import ResolvedField
from groundstation.field.room import MotionCapture, Volume
from groundstation.preflight.expected import all_shown
from groundstation.preflight.judge import pad_findings
from groundstation.preflight.stand import PadSighting

SPAN = (-3.0, 3.0)


@pytest.fixture
def field(lab_field: ResolvedField) -> ResolvedField:
    mocap = MotionCapture(source="natnet://10.0.0.2", volume_m=Volume(x_m=SPAN, y_m=SPAN, z_m=SPAN))
    return msgspec.structs.replace(lab_field, cameras={}, motion_capture={"mocap": mocap})


def at(field: ResolvedField, name: str, place: tuple[float, float], turned_deg: float = 0.0) -> PadSighting:
    yaw = math.radians(field.drones[name].pad_yaw_deg + turned_deg)
    return PadSighting("mocap", name, np.array([*place, 0.1]), yaw, np.eye(4) * 1e-6)


def test_drones_on_their_pads_are_well(field: ResolvedField) -> None:
    seen = [at(field, name, (drone.pad_m[0] + 0.05, drone.pad_m[1])) for name, drone in field.drones.items()]
    assert {(one.subject, one.level) for one in pad_findings(field, seen)} == {(n, Level.OK) for n in field.drones}


def test_exchanged_names_of_bodies_forbid_the_take_off(field: ResolvedField) -> None:
    (first, one), (second, other) = field.drones.items()
    found = list(pad_findings(field, [at(field, first, other.pad_m), at(field, second, one.pad_m)]))
    assert [one.level for one in found] == [Level.MUST, Level.MUST]
    assert f"on the pad of {second}" in found[0].found


def test_a_body_that_was_defined_askew_forbids_the_take_off(field: ResolvedField) -> None:
    name, drone = next(iter(field.drones.items()))
    askew = next(one for one in pad_findings(field, [at(field, name, drone.pad_m, 40.0)]) if one.subject == name)
    assert askew.level is Level.MUST and "40 deg" in askew.found


def test_nobody_followed_forbids_and_one_who_is_not_does_not(field: ResolvedField) -> None:
    (none,) = pad_findings(field, [])
    assert (none.subject, none.level) == ("mocap", Level.MUST)
    name, drone = next(iter(field.drones.items()))
    levels = {one.subject: one.level for one in pad_findings(field, [at(field, name, drone.pad_m)])}
    assert levels == {name: Level.OK} | {n: Level.SHOULD for n in field.drones if n != name}


def test_drones_that_flew_need_only_be_followed(field: ResolvedField) -> None:
    flew = tuple(field.drones)
    (none,) = pad_findings(field, [], flew)
    assert (none.subject, none.level) == ("mocap", Level.MUST)
    assert list(pad_findings(field, [], flew, aloft=flew)) == []
    elsewhere = [at(field, name, (-2.0, 2.0), 120.0) for name in flew[:1]]
    levels = {one.subject: one.level for one in pad_findings(field, elsewhere, flew)}
    assert levels == {flew[0]: Level.OK} | dict.fromkeys(flew[1:], Level.SHOULD)


@pytest.fixture
def both(field: ResolvedField, lab_field: ResolvedField) -> ResolvedField:
    return msgspec.structs.replace(field, cameras=lab_field.cameras)


@pytest.mark.parametrize("flew", [(), ("drone_1", "drone_2")])
def test_a_camera_that_sees_nobody_forbids_nothing_where_a_system_follows_one(
    both: ResolvedField, flew: tuple[str, ...]
) -> None:
    followed = [at(both, name, drone.pad_m) for name, drone in both.drones.items()]
    levels = {one.subject: one.level for one in pad_findings(both, followed, flew)}
    assert levels == dict.fromkeys(both.drones, Level.OK) | {"pads": Level.SHOULD}
    assert {one.level for one in pad_findings(both, [], flew)} == {Level.MUST}


def test_a_drone_that_a_system_follows_needs_no_camera_above_its_pad(both: ResolvedField) -> None:
    aside = msgspec.structs.replace(both.cameras["ceiling"], position_m=(40.0, 0.0, 4.2))
    elsewhere = msgspec.structs.replace(both, cameras={"ceiling": aside})
    followed = [at(both, name, drone.pad_m) for name, drone in both.drones.items()]
    assert {(one.subject, one.level) for one in pad_findings(elsewhere, followed)} == {
        (name, Level.OK) for name in both.drones
    }


def test_sightings_are_awaited_of_each_sensor_that_should_have_them(both: ResolvedField) -> None:
    first, second = both.drones
    captured = {("mocap", first), ("mocap", second)}
    assert not all_shown(both, captured, ()), "the camera is slower"
    assert not all_shown(both, {*captured, ("ceiling", first)}, ())
    assert not all_shown(both, {("ceiling", first), ("ceiling", second)}, ()), "the system is slower"
    assert all_shown(both, {*captured, ("ceiling", first), ("ceiling", second)}, ())
    assert all_shown(both, captured - {("mocap", second)} | {("ceiling", first)}, (second,))
    ceiling = both.cameras["ceiling"]
    two = msgspec.structs.replace(both, cameras={"ceiling": ceiling, "second": ceiling}, motion_capture={})
    above = {("ceiling", first), ("ceiling", second)}
    assert not all_shown(two, above, ()) and all_shown(two, {*above, ("second", first)}, ())
