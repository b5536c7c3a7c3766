"""The emulated drone under arbitrary input at its AT port: no exception, finite state, limits kept."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st

from sim_bridge.devices.ardrone_control import FlightControl
from sim_bridge.devices.ardrone_state import control_state, state_word
from sim_bridge.scenario import DroneScenario
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.ardrone_sensors import Onboard
from sim_bridge.world.noise import generator_of

TICK_S, TICK_NS = 0.005, 5_000_000

numbers = st.one_of(st.integers(-(2**31), 2**32), st.sampled_from([0, 1, 512, 256, 2143289344, 2139095040, 1065353216]))
names = st.sampled_from(
    ["REF", "PCMD", "PCMD_MAG", "CTRL", "FTRIM", "CALIB", "ANIM", "COMWDG", "CONFIG", "CONFIG_IDS", "LED", "XYZ", ""]
)
texts = st.sampled_from(
    [
        '"general:navdata_demo"',
        '"TRUE"',
        '"control:euler_angle_max"',
        '"nan"',
        '"1e9"',
        '"-1"',
        '"control:altitude_max"',
    ]
)
arguments = st.lists(st.one_of(numbers.map(str), texts), max_size=8)


@st.composite
def lines(draw: st.DrawFn) -> bytes:
    line = f"AT*{draw(names)}={draw(numbers)}" + "".join(f",{a}" for a in draw(arguments))
    return line.encode() + draw(st.sampled_from([b"\r", b",\r", b"\n", b""]))


datagrams = st.one_of(st.binary(max_size=64), st.lists(lines(), max_size=6).map(b"".join))


@settings(max_examples=50, deadline=None)
@given(st.lists(datagrams, min_size=1, max_size=40))
def test_any_datagrams_leave_a_sane_drone(stream: list[bytes]) -> None:
    drone = Quadrotor((0.0, 0.0), 0.0, DroneScenario(), TICK_S, generator_of(1, "drone"))
    onboard = Onboard(DroneScenario(), TICK_S, drone.airframe, generator_of(1, "onboard"))
    control = FlightControl(drone, onboard)
    control.obey_datagram(b"AT*REF=1,512\r", 0)
    now_ns = 0
    for datagram in stream:
        for _ in range(40):
            now_ns += TICK_NS
            drone.step((0.0, 0.0, 0.0))
            control.watch(now_ns)
        control.obey_datagram(datagram, now_ns)
        assert 0 <= state_word(drone, control, now_ns, bootstrap=False) < 1 << 32
        assert 0 <= control_state(drone, control, now_ns) < 1 << 32
    body = drone.airframe
    assert all(map(math.isfinite, body.row()))
    assert math.hypot(body.roll, body.pitch) < math.radians(55)
    assert body.z >= 0.0
