"""Third-party clients fly our emulated vehicles: MAVSDK's own plugins, and MAVProxy from its own environment."""

import asyncio
import itertools
import math
import os
import socket
import subprocess
import threading
import time
from collections import deque
from pathlib import Path

import mavlink_hangar
import pytest
from free_port import free_port
from mavlink_pilot import Pilot
from spare_time import needing_processors

from groundstation.bus.messages import Verb

pytestmark = [pytest.mark.slow, pytest.mark.interop, pytest.mark.timeout(180)]
_INTEROP = Path(__file__).parents[2] / ".interop"
hangar, port = mavlink_hangar.hangar, mavlink_hangar.port

LOSS_PARAMETER = {"ardupilot": "GUID_TIMEOUT", "px4": "COM_OF_LOSS_T"}


async def fly_with_mavsdk(port, ardupilot):
    from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
    from mavsdk.asyncio.plugins.action import ActionAsync
    from mavsdk.asyncio.plugins.info import InfoAsync
    from mavsdk.asyncio.plugins.offboard import OffboardAsync
    from mavsdk.asyncio.plugins.param import ParamAsync
    from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
    from mavsdk.plugins.offboard import VelocityBodyYawspeed

    facts = {}
    async with Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION)) as mavsdk:
        await mavsdk.add_any_connection(f"udpin://127.0.0.1:{port}")
        system = await mavsdk.first_autopilot(timeout_s=10.0)
        assert system is not None
        facts["autopilot"] = int(await system.autopilot_type())
        telemetry, action, offboard = TelemetryAsync(system), ActionAsync(system), OffboardAsync(system)
        param, info = ParamAsync(system), InfoAsync(system)
        await asyncio.sleep(2.5)
        facts["version"] = (await info.get_version()).flight_sw_major
        name = "SYSID_MYGCS" if ardupilot else "MAV_SYS_ID"
        facts["parameter"] = await param.get_param_int(name)
        if ardupilot:
            await param.set_param_int(name, 245)
            await telemetry.set_rate_position_velocity_ned(20.0)
            await telemetry.set_rate_health(2.0)
        await param.set_param_float(LOSS_PARAMETER["ardupilot" if ardupilot else "px4"], 0.75)
        await asyncio.sleep(1.5)
        if ardupilot:
            await action.set_takeoff_altitude(1.0)
            await offboard.set_velocity_body(VelocityBodyYawspeed(0.0, 0.0, 0.0, 0.0))
            await offboard.start()  # GUIDED: it does not arm in STABILIZE without a stick
            await action.arm()
            await offboard.stop()
            await action.takeoff()
            await asyncio.sleep(8.0)
            await offboard.set_velocity_body(VelocityBodyYawspeed(0.0, 0.0, 0.0, 0.0))
            await offboard.start()
        else:
            await offboard.set_velocity_body(VelocityBodyYawspeed(0.0, 0.0, 0.0, 0.0))
            await offboard.start()
            await asyncio.sleep(1.5)
            await action.arm()
            await offboard.set_velocity_body(VelocityBodyYawspeed(0.0, 0.0, -0.6, 0.0))
            await asyncio.sleep(3.5)
        await offboard.set_velocity_body(VelocityBodyYawspeed(0.5, 0.0, 0.0, 20.0))
        await asyncio.sleep(3.0)
        async for sample in telemetry.subscribe_position_velocity_ned():
            velocity = sample.velocity
            facts["speed"] = (velocity.north_m_s**2 + velocity.east_m_s**2) ** 0.5
            facts["height"] = -sample.position.down_m
            break
        await offboard.stop()
        await action.land()
        deadline = time.monotonic() + 20
        while await telemetry.armed() and time.monotonic() < deadline:
            await asyncio.sleep(0.2)
        facts["armed"] = await telemetry.armed()
    return facts


@pytest.mark.exhaustive
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_mavsdk_flies_our_vehicle(hangar, port, flavour):
    emulator, copter, _ = hangar.add(flavour, 5, aided=True, calls=("127.0.0.1", port))
    # Without one an armed PX4 refuses Hold, to which MAVSDK's offboard.stop switches.
    emulator.firmware.origin = (473977420, 85455940, 488_000)
    facts = asyncio.run(fly_with_mavsdk(port, flavour == "ardupilot"))
    assert facts["autopilot"] == (2 if flavour == "ardupilot" else 1)
    assert facts["version"] == (4 if flavour == "ardupilot" else 1)
    assert facts["parameter"] == (255 if flavour == "ardupilot" else 5)
    assert 0.3 < facts["speed"] < 0.6 and facts["height"] > 0.5
    assert facts["armed"] is False and not copter.airborne
    assert emulator.firmware.parameters[LOSS_PARAMETER[flavour]] == 0.75


@pytest.fixture
def mavproxy(absent):
    """The MAVProxy of `$GROUNDSTATION_MAVPROXY` or `make interop`, in an environment of its own."""
    program = os.environ.get("GROUNDSTATION_MAVPROXY") or str(_INTEROP / "mavproxy" / "bin" / "mavproxy.py")
    if not Path(program).exists():
        absent(f"{program} is missing: run `make interop`")
    return program


class Proxy:
    """A MAVProxy with a prompt; `until` waits for a command's effect."""

    def __init__(self, program, master, folder):
        command = [str(Path(program).parent / "python"), program, f"--master={master}", "--target-system=5"]
        command += ["--state-basedir", str(folder)]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(
            command, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT, text=True, cwd=folder
        )

    def say(self, line):
        assert self._process.stdin is not None
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()

    def close(self):
        self._process.terminate()
        print(self._process.communicate(timeout=10)[0])


def until(condition, seconds=20.0):
    deadline = time.monotonic() + seconds
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.1)
    return condition()


@pytest.fixture
def proxy_at(mavproxy, tmp_path):
    made = []

    def start(master):
        made.append(Proxy(mavproxy, master, tmp_path))
        return made[0]

    yield start
    for one in made:
        one.close()


@pytest.mark.exhaustive
def test_mavproxy_flies_our_ardupilot(proxy_at, hangar):
    emulator, copter, (address, port) = hangar.add("ardupilot", 5, aided=True)
    proxy = proxy_at(f"udpout:{address}:{port}")
    assert until(lambda: emulator._ground_ns is not None), "no heartbeat from MAVProxy"
    time.sleep(2.0)
    proxy.say("mode GUIDED")
    assert until(lambda: emulator.firmware.mode == 4)
    proxy.say("arm throttle")
    assert until(lambda: emulator.firmware.armed)
    proxy.say("takeoff 1")
    assert until(lambda: copter.airframe.z > 0.8)
    proxy.say("param set GUID_TIMEOUT 0.75")
    assert until(lambda: emulator.firmware.parameters["GUID_TIMEOUT"] == 0.75)
    proxy.say("mode LAND")
    assert until(lambda: not emulator.firmware.armed)


class Tracked:
    """The real driver of one vehicle and the tracker's stand-in, run by a thread of their own."""

    def __init__(self, port, rider, flavour, copter):
        def where(_):
            body = copter.airframe
            return (body.x, body.y, body.z), body.yaw

        self._pilot = Pilot(port, "pymavlink", where, {5: flavour}, forward=f"udp:127.0.0.1:{rider}")
        self._wishes: deque[Verb] = deque()
        self._ended = threading.Event()
        self.watchdog, self._copter = self._pilot.hosts[0].watchdog, copter
        self._thread = threading.Thread(target=self._turn)
        self._thread.start()

    def _turn(self):
        for turn in itertools.count():
            if self._ended.is_set():
                return
            while self._wishes:
                self._pilot.order(self._wishes.popleft(), self.watchdog.mode)
            self._pilot.turn(turn)

    @property
    def texts(self):
        return list(self._pilot.process.texts)

    @property
    def speed_m_s(self):
        return math.hypot(*self._copter.airframe.velocity_stabilized())

    def order(self, verb, done):
        """Give a command repeatedly, as a patient operator would."""

        def asked():
            self._wishes.append(verb)
            return until(done, 2.0)

        assert until(asked), self.texts

    def track(self):
        """Take off, and fly by the stand-in's setpoints."""
        assert until(lambda: self.watchdog.mode == "LANDED" and not self.watchdog.vehicle.not_ready), self.texts
        self.order(Verb.TAKEOFF, lambda: self.watchdog.mode == "HOVER" and self._copter.airframe.z > 0.6)
        self.order(Verb.TRACK, lambda: self.speed_m_s > 0.25)

    def close(self):
        self._ended.set()
        self._thread.join(3.0)
        self._pilot.fleet.close()


# Prompt commands to return home, hold and land. MAVProxy 1.8 cannot send PX4's modes by name: pymavlink takes the three
# numbers of a mode for a single one, and fails to pack them.
TYPED = {
    "ardupilot": ("mode RTL", "mode BRAKE", "mode LAND"),
    "px4": ("long DO_SET_MODE 157 4 5", "long DO_SET_MODE 157 4 3", "long DO_SET_MODE 157 4 6"),
}


# In a whole run MAVProxy and MAVSDK are second stations in tests/interop/test_riding_clients.py.
@pytest.mark.exhaustive
@needing_processors()
@pytest.mark.parametrize("flavour", ["ardupilot", "px4"])
def test_mavproxy_rides_along_and_may_only_stop(proxy_at, hangar, port, flavour):
    """Our driver tracks; MAVProxy cannot change the setpoints, holds the vehicle until our RESUME, and lands it."""
    emulator, copter, _ = hangar.add(flavour, 5, aided=True, calls=("127.0.0.1", port))
    firmware, rider, (home, hold, land) = emulator.firmware, free_port(kind=socket.SOCK_DGRAM), TYPED[flavour]
    tracked = Tracked(port, rider, flavour, copter)
    try:
        tracked.track()
        proxy = proxy_at(f"udpin:127.0.0.1:{rider}")
        time.sleep(4.0)
        before = dict(firmware.parameters.values)
        proxy.say(home)
        proxy.say(f"param set {LOSS_PARAMETER[flavour]} 0.75")
        time.sleep(2.0)
        assert firmware.mode == firmware.guided and firmware.parameters.values == before
        assert tracked.watchdog.mode == "TRACK" and tracked.speed_m_s > 0.25
        assert not any("a second ground station" in text for text in tracked.texts)
        proxy.say(hold)
        assert until(lambda: firmware.mode != firmware.guided), tracked.texts
        held = firmware.mode
        assert until(lambda: tracked.speed_m_s < 0.1), "it brakes"
        for _ in range(40):  # the tracker's setpoints continue, and move nothing
            time.sleep(0.1)
            assert firmware.mode == held and tracked.speed_m_s < 0.2, tracked.texts
        tracked.order(Verb.RESUME, lambda: firmware.mode == firmware.guided and tracked.speed_m_s > 0.25)
        proxy.say(land)
        assert until(lambda: not firmware.armed), tracked.texts
        assert sum("a second ground station stops it" in text for text in tracked.texts) == 2
    finally:
        tracked.close()
