"""AR.Drones in the simulator."""

import numpy as np

from sim_bridge.devices.ardrone_firmware import FIRMWARES
from sim_bridge.launch_spec import LaunchSpec
from sim_bridge.own_video import OwnVideo
from sim_bridge.scenario import Scenario
from sim_bridge.site import SiteDrone
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.ardrone_sensors import Onboard
from sim_bridge.world.emulation import Around, Emulator
from sim_bridge.wrong_values import wrong_values_of


class ArDroneEmulation:
    """AR.Drones; `sim_bridge.world.emulation.Emulation`."""

    def body(self, drone: SiteDrone, scenario: Scenario, tick_s: float, rng: np.random.Generator) -> Quadrotor:
        """Return an AR.Drone on its pad."""
        return Quadrotor(drone.pad_m, drone.pad_yaw_rad, scenario.drones, tick_s, rng)

    def sensors(
        self, name: str, body: Quadrotor, scenario: Scenario, tick_s: float, rng: np.random.Generator
    ) -> Onboard:
        """Return its navdata's sensors; those of an AR.Drone 2 have a magnetometer."""
        magnetometer = scenario.drones.firmware_of(name).startswith("ar2")
        return Onboard(scenario.drones, tick_s, body.airframe, rng, magnetometer)

    def sense(self, body: Quadrotor, onboard: Onboard, around: Around) -> None:
        """Take its readings; floor and bodies below mislead its optical flow and its ultrasound."""
        if around.flow_bias is not None:
            onboard.flow_bias = around.flow_bias
        # A height that a fault sets lasts until the next one.
        if around.below_m is not None and around.below_m != onboard.below_m:
            onboard.below_m = body.autopilot.floor_m = around.below_m
        onboard.step(body, body.autopilot.motors_on, around.crosstalk, body.air)

    def video(self, name: str, scenario: Scenario) -> OwnVideo:
        """Return its video, with the headers of its firmware."""
        header_bytes = FIRMWARES[scenario.drones.firmware_of(name)].video_header_bytes
        return OwnVideo("sim_bridge.render.ardrone_output:ArDroneOutput", {"header_bytes": header_bytes})

    def open(self, name: str, body: Quadrotor, onboard: Onboard, order: LaunchSpec) -> Emulator:
        """Return the listening emulator of an AR.Drone with the scenario's firmware."""
        from sim_bridge.devices.ardrone import ArDroneEmulator

        drones, wrong = order.scenario.drones, wrong_values_of(order.scenario.faults, name)
        firmware = FIRMWARES[drones.firmware_of(name)].without(drones.omit_options)
        return ArDroneEmulator(name, order.addresses[name], body, onboard, drones.navdata_hz, firmware, wrong)


EMULATION = ArDroneEmulation()
