"""From a rigid body in its system's axes to the entity that carries it, in cases worked out by hand."""

import math

import pytest

from drivers.motion_capture.convert import Placement, body_pose
from drivers.motion_capture.settings import BodySection, MotionCaptureSection, parse_source
from groundstation.bus.messages import Header

WIDE = ((-9.0, 9.0),) * 3
NORTH = (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))  # a quarter turn about z


def section(**changes: object) -> MotionCaptureSection:
    values = {"name": "mocap", "source": "natnet://127.0.0.1", "bodies": (), "observed": (), "volume_m": WIDE}
    return MotionCaptureSection.model_validate(values | changes)


def test_offsets_of_body_and_marker_turn_with_the_entity() -> None:
    body = BodySection(entity="drone_1", name="cf1", position_m=(0.1, 0.0, 0.05), marker_m=(0.0, 0.0, 0.08))
    pose = Placement(section()).entity_pose(body, (1.0, 2.0, 1.0), NORTH)
    assert pose is not None
    assert pose.position == pytest.approx((1.0, 1.9, 0.95))
    assert pose.marker == pytest.approx((1.0, 1.9, 1.03))


def test_the_body_may_be_defined_with_its_x_axis_aside() -> None:
    body = BodySection(entity="drone_1", name="cf1", yaw_deg=90.0)
    placement = Placement(section())
    pose = placement.entity_pose(body, (0.0, 0.0, 1.0), NORTH)
    assert pose is not None
    assert body_pose("drone_1", pose).attitude == pytest.approx((1.0, 0.0, 0.0, 0.0))


def test_a_system_with_y_up_and_an_origin_of_its_own() -> None:
    placement = Placement(section(up="y", position_m=(1.0, 0.0, 0.0), yaw_deg=90.0))
    body = BodySection(entity="drone_1", name="cf1")
    about_y = (0.0, math.sin(0.25), 0.0, math.cos(0.25))  # half a radian about the system's vertical
    # 2 m along its x, 1.5 m up, 0.5 m along its z: x is the world's y, z the world's x.
    pose = placement.entity_pose(body, (2.0, 1.5, 0.5), about_y)
    assert pose is not None
    assert pose.position == pytest.approx((1.5, 2.0, 1.5))
    told = placement.observation("drone_1", pose, Header(1, "c", "mocap", "mocap", 1))
    assert told.yaw_rad == pytest.approx(math.pi / 2 + 0.5)
    assert told.position_m == pytest.approx((1.5, 2.0, 1.5)) and told.observer == "mocap"


def test_the_larger_of_the_configured_and_the_reported_deviation_counts() -> None:
    placement, body = Placement(section(yaw_deg=90.0, heading_std_deg=1.0)), BodySection(entity="drone_1", name="cf1")

    def variances(*deviations: float) -> list[float]:
        pose = placement.entity_pose(body, (1.0, 2.0, 1.0), NORTH, tuple(deviations))  # type: ignore[arg-type]
        assert pose is not None
        told = placement.observation("drone_1", pose, Header(1, "c", "mocap", "mocap", 1)).covariance
        assert all(told[4 * i + j] == pytest.approx(told[4 * j + i], abs=1e-12) for i in range(4) for j in range(i))
        return [told[5 * i] for i in range(4)]

    usual = [0.002**2] * 3 + [math.radians(1.0) ** 2]
    assert variances(0.0, 0.0, 0.0, 0.0) == variances(0.001, 0.0, 0.0, 1e-6) == pytest.approx(usual)
    assert variances(0.3, 0.0, 0.1, 0.5) == pytest.approx([0.002**2, 0.09, 0.01, 0.25]), "its x is the world's y"


@pytest.mark.parametrize("quaternion", [(0.0, 0.0, 0.0, 0.0), (math.nan, 0.0, 0.0, 1.0)])
def test_numbers_that_are_no_rotation_give_no_pose(quaternion: tuple[float, float, float, float]) -> None:
    body = BodySection(entity="drone_1", name="cf1")
    assert Placement(section()).entity_pose(body, (0.0, 0.0, 0.0), quaternion) is None
    assert Placement(section()).entity_pose(body, (math.inf, 0.0, 0.0), NORTH) is None


@pytest.mark.parametrize("far_m", [1e17, 1.7e308])
def test_a_place_beyond_any_room_is_no_pose(far_m: float) -> None:
    """One such pose made the sum of a body's jumps 0, so that any position was accepted on its return."""
    body = BodySection(name="a", entity="drone_1")
    assert Placement(section()).entity_pose(body, (far_m, 0.0, 0.0), NORTH) is None


def test_addresses_of_systems() -> None:
    address = parse_source("vrpn://192.168.1.5")
    assert (address.scheme, address.host, address.port) == ("vrpn", "192.168.1.5", 3883)
    assert parse_source("natnet://motive:1600").port == 1600
    for wrong in ("natnet://", "http://1.2.3.4", "natnet://host/path", "natnet://host:99999", "192.168.1.5"):
        with pytest.raises(ValueError, match=r"must|port"):
            parse_source(wrong)
