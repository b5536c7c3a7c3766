"""Emulated vehicles on real loopback ports, updated by a thread of their own 200 times a second."""

import itertools
import os
import socket
import threading
import time

import numpy as np
import pytest
from free_port import free_port

from drivers.mavlink.wire.names import Flavour
from sim_bridge.devices.mavlink import MavlinkEmulator
from sim_bridge.devices.mavlink_parameters import Parameters
from sim_bridge.mavlink_scenario import CopterScenario
from sim_bridge.world.mavlink_copter import ARDUPILOT_RESPONSE, PX4_RESPONSE, MavlinkCopter
from sim_bridge.world.world import TICK_S

_numbers = itertools.count(1)
# Two sources at once have two reset counters, so that each pose is a jump without velocity information.
SILENT_S = 0.2


def free_address():
    """Return a loopback address that no other test of this run uses."""
    pid = os.getpid()
    return f"127.{10 + pid % 90}.{pid // 90 % 250}.{next(_numbers)}"


class Hangar:
    """Vehicles, each in its own room; `aided`: poses come from here while no other source sends them."""

    def __init__(self):
        self.emulators = {}
        self.copters = {}
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._turn, daemon=True)
        self.lock = threading.Lock()
        self.aided = set()

    def add(self, flavour, system, address=None, aided=False, configured=True, **options):
        flavour = Flavour.PX4 if flavour == "px4" else Flavour.ARDUPILOT
        response = PX4_RESPONSE if flavour is Flavour.PX4 else ARDUPILOT_RESPONSE
        copter = MavlinkCopter((0.0, 0.0), 0.0, CopterScenario(), response, TICK_S, np.random.default_rng(system))
        address = address or (free_address(), 14550)
        emulator = MavlinkEmulator(f"v{system}", address, Parameters(flavour, system, configured), copter, **options)
        with self.lock:
            self.emulators[address, system], self.copters[address, system] = emulator, copter
            if aided:
                self.aided.add((address, system))
        if not self._thread.is_alive():
            self._thread.start()
        return emulator, copter, address

    def _turn(self):
        due, tick = time.monotonic(), 0
        while not self._stop.is_set():
            with self.lock:
                tick += 1
                for key, emulator in self.emulators.items():
                    copter = self.copters[key]
                    emulator.receive()
                    copter.step((0.0, 0.0, 0.0))
                    copter.estimate.step(copter.airframe, copter.motors_on)
                    if key in self.aided and tick % 7 == 0 and copter.estimate.aided_s > SILENT_S:
                        body = copter.airframe
                        copter.estimate.aid((body.x, body.y, body.z), body.yaw, 0)
                    emulator.send()
            due += TICK_S
            time.sleep(max(0.0, due - time.monotonic()))
            due = max(due, time.monotonic() - 0.1)

    def close(self):
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join(2.0)
        for emulator in self.emulators.values():
            emulator.close()


@pytest.fixture
def vehicle():
    """A socket that stands for a vehicle."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.bind(("127.0.0.1", 0))
        udp.settimeout(2.0)
        yield udp


@pytest.fixture
def hangar():
    hangar = Hangar()
    yield hangar
    hangar.close()


@pytest.fixture
def port():
    return free_port(kind=socket.SOCK_DGRAM)
