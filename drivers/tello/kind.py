"""Tellos as a kind of vehicle."""

from collections.abc import Mapping, Sequence
from typing import Annotated

from pydantic import Field

from drivers.tello.settings import TelloDriverSettings
from drivers.tello.wire.text import COMMAND_PORT, LAND, rc
from drivers.vehicle_settings import Address, silence_limits, vehicle_limits
from groundstation.vehicles import DriverProcess, ErrorHabits, KindSection, StopDatagrams, VehicleKind, VehicleOrder


class Tello(KindSection):
    """A Tello or RoboMaster TT in SDK mode."""

    local_address: Address = "0.0.0.0"
    """IPv4 address of this computer that the state is received at (UDP 8890)."""
    full_speed_m_s: Annotated[float, Field(gt=0, le=8)] = 1.0
    """Horizontal speed [m/s] at full stick."""
    full_climb_m_s: Annotated[float, Field(gt=0, le=4)] = 1.0
    """Climb rate [m/s] at full stick."""
    full_yaw_rate_deg_s: Annotated[float, Field(gt=0, le=360)] = 100.0
    """Turn rate [deg/s] at full stick."""


def _processes(orders: Sequence[VehicleOrder]) -> list[DriverProcess]:
    return [DriverProcess((order.name,), _settings(order).model_dump_json()) for order in orders]


def _settings(order: VehicleOrder) -> TelloDriverSettings:
    given, drone = order.sections.get("tello"), order.drone
    own = given if isinstance(given, Tello) else Tello()
    return TelloDriverSettings(
        name=order.name,
        address=drone.address,
        interface=drone.interface,
        pad_m=drone.pad_m,
        limits=vehicle_limits(drone.limits),
        safety=silence_limits(order.safety),
        velocity_scale=drone.odometry.velocity_scale,
        velocity_std_m_s=drone.odometry.velocity_std_m_s,
        raw_datagrams=order.raw_datagrams,
        **own.model_dump(),
    )


def _moved(local_address: str, sections: Mapping[str, KindSection]) -> dict[str, dict[str, object]]:
    return {"tello": {"local_address": local_address}}


KIND = VehicleKind(
    name="tello",
    summary="Ryze Tello and RoboMaster TT",
    driver="drivers.tello.driver:run",
    # Its velocity is the optical flow's, in steps of 0.1 m/s, its climb rate likewise.
    habits=ErrorHabits(0.5, 5.0, 0.7, 0.05, 0.0, reports_climb=True, tells_attitude=True),
    processes=_processes,
    # Sticks in the middle never lift one that stands. The vehicle obeys whoever speaks.
    stop=lambda orders: StopDatagrams(COMMAND_PORT, rc(0, 0, 0, 0), LAND),
    sections={"tello": Tello},
    required=frozenset({"tello"}),
    has_interface=True,
    moved=_moved,
    emulator="sim_bridge.devices.tello:EMULATION",
    example={"tello": {}},
)
