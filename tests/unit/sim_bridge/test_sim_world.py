"""The simulated bodies move as real ones do (docs/reference/ardrone.md 7)."""

import math

import numpy as np
import pytest

from sim_bridge.scenario import DroneScenario, Scenario, TargetScenario
from sim_bridge.site import Site
from sim_bridge.world.airframe import STANDING_HEIGHT_M
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.ardrone_autopilot import FlightLimits, MotionReferences, Phase
from sim_bridge.world.noise import generator_of
from sim_bridge.world.world import TICK_S, World

STILL = (0.0, 0.0, 0.0)
CALM = DroneScenario(air_unrest_m_s2=0.0)


def site(*pads: tuple[float, float]) -> Site:
    marker = {"code": 1, "square_mm": 44, "position_m": [0, 0, 0.08]}
    return Site.model_validate(
        {
            "site": "lab",
            "room": {"size_m": [8, 6, 4.5]},
            "drones": {f"drone_{n}": {"kind": "ardrone", "pad_m": p, "marker": marker} for n, p in enumerate(pads, 1)},
            "target": {"name": "turtlebot", "marker": {"code": 5, "height_m": 0.4, "square_mm": 44}},
        }
    )


def drone(scenario: DroneScenario = CALM, yaw_rad: float = 0.0, seed: int = 1) -> Quadrotor:
    return Quadrotor((0.0, 0.0), yaw_rad, scenario, TICK_S, generator_of(seed, "drone"))


def fly(body: Quadrotor, seconds: float) -> None:
    for _ in range(round(seconds / TICK_S)):
        body.step(STILL)


def hovering(scenario: DroneScenario = CALM, yaw_rad: float = 0.0) -> Quadrotor:
    body = drone(scenario, yaw_rad)
    body.autopilot.take_off()
    fly(body, 8.0)
    assert body.autopilot.phase is Phase.HOVERING
    return body


def pulse(seconds: float, tilt_deg: float = 12.0) -> tuple[np.ndarray, np.ndarray]:
    """Return pitch [deg] and forward speed [m/s] from the command on, which ends after `seconds`."""
    body = hovering()
    body.autopilot.move(MotionReferences(0.0, math.radians(tilt_deg), 0.0, 0.0))
    rows = []
    for tick in range(600):
        if tick == round(seconds / TICK_S):
            body.autopilot.hover()
        body.step(STILL)
        rows.append((math.degrees(body.airframe.pitch), body.airframe.vx))
    pitch, speed = np.array(rows).T
    return pitch, speed


def test_tilt_responds_as_recorded() -> None:
    pitch, _ = pulse(2.0)
    peak = pitch[:200].max()
    t10, t63, t90 = (1000 * TICK_S * (1 + int(np.argmax(pitch >= share * peak))) for share in (0.10, 0.63, 0.90))
    assert t10 == pytest.approx(90, abs=15)
    assert t63 == pytest.approx(180, abs=15)
    assert t90 == pytest.approx(270, abs=15)
    assert peak / 12.0 == pytest.approx(1.08, abs=0.02)
    assert 360 <= 1000 * TICK_S * int(np.argmax(pitch[:200])) <= 490


@pytest.mark.parametrize(("seconds", "low", "high"), [(0.5, 0.9, 1.15), (1.0, 1.7, 2.1), (2.0, 2.55, 2.95)])
def test_a_tilt_pulse_brings_the_recorded_speed(seconds: float, low: float, high: float) -> None:
    _, speed = pulse(seconds)
    assert low <= speed.max() <= high


def test_take_off_follows_the_recorded_profile() -> None:
    body = drone()
    body.autopilot.take_off()
    height = []
    for _ in range(round(8.0 / TICK_S)):
        body.step(STILL)
        height.append(body.airframe.z)
    at = {seconds: height[round(seconds / TICK_S)] for seconds in (2.8, 3.36, 3.77, 4.2, 7.9)}
    assert at[2.8] == STANDING_HEIGHT_M
    assert at[3.36] == pytest.approx(0.27, abs=0.05)
    assert at[3.77] == pytest.approx(0.65, abs=0.08)
    assert max(height) == pytest.approx(0.82, abs=0.02)
    assert at[7.9] == pytest.approx(0.76, abs=0.02)


def test_landing_ends_on_the_floor_with_motors_off() -> None:
    body = hovering()
    body.autopilot.land()
    fly(body, 1.0)
    assert body.airborne
    fly(body, 3.0)
    assert not body.airborne
    assert body.autopilot.phase is Phase.LANDED
    assert not body.autopilot.motors_on


def test_cut_motors_falls_and_stays_down_until_cleared() -> None:
    body = hovering()
    body.autopilot.cut_motors()
    body.autopilot.clear_emergency()
    phases = [body.autopilot.phase]  # an emergency is not cleared in the air
    fly(body, 0.6)
    assert not body.airborne
    body.autopilot.take_off()
    fly(body, 5.0)
    assert not body.airborne
    body.autopilot.clear_emergency()
    phases.append(body.autopilot.phase)
    assert phases == [Phase.CUT, Phase.LANDED]


@pytest.mark.parametrize("yaw_deg", [0.0, 90.0, -135.0])
def test_signs_of_motion(yaw_deg: float) -> None:
    """Pitch down goes forward, roll right goes right, climb goes up, a positive turn is counter-clockwise."""
    yaw = math.radians(yaw_deg)
    forward, left = np.array([math.cos(yaw), math.sin(yaw)]), np.array([-math.sin(yaw), math.cos(yaw)])
    for motion, axis, sign in (
        (MotionReferences(0, 0.1, 0, 0), forward, 1),
        (MotionReferences(0.1, 0, 0, 0), left, -1),
    ):
        body = hovering(yaw_rad=yaw)
        body.autopilot.move(motion)
        fly(body, 1.0)
        velocity = np.array([body.airframe.vx, body.airframe.vy])
        assert sign * velocity @ axis > 0.5
        assert abs(velocity @ (forward + left - axis)) < 0.1
    body = hovering(yaw_rad=yaw)
    height = body.airframe.z
    body.autopilot.move(MotionReferences(0, 0, 0.4, 0.5))
    fly(body, 1.0)
    assert body.airframe.z > height + 0.1
    assert 0.3 < math.remainder(body.airframe.yaw - yaw, math.tau) < 0.5


def test_climb_and_turn_are_first_order() -> None:
    body = hovering()
    body.autopilot.move(MotionReferences(0, 0, 0.5, 1.0))
    fly(body, 0.05 + 0.1)
    assert body.airframe.yaw_rate == pytest.approx(1 - math.exp(-1), abs=0.05)
    fly(body, 1 / 1.4 - 0.1)
    assert body.airframe.vz == pytest.approx(0.5 * (1 - math.exp(-1)), abs=0.04)


def test_limits_hold() -> None:
    body = hovering()
    body.autopilot.limits = FlightLimits(tilt_rad=0.1, climb_m_s=0.5, yaw_rate_rad_s=1.0, height_m=1.5)
    body.autopilot.move(MotionReferences(0, 1.0, 3.0, 9.0))
    top_rate = 0.0
    for _ in range(1600):
        body.step(STILL)
        top_rate = max(top_rate, body.airframe.yaw_rate)
    assert body.airframe.z <= 1.52
    assert top_rate <= 1.01
    assert body.airframe.pitch == pytest.approx(0.1, abs=0.01)


def test_hover_brakes_then_drifts_slowly() -> None:
    body = hovering(DroneScenario())
    body.autopilot.move(MotionReferences(0, 0.2, 0, 0))
    fly(body, 0.7)
    assert body.airframe.vx > 0.8
    body.autopilot.hover()
    fly(body, 3.0)
    x, y = body.airframe.x, body.airframe.y
    track = []
    for _ in range(round(30 / TICK_S)):
        body.step(STILL)
        track.append(math.hypot(body.airframe.x - x, body.airframe.y - y))
    assert 0.02 < max(track) < 1.5
    assert math.hypot(body.airframe.vx, body.airframe.vy) < 0.25
    assert body.airframe.z == pytest.approx(0.76, abs=0.1)


def test_battery_drains_in_the_air_only() -> None:
    body = drone(DroneScenario(battery=(0.5, 0.5), battery_drain_per_min=0.06))
    fly(body, 10.0)
    assert body.battery == 0.5
    body.autopilot.take_off()
    fly(body, 60.0)
    assert body.battery == pytest.approx(0.44, abs=1e-3)


def test_downwash_pushes_down_and_away_only_below() -> None:
    upper = hovering()
    upper.airframe.z = 2.2
    lower = hovering()
    lower.airframe.x, lower.airframe.z = 0.1, 1.2
    push = upper.wake_on(lower.airframe)
    assert push is not None
    assert push[0] > 0.05
    assert -2.0 < push[2] < -0.3
    assert lower.wake_on(upper.airframe) is None
    lower.airframe.x = 0.51
    assert upper.wake_on(lower.airframe) is None


def test_a_drone_under_another_sinks_but_recovers() -> None:
    def lowest(downwash: bool) -> float:
        scenario = Scenario(drones=DroneScenario(air_unrest_m_s2=0.0, downwash=downwash))
        world = World(site((0, 0), (0.05, 0)), scenario, 1)
        for body in world.of(Quadrotor).values():
            body.autopilot.take_off()
        for _ in range(1600):
            world.step()
        upper, lower = world.drones["drone_1"].airframe, world.drones["drone_2"].airframe
        upper.z = 2.0
        lows = []
        for _ in range(400):
            world.step()
            upper.z, upper.vz = 2.0, 0.0
            lows.append(lower.z)
        return min(lows)

    assert lowest(downwash=True) < lowest(downwash=False) - 0.05


def test_walls_hold() -> None:
    world = World(site((3.5, 0)), Scenario(), 1)
    body = world.of(Quadrotor)["drone_1"]
    body.autopilot.take_off()
    for tick in range(2000):
        if tick == 1000:
            body.autopilot.move(MotionReferences(0, 0.2, 0.5, 0))
        world.step()
    assert body.airframe.x <= 4.0
    assert body.airframe.z <= 3.02


def run(seed: int, pads: tuple[tuple[float, float], ...] = ((0, 0), (1, 0)), ticks: int = 1400) -> np.ndarray:
    world = World(site(*pads), Scenario(), seed)
    for body in world.of(Quadrotor).values():
        body.autopilot.take_off()
    for _ in range(ticks):
        world.step()
    return world.states().copy()


def test_the_same_seed_is_the_same_world() -> None:
    np.testing.assert_array_equal(run(7), run(7))
    assert not np.array_equal(run(7), run(8))


def test_another_drone_does_not_change_the_draws_of_the_first() -> None:
    alone, together = run(7, ((0, 0),)), run(7, ((0, 0), (3, 0)))
    np.testing.assert_array_equal(alone[0], together[0])


def test_states_are_in_the_order_of_the_bodies() -> None:
    world = World(site((-1, 0.5), (-1, -0.5)), Scenario(), 1)
    assert world.bodies == ("drone_1", "drone_2", "turtlebot")
    states = world.states()
    np.testing.assert_allclose(states[:2, :2], [[-1, 0.5], [-1, -0.5]])
    assert (states[:, 12] == 1.0).all()
    assert world.airborne == ()


def test_the_target_waits_until_the_whole_team_has_been_in_the_air_long_enough() -> None:
    scenario = Scenario(target=TargetScenario(departs_after_team_s=1.0))
    world = World(site((-1, 0.5), (-1, -0.5)), scenario, 1)
    first, second = world.of(Quadrotor).values()
    first.autopilot.take_off()
    for _ in range(round(8.0 / TICK_S)):
        world.step()
    assert world.targets["turtlebot"].speed == 0.0
    second.autopilot.take_off()
    while len(world.airborne) < 2:
        world.step()
    for _ in range(round(0.9 / TICK_S)):
        world.step()
    assert world.targets["turtlebot"].speed == 0.0
    for _ in range(round(2.0 / TICK_S)):
        world.step()
    assert world.targets["turtlebot"].speed > 0.1
