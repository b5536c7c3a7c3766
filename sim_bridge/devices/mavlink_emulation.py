"""MAVLink vehicles in the simulator."""

import numpy as np

from sim_bridge.devices.mavlink_identity import identity_of
from sim_bridge.launch_spec import LaunchSpec
from sim_bridge.mavlink_scenario import CopterScenario
from sim_bridge.scenario import Scenario
from sim_bridge.site import SiteDrone
from sim_bridge.world.emulation import Emulator
from sim_bridge.world.mavlink_copter import ARDUPILOT_RESPONSE, PX4_RESPONSE, MavlinkCopter
from sim_bridge.wrong_values import wrong_values_of


class MavlinkEmulation:
    """MAVLink vehicles; `sim_bridge.world.emulation.Emulation`."""

    def body(self, drone: SiteDrone, scenario: Scenario, tick_s: float, rng: np.random.Generator) -> MavlinkCopter:
        """Return a copter on its pad that answers as its firmware does."""
        response = PX4_RESPONSE if identity_of(drone).flavour == "px4" else ARDUPILOT_RESPONSE
        return MavlinkCopter(
            drone.pad_m, drone.pad_yaw_rad, scenario.of_kind("mavlink", CopterScenario), response, tick_s, rng
        )

    def open(self, name: str, body: MavlinkCopter, onboard: None, order: LaunchSpec) -> Emulator:
        """Return the listening emulator of a MAVLink vehicle."""
        # Only here: pymavlink's dialect takes its time to load.
        from sim_bridge.devices.mavlink_open import open_vehicle

        wrong = wrong_values_of(order.scenario.faults, name)
        return open_vehicle(name, order.site.drones[name], body, order, wrong)


EMULATION = MavlinkEmulation()
