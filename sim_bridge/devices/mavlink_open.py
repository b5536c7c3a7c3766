"""Opens the emulator of a MAVLink drone of the site."""

import math

from drivers.mavlink.wire.names import Flavour
from drivers.mavlink.wire.telemetry import VideoStreamInformation
from sim_bridge.devices.camera_stream import PATH
from sim_bridge.devices.mavlink import Address, LinkHabits, MavlinkEmulator
from sim_bridge.devices.mavlink_identity import identity_of
from sim_bridge.devices.mavlink_parameters import Parameters
from sim_bridge.launch_spec import LaunchSpec
from sim_bridge.mavlink_scenario import CopterScenario
from sim_bridge.scenario import Scenario
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
    """Return the listening emulator of a MAVLink vehicle."""
    video = None
    if name in order.streams and drone.camera is not None:
        address, port = order.streams[name]
        uri = f"http://{address}:{port}{PATH}"
        video = announced(name, drone.camera.calibration, order.scenario.cameras.fps, uri)
    return open_at(order.addresses[name], name, drone, copter, order.scenario, video=video, wrong=wrong)


def open_at(
    address: str, name: str, drone: SiteDrone, copter: MavlinkCopter, scenario: Scenario, *,
    calls: Address | None = None, video: VideoStreamInformation | None = None, wrong: WrongValues | None = None,
) -> MavlinkEmulator:  # fmt: skip
    """Return the emulator of a MAVLink vehicle that listens at an address, under the scenario's section of its kind.

    calls: the address that it sends to unasked; None: the field's driver, if that waits for its vehicles (`listen`).
    """
    identity, section = identity_of(drone), scenario.of_kind("mavlink", CopterScenario)
    if calls is None and identity.listen:
        calls = identity.local_address, identity.port
    flavour = Flavour[identity.flavour.upper()]
    parameters = Parameters(flavour, identity.system_id, section.configured)
    vehicle = MavlinkEmulator(name, (address, identity.port), parameters, copter, calls=calls, video=video, wrong=wrong)
    vehicle.habits = LinkHabits(section.one_partner, section.mavlink_1_until_greeted)
    return vehicle
