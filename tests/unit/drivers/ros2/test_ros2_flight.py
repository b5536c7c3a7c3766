"""A vehicle behind a ROS 2 node, without network: flight state, signs of angles, names, field settings."""

import math
import shutil
from pathlib import Path

import pytest

from drivers.ros2 import names
from drivers.ros2.flight import FlightWatch, angles_of, levelled
from drivers.ros2.names import Order
from drivers.ros2.settings import NO_HASH, Ros2Section
from drivers.watchdog_types import Action
from groundstation.bus.messages import FlightState
from groundstation.errors import SettingsError
from groundstation.geometry.rotations import rotation_x, rotation_y, rotation_z
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.settings.new_field import NewDrone, NewRoom, NewTarget, field_text
from groundstation.vehicles import kind_named
from sim_bridge.conformance.subject import subject_of
from sim_bridge.devices.ros2 import _about, _product, _turned

S = 1_000_000_000


class Told:
    """A watch that receives heights ten times a second."""

    def __init__(self) -> None:
        self.watch, self.now_ns = FlightWatch(0.8), 0

    def see(self, seconds: float, height: float, asked: Action, climb: float = 0.0) -> FlightState:
        for _ in range(round(10 * seconds)):
            self.now_ns += S // 10
            self.watch.see(self.now_ns, height, climb, asked)
        return self.watch.state(asked, 0.0)


def test_a_flight_is_told_by_height_and_orders() -> None:
    told = Told()
    assert told.watch.state(Action.WAIT, 0.0) is FlightState.UNKNOWN
    assert told.see(0.1, 0.02, Action.IDLE) is FlightState.LANDED
    assert told.see(1.0, 0.02, Action.TAKE_OFF) is FlightState.LANDED
    assert told.see(0.1, 0.3, Action.TAKE_OFF, 0.5) is FlightState.TAKING_OFF
    assert told.see(0.1, 0.6, Action.TAKE_OFF, 0.5) is FlightState.FLYING
    assert told.see(0.1, 0.8, Action.HOVER) is FlightState.HOVERING
    assert told.watch.state(Action.HOVER, 0.4) is FlightState.FLYING
    assert told.see(0.5, 0.1, Action.LAND, -0.4) is FlightState.LANDING
    assert told.see(0.4, 0.0, Action.LAND) is FlightState.LANDING
    assert told.see(0.5, 0.0, Action.LAND) is FlightState.LANDED


def test_a_vehicle_that_is_told_to_fly_is_not_called_standing() -> None:
    told = Told()
    told.see(0.1, 0.8, Action.HOVER)
    assert told.see(5.0, 0.05, Action.HOVER) is FlightState.HOVERING
    assert told.see(5.0, 0.05, Action.FLY) is FlightState.FLYING
    assert told.see(0.4, 0.05, Action.LAND) is FlightState.LANDING, "it only begins to descend"
    assert told.see(0.4, 0.05, Action.LAND) is FlightState.LANDED


def test_a_slow_descent_is_no_stand() -> None:
    told = Told()
    told.see(0.1, 0.8, Action.HOVER)
    for step in range(20):
        assert told.see(0.1, 0.19 - 0.01 * step, Action.LAND, -0.1) is FlightState.LANDING
    assert told.see(0.7, 0.0, Action.LAND) is FlightState.LANDED


def test_a_vehicle_that_flies_when_it_is_heard_first_flies() -> None:
    assert Told().see(0.1, 0.8, Action.WAIT) is FlightState.FLYING


@pytest.mark.parametrize("angles", [(0.2, -0.1, 1.0), (-0.3, 0.25, -3.0), (0.0, 0.0, 0.0)])
def test_angles_and_levelled_velocities_have_our_signs(angles: tuple[float, float, float]) -> None:
    roll, pitch, yaw = angles
    quaternion = _product(_about(2, yaw), _product(_about(1, pitch), _about(0, roll)))
    assert angles_of(quaternion) == pytest.approx(angles)
    velocity = (0.4, -0.2, 0.1)
    expected = rotation_y(pitch) @ rotation_x(roll) @ velocity
    assert levelled(velocity, roll, pitch) == pytest.approx(tuple(expected))
    world = rotation_z(yaw) @ expected
    assert _turned(quaternion, velocity) == pytest.approx(tuple(world))


def test_names_are_in_the_namespace_and_the_types_hash_in_the_key() -> None:
    section = Ros2Section(namespace="lab/drone_1", domain=7, land="/all/land", velocity_type="twist_stamped")
    velocity = names.spoken_key(section, section.velocity, names.velocity_type(section))
    assert velocity.startswith("7/lab/drone_1/cmd_vel/geometry_msgs::msg::dds_::TwistStamped_/RIHS01_")
    assert names.order_key(section, Order.LAND).startswith("7/all/land/std_msgs::msg::dds_::Empty_/RIHS01_")
    assert names.odometry_key(section) == "7/lab/drone_1/odom/nav_msgs::msg::dds_::Odometry_/*"
    services = section.model_copy(update={"orders": "services", "distro": "humble"})
    assert names.order_key(services, Order.CUT) == f"7/lab/drone_1/reset/std_srvs::srv::dds_::Trigger_/{NO_HASH}"
    assert names.spoken_key(services, "cmd_vel", names.velocity_type(services)).endswith(f"/{NO_HASH}")


def test_vehicles_of_one_router_need_names_of_their_own() -> None:
    subject, kind = subject_of("ros2"), kind_named("ros2")
    found = [(name, path) for name, (path, _) in kind.check([subject.order("one"), subject.order("two", 1)])]
    assert found == [("two", ("ros2", key)) for key in ("odometry", "battery", "velocity", "take_off", "land", "cut")]
    assert not list(kind.check([subject.order("one")]))


@pytest.mark.parametrize(
    "section", [{"odometry": "/skein/drone_1/odom"}, {"namespace": "skein", "odometry": "drone_1/odom"}]
)
def test_topics_of_our_own_view_are_none_of_a_vehicle(section: dict[str, str]) -> None:
    options = [f"drones.drone_1.{key}" for key in ("kind=ros2", "camera.source=http://127.0.0.1:8080/video.mjpg")]
    options += [f"drones.drone_1.ros2.{key}={value}" for key, value in section.items()]
    with pytest.raises(SettingsError, match=r"ros2.odometry: /skein/drone_1/odom is of Skein's own view"):
        load_field(find_field("lab"), options)


def test_a_new_field_gives_each_node_a_namespace_and_may_have_one_router(tmp_path: Path) -> None:
    guests = [NewDrone("ros2", "192.168.1.40", f"ros2://192.168.1.40/{name}/image") for name in ("one", "two")]
    text = field_text("guests", NewRoom(8.0, 6.0, 4.5, "http://192.168.1.50:8080/video.mjpg"), guests, NewTarget())
    shutil.copytree(Path(__file__).parents[4] / "config/cameras", tmp_path / "cameras")
    (tmp_path / "guests.yaml").write_text(text, encoding="utf-8")
    drones = load_field(tmp_path / "guests.yaml").drones
    assert [drone.ros2.namespace for drone in drones.values()] == ["drone_11", "drone_12"]  # type: ignore[attr-defined]
    twice = text.replace("kind: ros2", "kind: tello\n    tello: {}").replace("    ros2: {", "    # {")
    (tmp_path / "guests.yaml").write_text(twice, encoding="utf-8")
    with pytest.raises(SettingsError, match="is already that of drone_1"):
        load_field(tmp_path / "guests.yaml")


def test_a_velocity_has_a_stamp_where_its_type_does() -> None:
    assert len(names.twist(Ros2Section(), (0.0, 0.0, 0.0), 0.0, S)) == 4 + 48
    stamped = Ros2Section(velocity_type="twist_stamped")
    assert len(names.twist(stamped, (0.0, 0.0, 0.0), 0.0, S)) > 4 + 48
    assert math.isclose(stamped.standing_z_m, 0.0)
