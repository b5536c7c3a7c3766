"""A vehicle without motion telemetry holds the place where a picture showed it, in flight only."""

from typing import ClassVar, cast

import pytest

from drivers.mavlink.links.refusals import LinkRefusals
from drivers.mavlink.links.seam import MavlinkLink
from drivers.mavlink.settings import MavlinkDriverSettings
from drivers.mavlink.vehicle import MavlinkVehicle
from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import EntityEstimate, Estimate, Header

MS = 1_000_000
NOW = 1_000_000 * MS
PLACE, YAW = (1.2, -0.5, 0.8), 0.3


class _Silent:
    """A link without telemetry."""

    rejected: ClassVar[LinkRefusals] = LinkRefusals()


@pytest.fixture
def vehicle() -> MavlinkVehicle:
    settings = MavlinkDriverSettings.model_validate(
        {
            "link": {"target": "udpout:127.0.0.1:14550"},
            "vehicles": [
                {"name": "v", "system_id": 11, "flavour": "px4", "pad_m": PLACE[:2], "pad_yaw_rad": YAW},
            ],
            "raw_datagrams": False,
        }
    )
    bus = MemoryBus(MemoryExchange(), "lab", "mavlink_v")
    return MavlinkVehicle(settings, settings.vehicles[0], cast(MavlinkLink, _Silent()), bus)


def estimate(now_ns: int, x_m: float, std_m: float, age_s: float = 0.2) -> Estimate:
    """Return a belief of the vehicle that is `std_m` wide by now, 2 cm in the picture that showed it last."""
    covariance = tuple(std_m**2 if index % 5 == 0 else 0.0 for index in range(16))
    place = (x_m, *PLACE[1:], YAW)
    entity = EntityEstimate(
        "v", "robot", place, covariance, (0.0, 0.0, 0.0), True, age_s, 0.0, False, (age_s, 0.02)
    )  # fmt: skip
    header = Header(now_ns, clock.clock_id(), "team", "tracker", 1)
    return Estimate(header=header, entities=(entity,), epoch=1)


def test_a_flying_vehicle_holds_the_place_where_the_picture_showed_it(vehicle: MavlinkVehicle) -> None:
    vehicle.orders.lift.lifted = True
    for now_ns in range(NOW, NOW + 600 * MS, 100 * MS):
        vehicle.see(now_ns, estimate(now_ns, PLACE[0], std_m=0.15))
        assert vehicle.orders.drift.place(now_ns) == PLACE
        assert vehicle.orders.drift.hold(now_ns) == (0.0, 0.0, 0.0), "it is there"
    now_ns += 100 * MS
    vehicle.see(now_ns, estimate(now_ns, PLACE[0] + 0.2, std_m=0.15))
    forward, left, _ = vehicle.orders.drift.hold(now_ns)
    assert forward < -0.05 and left > 0.0, "back to where it was seen at rest, in its own axes"


def test_velocity_errors_are_not_estimated_from_pictures(vehicle: MavlinkVehicle) -> None:
    vehicle.orders.lift.lifted = True
    for step in range(20):
        now_ns = NOW + step * 100 * MS
        vehicle.see(now_ns, estimate(now_ns, PLACE[0] + 0.02 * step, std_m=0.15))
    assert vehicle.orders.drift.drift(now_ns) == (0.0, 0.0, 0.0)


def test_one_picture_is_told_once(vehicle: MavlinkVehicle) -> None:
    vehicle.orders.lift.lifted = True
    vehicle.see(NOW, estimate(NOW, PLACE[0], std_m=0.15, age_s=0.2))
    vehicle.see(NOW + 50 * MS, estimate(NOW + 50 * MS, PLACE[0] + 0.2, std_m=0.15, age_s=0.25))
    assert vehicle.orders.drift.place(NOW + 50 * MS) == PLACE


def test_on_the_floor_no_place_is_held(vehicle: MavlinkVehicle) -> None:
    vehicle.see(NOW, estimate(NOW, PLACE[0], std_m=0.15))
    assert vehicle.vision.sighted is not None
    assert vehicle.orders.drift.place(NOW) is None


def test_a_belief_that_is_good_is_no_sighting(vehicle: MavlinkVehicle) -> None:
    vehicle.orders.lift.lifted = True
    vehicle.see(NOW, estimate(NOW, PLACE[0], std_m=0.02))
    assert vehicle.vision.sighted is None
