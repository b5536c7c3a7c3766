"""Vehicles behind a ROS 2 node as a kind of vehicle."""

from collections.abc import Iterator, Sequence

from drivers.ros2.names import HOVER, LAND
from drivers.ros2.settings import FASTEST_M_S, Ros2DriverSettings, Ros2Section
from drivers.vehicle_settings import a_process_each, values_of
from groundstation.vehicles import ErrorHabits, Finding, Offer, StopDatagrams, VehicleKind, VehicleOrder

# Under it `view --ros2` publishes, estimates as odometry among others: they would be taken for measurements.
_OURS = "skein/"


def _own(order: VehicleOrder) -> Ros2Section:
    return order.section("ros2", Ros2Section())


def _settings(order: VehicleOrder) -> Ros2DriverSettings:
    return Ros2DriverSettings(**values_of(order), ros2=_own(order))


def _stop(orders: Sequence[VehicleOrder]) -> StopDatagrams:
    (order,) = orders
    way = _settings(order).model_dump_json()
    return StopDatagrams(_own(order).port, HOVER, LAND, "drivers.ros2.failsafe_transport:Ros2Failsafe", way)


def _check(orders: Sequence[VehicleOrder]) -> Iterator[tuple[str, Finding]]:
    taken: dict[tuple[str, int, int, str], str] = {}
    for order in orders:
        own, address = _own(order), order.drone.address
        for key in ("odometry", "battery", "velocity", "take_off", "land", "cut"):
            topic = own.topic(getattr(own, key))
            if topic.startswith(_OURS):
                yield (
                    order.name,
                    (("ros2", key), f"/{topic} is of Skein's own view: give the topic of the vehicle's node"),
                )
            other = taken.setdefault((address, own.port, own.domain, topic), f"{order.name}.{key}")
            if other != f"{order.name}.{key}":
                yield order.name, (("ros2", key), f"/{topic} is already that of {other}: give each its namespace")


# The source of the node's odometry is unknown; optical flow is assumed.
KIND = VehicleKind(
    name="ros2",
    summary="vehicles behind a ROS 2 node (Odometry in, Twist out)",
    driver="drivers.ros2.driver:run",
    habits=ErrorHabits(0.5, 5.0, 0.7, 0.05, 0.0, reports_climb=True, tells_attitude=True, fastest_m_s=FASTEST_M_S),
    processes=a_process_each(_settings),
    stop=_stop,
    sections={"ros2": Ros2Section},
    check=_check,
    shares_address=True,
    take_off=("ros2", "take_off_m"),
    emulator="sim_bridge.devices.ros2:EMULATION",
    example={"ros2": {"namespace": "drone"}},
    offers={
        "ros2": Offer(
            "a ROS 2 node",
            of_drone="    ros2: {namespace: drone_{id}}\n",
            pictures="ros2://{address}/camera/image/compressed",
        )
    },
)
