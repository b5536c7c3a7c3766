"""Clients of others fly our emulated vehicles: MAVSDK's own plugins, and MAVProxy from an environment of its own."""

import asyncio
import importlib.util
import os
import subprocess
import threading
import time
from pathlib import Path

import pytest

from drivers.mavlink.links.forwarding import with_riders
from drivers.mavlink.links.opening import open_link
from drivers.mavlink.settings import LinkSettings, VehicleSettings
from drivers.mavlink.wire.flight import CommandLong
from drivers.mavlink.wire.names import MavCmd

pytestmark = [pytest.mark.slow, pytest.mark.interop, pytest.mark.timeout(180)]
_INTEROP = Path(__file__).parents[2] / ".interop"
_SPEC = importlib.util.spec_from_file_location(
    "mavlink_hangar", Path(__file__).parents[1] / "contract" / "mavlink_links" / "conftest.py"
)
assert _SPEC is not None and _SPEC.loader is not None
_hangar = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(_hangar)
hangar, port = _hangar.hangar, _hangar.port


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
        await param.set_param_float("GUID_TIMEOUT" if ardupilot else "COM_OF_LOSS_T", 0.75)
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


@pytest.mark.parametrize("flavour", ["px4", pytest.param("ardupilot", marks=pytest.mark.exhaustive)])
def test_mavsdk_flies_our_vehicle(hangar, port, flavour):
    emulator, copter, _ = hangar.add(flavour, 5, aided=True, calls=("127.0.0.1", port))
    facts = asyncio.run(fly_with_mavsdk(port, flavour == "ardupilot"))
    assert facts["autopilot"] == (2 if flavour == "ardupilot" else 1)
    assert facts["version"] == (4 if flavour == "ardupilot" else 1)
    assert facts["parameter"] == (255 if flavour == "ardupilot" else 5)
    assert 0.3 < facts["speed"] < 0.6 and facts["height"] > 0.5
    assert facts["armed"] is False and not copter.airborne
    assert emulator.firmware.parameters["GUID_TIMEOUT" if flavour == "ardupilot" else "COM_OF_LOSS_T"] == 0.75


@pytest.fixture
def mavproxy(absent):
    """The MAVProxy of `$GROUNDSTATION_MAVPROXY` or `make interop`, in an environment of its own."""
    program = os.environ.get("GROUNDSTATION_MAVPROXY") or str(_INTEROP / "mavproxy" / "bin" / "mavproxy.py")
    if not Path(program).exists():
        absent(f"{program} is missing: run `make interop`")
    return program


class Proxy:
    """A MAVProxy with a prompt; `until` waits for what it brings about."""

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


def test_mavproxy_rides_along_and_may_only_stop(proxy_at, hangar, port):
    """Our link flies the vehicle; MAVProxy sees it, cannot change what it flies by, and lands it."""
    emulator, copter, (address, own) = hangar.add("ardupilot", 5, aided=True)
    told: list[str] = []
    seen = VehicleSettings(name="drone", system_id=5, flavour="ardupilot", forward=f"udp:127.0.0.1:{port}")
    link = open_link(
        LinkSettings(target=f"udpout:{address}:{own}"), shown=lambda bare: with_riders(bare, {5: seen}, told.append)
    )
    ended = threading.Event()
    reader = threading.Thread(target=lambda: [link.receive() for _ in iter(ended.is_set, True)])
    reader.start()

    def ask(done, number, *values):
        def asked():
            link.send(5, CommandLong(5, 1, number, 0, *values))
            time.sleep(0.3)
            return done()

        assert until(asked), number

    try:
        time.sleep(2.0)
        ask(lambda: emulator.firmware.mode == 4, MavCmd.DO_SET_MODE, 1.0, 4.0)
        ask(lambda: emulator.firmware.armed, MavCmd.COMPONENT_ARM_DISARM, 1.0)
        link.send(5, CommandLong(5, 1, MavCmd.NAV_TAKEOFF, 0, param7=1.0))
        assert until(lambda: copter.airframe.z > 0.8)
        proxy = proxy_at(f"udpin:127.0.0.1:{port}")
        time.sleep(4.0)
        proxy.say("mode RTL")
        proxy.say("param set GUID_TIMEOUT 0.75")
        time.sleep(2.0)
        assert emulator.firmware.mode == 4
        assert emulator.firmware.parameters["GUID_TIMEOUT"] != 0.75
        assert not told
        proxy.say("mode LAND")
        assert until(lambda: not emulator.firmware.armed)
        assert until(lambda: told)
    finally:
        ended.set()
        reader.join(3.0)
        link.close()
