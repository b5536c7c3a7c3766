"""From a drone of the site to its emulator."""

import math

from drivers.mavlink.wire.names import Flavour
from drivers.mavlink.wire.telemetry import VideoStreamInformation
from sim_bridge.devices.camera_stream import PATH
from sim_bridge.devices.mavlink import LinkHabits, MavlinkEmulator
from sim_bridge.devices.mavlink_identity import identity_of
from sim_bridge.devices.mavlink_parameters import Parameters
from sim_bridge.launch_spec import LaunchSpec
from sim_bridge.mavlink_scenario import CopterScenario
from sim_bridge.site import Lens, SiteDrone
from sim_bridge.world.mavlink_copter import MavlinkCopter
from sim_bridge.wrong_values import WrongValues

# WIRE (VIDEO_STREAM_TYPE, VIDEO_STREAM_ENCODING): JPEGs over HTTP have neither a type nor an encoding of their own.
# MPEG over TCP, encoding unknown, is nearest, and the address says the rest; RTSP, 0, would mislead a client.
_TCP_MPEG, _UNKNOWN_ENCODING, _RUNNING = 2, 0, 1


def announced(name: str, lens: Lens, fps: float, uri: str) -> VideoStreamInformation:
    """Return a vehicle's description of its camera: address, rate, size and angle of view [deg] of its pictures."""
    hfov = round(math.degrees(2.0 * math.atan(lens.width_px / (2.0 * lens.fx_px))))
    size = lens.width_px, lens.height_px
    return VideoStreamInformation(1, 1, _TCP_MPEG, _RUNNING, fps, *size, 0, 0, hfov, name, uri, _UNKNOWN_ENCODING)


def open_vehicle(
    name: str, drone: SiteDrone, copter: MavlinkCopter, order: LaunchSpec, wrong: WrongValues | None = None
) -> MavlinkEmulator:
    """Return the listening emulator of a MAVLink vehicle.

    Where the field's driver waits for its vehicles (`listen`), the vehicle calls it.
    """
    identity = identity_of(drone)
    flavour = Flavour.PX4 if identity.flavour == "px4" else Flavour.ARDUPILOT
    video = None
    if name in order.streams and drone.camera is not None:
        address, port = order.streams[name]
        uri = f"http://{address}:{port}{PATH}"
        video = announced(name, drone.camera.calibration, order.scenario.cameras.fps, uri)
    vehicle = MavlinkEmulator(
        name,
        (order.addresses[name], identity.port),
        Parameters(flavour, identity.system_id, order.scenario.of_kind("mavlink", CopterScenario).configured),
        copter,
        calls=(identity.local_address, identity.port) if identity.listen else None,
        video=video,
        wrong=wrong,
    )
    scenario = order.scenario.of_kind("mavlink", CopterScenario)
    vehicle.habits = LinkHabits(scenario.one_partner, scenario.mavlink_1_until_greeted)
    return vehicle
