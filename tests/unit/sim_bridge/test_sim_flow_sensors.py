"""State estimates of emulated Tellos and ROS 2 robots err by the scenario's figures, within the stated accuracy."""

import math

import numpy as np
import pytest

from groundstation.field.drones import OdometryErrors
from groundstation.vehicles import kind_named
from sim_bridge.devices.tello import TelloBody
from sim_bridge.scenario import DroneScenario, Scenario
from sim_bridge.site import SiteDrone
from sim_bridge.world.airframe import Airframe
from sim_bridge.world.flow_sensors import FlowSensors
from sim_bridge.world.noise import generator_of

TICK_S = 0.005
CLAIMED = OdometryErrors()
EXACT = DroneScenario(
    velocity_gain=(0.85, 0.85), velocity_delay_ms=(0, 0), velocity_noise_m_s=0, height_noise_m=0, height_delay_ms=0,
    attitude_noise_deg=0, yaw_wander_deg=0,
)  # fmt: skip


def sensors(seed: int, figures: DroneScenario, speed_m_s: float = 0.0) -> tuple[FlowSensors, Airframe]:
    """Return the sensors of a body that is held at 1.5 m, and the body."""
    body = Airframe(0.4, -0.2, 0.7)
    body.z, body.on_ground = 1.5, False
    body.vx, body.vy = speed_m_s * math.cos(body.yaw), speed_m_s * math.sin(body.yaw)
    return FlowSensors(figures, TICK_S, body, generator_of(seed, "senses")), body


def told(seed: int, figures: DroneScenario, seconds: float, speed_m_s: float = 0.0) -> np.ndarray:
    """Return forward velocity, climb, height, roll, yaw, turn rate and position (2) of each tick."""
    senses, body = sensors(seed, figures, speed_m_s)
    rows = []
    for _ in range(round(seconds / TICK_S)):
        senses.step(body, motors_on=True)
        told = senses.readings(0, 0.9)
        rows.append((told.vx, told.vz, told.height, told.roll, told.yaw, told.gyros[2], *told.position[:2]))
    return np.array(rows)


@pytest.fixture(scope="module")
def hover() -> np.ndarray:
    """Half a minute of each of twelve vehicles, without the first second."""
    return np.array([told(seed, DroneScenario(), 31.0)[200:] for seed in range(12)])


def rms(samples: np.ndarray) -> float:
    return float(np.sqrt(np.mean(samples**2)))


def test_they_err_by_the_figures_of_the_scenario(hover: np.ndarray) -> None:
    assert rms(hover[:, :, 0]) == pytest.approx(0.03, rel=0.1)
    assert rms(hover[:, :, 2] - 1.5) == pytest.approx(0.034, rel=0.15)
    assert rms(np.degrees(hover[:, :, 3])) == pytest.approx(1.0, rel=0.25)
    assert rms(hover[:, :, 5]) == pytest.approx(0.044, rel=0.1)
    turned = np.degrees(hover[:, -1, 4] - hover[:, 0, 4])
    assert 1.5 < rms(turned) < 6.5, "two places of a process of 3 deg and 30 s, and the gyros' drift of 0.55 deg"


def test_their_place_drifts_with_what_they_measure() -> None:
    ends = np.array([told(seed, DroneScenario(), 20.0, speed_m_s=0.3)[-1, 6:] for seed in range(6)])
    off = np.hypot(ends[:, 0] - 6.0, ends[:, 1])
    assert 0.1 < rms(off) < 1.5
    assert np.hypot(*(told(1, EXACT, 20.0, speed_m_s=0.3)[-1, 6:] - (6.0, 0.0))) < 0.03  # the drift of the heading


def test_without_errors_they_tell_the_truth() -> None:
    exact = told(1, EXACT, 1.0, speed_m_s=0.5)
    assert exact[-1, [0, 3]] == pytest.approx([0.5, 0.0], abs=1e-9)
    assert exact[-1, 4] == pytest.approx(0.0, abs=math.radians(0.02))


@pytest.mark.parametrize("kind", ["tello", "ros2"])
def test_stated_accuracies_cover_the_emulated_errors(hover: np.ndarray, kind: str) -> None:
    habits = kind_named(kind).habits
    assert rms(hover[:, :, 0]) < CLAIMED.velocity_std_m_s
    assert rms(hover[:, :, 2] - 1.5) < CLAIMED.height_std_m
    assert rms(np.degrees(hover[:, :, 3])) < 1.25 * CLAIMED.attitude_std_deg
    assert rms(np.degrees(hover[:, 200:, 4] - hover[:, :-200, 4])) < CLAIMED.yaw_rate_std_deg_s
    assert rms(hover[:, :, 1]) < 1.05 * habits.climb_m_s


def test_one_that_leans_as_it_thinks_slides_until_its_flow_has_trimmed_it() -> None:
    drone = SiteDrone.model_validate(
        {"kind": "tello", "pad_m": (0.0, 0.0), "pad_yaw_deg": 30.0,
         "marker": {"code": 1, "position_m": (0.0, 0.0, 0.08)}}
    )  # fmt: skip
    calm = DroneScenario(air_unrest_m_s2=0.0, velocity_noise_m_s=0.0, attitude_correlation_s=1000.0)
    slid = []
    for tilt_deg in (0.0, 2.0):
        figures = calm.model_copy(update={"attitude_noise_deg": tilt_deg})
        body = TelloBody(drone, Scenario(drones=figures), TICK_S, generator_of(3, "tello"))
        body.motors_on, body.wanted = True, ((0.0, 0.0, 0.5), 0.0)
        speeds = []
        for tick in range(1600):
            if tick == 300:
                body.wanted = ((0.0, 0.0, 0.0), 0.0)
            body.step((0.0, 0.0, 0.0))
            body.sense()
            speeds.append(math.hypot(body.airframe.vx, body.airframe.vy))
        slid.append((max(speeds), speeds[-1]))
    assert slid[0][0] < 0.01 and 0.03 < slid[1][0] < 0.3 and slid[1][1] < 0.03


def test_a_battery_drains_as_the_scenario_says() -> None:
    figures = DroneScenario(battery=(0.5, 0.5), battery_drain_per_min=1.2)
    drone = SiteDrone.model_validate(
        {"kind": "tello", "pad_m": (0.0, 0.0), "marker": {"code": 1, "position_m": (0.0, 0.0, 0.08)}}
    )
    body = TelloBody(drone, Scenario(drones=figures), TICK_S, generator_of(3, "tello"))
    body.motors_on, body.wanted = True, ((0.0, 0.0, 0.3), 0.0)
    for _ in range(round(10.0 / TICK_S)):
        body.sense()
        body.step((0.0, 0.0, 0.0))
    assert body.battery == pytest.approx(0.5 - 1.2 * 10.0 / 60.0, abs=0.002)
