"""Emulated autopilots as imperfect as measured ones: effect of each scenario key on a vehicle and its link."""

import json
import math
import socket
from collections.abc import Iterator
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from drivers.mavlink.wire.frames import FrameDecoder, FrameEncoder, split
from drivers.mavlink.wire.names import Flavour
from drivers.mavlink.wire.telemetry import Heartbeat
from groundstation.settings.scenario import load_scenario
from sim_bridge.devices.mavlink import LinkHabits, MavlinkEmulator
from sim_bridge.devices.mavlink_parameters import Parameters
from sim_bridge.mavlink_scenario import CopterScenario
from sim_bridge.scenario import parse_scenario
from sim_bridge.world.mavlink_copter import ARDUPILOT_RESPONSE, PX4_RESPONSE, MavlinkCopter, Response
from sim_bridge.world.world import TICK_S

SCENARIO = Path(__file__).parents[3] / "config" / "scenarios" / "unkind-autopilots.yaml"
_net = count(1)


def copter(scenario: CopterScenario, seed: int = 1, firmware: Response = PX4_RESPONSE) -> MavlinkCopter:
    return MavlinkCopter((0.0, 0.0), 0.0, scenario, firmware, TICK_S, np.random.default_rng(seed))


def fly(vehicle: MavlinkCopter, velocity: tuple[float, float, float], seconds: float) -> None:
    body = vehicle.airframe
    for tick in range(round(seconds / TICK_S)):
        vehicle.fly(velocity, 0.0)
        vehicle.step((0.0, 0.0, 0.0))
        vehicle.estimate.step(body, vehicle.motors_on)
        if tick % 7 == 0:
            vehicle.estimate.aid((body.x, body.y, body.z), body.yaw, 0)


def test_the_shipped_scenario_is_as_measured() -> None:
    mavlink = parse_scenario(json.dumps(load_scenario(SCENARIO))).of_kind("mavlink", CopterScenario)
    assert 1.0 <= mavlink.attitude_noise_deg <= 2.6 and mavlink.velocity_gain == (0.8, 0.9)
    assert 0.3 <= mavlink.lift_off_velocity_m_s <= 0.9 and mavlink.hover_drift_m_s > 0.0
    assert mavlink.one_partner and mavlink.mavlink_1_until_greeted


def test_less_speed_than_asked_for_and_a_drift_at_zero() -> None:
    still = {"air_unrest_m_s2": 0.0, "attitude_noise_deg": 0.0}
    slow = copter(CopterScenario.model_validate({**still, "velocity_gain": (0.8, 0.8)}))
    fly(slow, (0.0, 0.0, 0.5), 3.0)
    fly(slow, (1.0, 0.0, 0.0), 6.0)
    assert slow.airframe.vx == pytest.approx(0.8, abs=0.05)
    drifting = copter(CopterScenario.model_validate({**still, "hover_drift_m_s": 0.3}))
    fly(drifting, (0.0, 0.0, 0.5), 3.0)
    fly(drifting, (0.0, 0.0, 0.0), 6.0)
    assert math.hypot(drifting.airframe.vx, drifting.airframe.vy) == pytest.approx(
        math.hypot(*drifting._drift), abs=0.05
    )
    assert math.hypot(*drifting._drift) > 0.05


@pytest.mark.parametrize(("firmware", "least_m", "most_m"), [(PX4_RESPONSE, 0.5, 1.3), (ARDUPILOT_RESPONSE, 0.03, 0.5)])
def test_a_px4_drifts_from_its_pad_as_measured_and_an_ardupilot_less(
    firmware: Response, least_m: float, most_m: float
) -> None:
    scenario, ways = CopterScenario(lift_off_velocity_m_s=0.5, hover_drift_m_s=0.05), []
    for seed in range(9):
        vehicle = copter(scenario, seed, firmware)
        for _ in range(10):
            vehicle.estimate.aid((0.0, 0.0, 0.0), 0.0, 0)
        fly(vehicle, (0.0, 0.0, 0.5), 2.0)
        fly(vehicle, (0.0, 0.0, 0.0), 1.0)
        ways.append(math.hypot(vehicle.airframe.x, vehicle.airframe.y))
    assert least_m <= np.median(ways) <= most_m


def test_the_velocity_is_wrong_after_lift_off() -> None:
    errors = []
    for seed in range(12):
        vehicle = copter(CopterScenario(lift_off_velocity_m_s=0.5), seed)
        body, tick = vehicle.airframe, 0
        fly(vehicle, (0.0, 0.0, 0.0), 1.0)
        while body.on_ground:
            fly(vehicle, (0.0, 0.0, 0.5), 7 * TICK_S)
            tick += 1
            assert tick < 200
        estimate = vehicle.estimate.velocity
        errors.append(math.hypot(estimate[0] - body.vx, estimate[1] - body.vy))
    assert 0.3 < float(np.median(errors)) < 0.9


@pytest.fixture
def vehicle() -> Iterator[MavlinkEmulator]:
    place = (f"127.94.6.{next(_net)}", 14550)
    made = MavlinkEmulator("v1", place, Parameters(Flavour.PX4, 1, configured=True), copter(CopterScenario()))
    yield made
    made.close()


def partner(vehicle: MavlinkEmulator, system: int) -> socket.socket:
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    udp.settimeout(0.5)
    udp.connect(vehicle.socket.getsockname())
    udp.send(FrameEncoder(system, 190).encode(Heartbeat(6, 8, 0, 0, 4)))
    vehicle.receive()
    return udp


def test_only_the_first_partner_is_answered(vehicle: MavlinkEmulator) -> None:
    vehicle.habits = LinkHabits(one_partner=True)
    with partner(vehicle, 255) as first, partner(vehicle, 254) as second:
        for _ in range(20):
            vehicle.send()
        assert FrameDecoder().decode(next(split(first.recv(512)))).system == 1
        with pytest.raises(TimeoutError):
            second.recv(512)


def test_it_speaks_the_old_version_until_it_is_greeted(vehicle: MavlinkEmulator) -> None:
    vehicle.habits = LinkHabits(old_until_greeted=True)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as waiting:
        waiting.bind((vehicle.socket.getsockname()[0], 0))
        waiting.settimeout(0.5)
        vehicle._calls = waiting.getsockname()
        for _ in range(200):
            vehicle.send()
        assert waiting.recv(512)[0] == 0xFE
        with partner(vehicle, 255) as greeter:
            assert greeter.recv(512)[0] == 0xFD
