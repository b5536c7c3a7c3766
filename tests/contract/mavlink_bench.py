"""Test bench with one emulated autopilot: a client that sends on request, and vision that can be switched off."""

import numpy as np

from drivers.mavlink.wire import flight as f
from drivers.mavlink.wire import telemetry as t
from drivers.mavlink.wire.frames import FrameDecoder, FrameEncoder, split
from drivers.mavlink.wire.names import Flavour
from sim_bridge.devices.mavlink import MavlinkEmulator
from sim_bridge.devices.mavlink_parameters import Parameters
from sim_bridge.mavlink_scenario import CopterScenario
from sim_bridge.world.mavlink_copter import ARDUPILOT_RESPONSE, PX4_RESPONSE, MavlinkCopter
from sim_bridge.world.world import TICK_S

GROUND = ("127.0.0.1", 14999)
CALM = CopterScenario(attitude_noise_deg=0, gyro_bias_deg_s=0, air_unrest_m_s2=0)


def sent_by(emulator):
    """Return the datagrams that an emulator on a FakeSocket has sent."""
    return emulator.socket.sent


class Bench:
    """One vehicle, a client that sends on request, and vision that can be switched off."""

    def __init__(self, flavour, configured=True, scenario=CALM):
        px4 = flavour == "px4"
        response = PX4_RESPONSE if px4 else ARDUPILOT_RESPONSE
        self.copter = MavlinkCopter((0.0, 0.0), 0.0, scenario, response, TICK_S, np.random.default_rng(3))
        kind = Flavour.PX4 if px4 else Flavour.ARDUPILOT
        self.emulator = MavlinkEmulator("v", GROUND, Parameters(kind, 5, configured), self.copter)
        self.firmware = self.emulator.firmware
        self.encoder, self.decoder = FrameEncoder(255, 190), FrameDecoder()
        self.heard = []
        self.seen = self.beating = True
        self.setpoint = None
        self.tick_count = 0

    def say(self, message):
        self.emulator.take(self.encoder.encode(message), GROUND)
        return self.collect()

    def command(self, number, *params):
        self.say(f.CommandLong(5, 1, number, 0, *params))
        return [m.result for m in self.heard if isinstance(m, f.CommandAckMessage) and m.command == number][-1]

    def collect(self):
        came = []
        sent = sent_by(self.emulator)
        while sent:
            came += [self.decoder.decode(raw).message for raw in split(sent.popleft())]
        self.heard += came
        return came

    def run(self, seconds):
        for _ in range(round(seconds / TICK_S)):
            self.tick_count += 1
            if self.beating and self.tick_count % 200 == 0:
                self.say(t.Heartbeat(6, 8, 0, 0, 4))
            if self.setpoint is not None and self.tick_count % 10 == 0:
                self.say(self.setpoint)
            if self.seen and self.tick_count % 7 == 0:
                body = self.copter.airframe
                self.copter.estimate.aid((body.x, body.y, body.z), body.yaw, 0)
            self.copter.step((0.0, 0.0, 0.0))
            self.copter.estimate.step(self.copter.airframe, self.copter.motors_on)
            self.emulator.send()
            self.collect()
        return self

    def fly(self, forward=0.0, right=0.0, down=0.0, turn=0.0, frame=8, mask=0x5C7):
        self.setpoint = f.SetPositionTargetLocalNed(
            0, 5, 1, frame, mask, 0.0, 0.0, 0.0, forward, right, down, 0.0, 0.0, 0.0, 0.0, turn
        )

    def up(self):
        """Hover at about 1 m, obeying setpoints."""
        self.run(1.0)
        if self.firmware.flavour is Flavour.PX4:
            self.fly()
            self.run(1.5)
            assert self.command(176, 1.0, 6.0) == 0 and self.command(400, 1.0) == 0
            self.run(1.1)
            self.fly(down=-0.5)
            self.run(2.2)
        else:
            assert self.command(176, 1.0, 4.0) == 0 and self.command(400, 1.0) == 0
            assert self.command(22, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0) == 0
            self.run(7.0)
        self.fly()
        return self.run(2.0)

    def texts(self):
        return [m.text.rstrip() for m in self.heard if isinstance(m, t.Statustext)]
