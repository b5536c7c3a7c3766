"""AR.Drones in the simulator."""

import numpy as np

from sim_bridge.launch_spec import LaunchSpec
from sim_bridge.scenario import Scenario
from sim_bridge.site import SiteDrone
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.ardrone_sensors import Onboard
from sim_bridge.world.emulation import Emulator
from sim_bridge.wrong_values import wrong_values_of


class ArDroneEmulation:
    """AR.Drones; `sim_bridge.world.emulation.Emulation`."""

    def body(self, drone: SiteDrone, scenario: Scenario, tick_s: float, rng: np.random.Generator) -> Quadrotor:
        """Return an AR.Drone on its pad."""
        return Quadrotor(drone.pad_m, drone.pad_yaw_rad, scenario.drones, tick_s, rng)

    def open(self, name: str, body: Quadrotor, onboard: Onboard, order: LaunchSpec) -> Emulator:
        """Return the listening emulator of an AR.Drone with the scenario's firmware."""
        from sim_bridge.devices.ardrone import ArDroneEmulator
        from sim_bridge.devices.ardrone_firmware import FIRMWARES

        drones, wrong = order.scenario.drones, wrong_values_of(order.scenario.faults, name)
        firmware = FIRMWARES[drones.firmware_of(name)].without(drones.omit_options)
        return ArDroneEmulator(name, order.addresses[name], body, onboard, drones.navdata_hz, firmware, wrong)


EMULATION = ArDroneEmulation()
