"""Wrong values: effect of each fault on an honest reading, for both kinds of vehicles and in the world."""

import json
import math
from dataclasses import replace
from typing import Any

import pytest

from drivers.ardrone.wire import navdata
from drivers.ardrone.wire.options import DEMO
from drivers.mavlink.wire.names import Flavour
from groundstation.errors import SettingsError
from sim_bridge.devices.ardrone_control import FlightControl
from sim_bridge.devices.ardrone_edge import ArDroneEdge
from sim_bridge.devices.ardrone_navdata import NavdataWriter
from sim_bridge.devices.mavlink_messages import Speaker
from sim_bridge.devices.mavlink_parameters import Parameters
from sim_bridge.devices.mavlink_px4 import Px4
from sim_bridge.fault_kinds import RULES, Fault, FaultKind, Part, exchanged
from sim_bridge.mavlink_scenario import CopterScenario
from sim_bridge.mounting import turned_about
from sim_bridge.scenario import DroneScenario, parse_scenario
from sim_bridge.world.airframe import GRAVITY_M_S2
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.ardrone_sensors import Onboard
from sim_bridge.world.mavlink_copter import PX4_RESPONSE, MavlinkCopter
from sim_bridge.world.noise import generator_of
from sim_bridge.world.readings import Readings
from sim_bridge.world.world import TICK_NS
from sim_bridge.wrong_values import CHANGES, WRONG_VALUES, WrongValues

TICK_S = 0.005
HONEST = Readings(
    100, (0.4, -0.2, 0.1), 0.02, -0.03, 1.0, (0.1, 0.2, 0.3), (0.0, 0.1, 9.8), 0.7, 1.5, 1.52, status=("flying",)
)


def fault(kind: str, **more: Any) -> Fault:
    return Fault(kind=FaultKind(kind), entity="drone_1", start_s=2.0, **more)


def reported(now_s: float, *faults: Fault, honest: Readings = HONEST) -> Readings:
    return WrongValues(faults).report(now_s, honest)


def test_before_and_after_a_fault_everything_is_honest() -> None:
    wrong = WrongValues([fault("velocity_stuck", end_s=3.0)])
    assert [wrong.report(t, HONEST) is HONEST for t in (1.9, 2.0, 2.9, 3.0)] == [True, False, False, True]


@pytest.mark.parametrize(
    ("broken", "changed"),
    [
        (fault("velocity_stuck"), {"velocity": (0.0, 0.0, 0.1)}),
        (fault("velocity_stuck", value=0.5, direction_deg=90), {"velocity": (0.0, 0.5, 0.1)}),
        (fault("velocity_scaled", value=-1), {"velocity": (-0.4, 0.2, 0.1)}),
        (fault("velocity_drifting", value=0.1), {"velocity": (0.7, -0.2, 0.1)}),
        (fault("velocity_jumping", value=0.5, direction_deg=180), {"velocity": (-0.1, -0.2, 0.1)}),
        (fault("heading_drifting", value=10), {"yaw": 1.0 + math.radians(30)}),
        (fault("heading_jumping", value=-90), {"yaw": 1.0 - math.pi / 2}),
        (fault("battery_stuck"), {"battery": 1.0}),
        (fault("uniform_floor"), {"velocity": (0.0, 0.0, 0.1)}),
        (fault("obstacle_below", value=0.5), {"height": 1.0, "echo": 1.02}),
    ],
)
def test_each_kind_changes_what_it_names_and_nothing_else(broken: Fault, changed: dict[str, Any]) -> None:
    found, wanted = reported(5.0, broken), replace(HONEST, **changed)
    assert found.velocity == pytest.approx(wanted.velocity)
    assert found.yaw == pytest.approx(wanted.yaw)
    assert replace(found, velocity=(0, 0, 0), yaw=0.0, height=0.0, echo=0.0) == replace(
        wanted, velocity=(0, 0, 0), yaw=0.0, height=0.0, echo=0.0
    )
    assert (found.height, found.echo) == pytest.approx((wanted.height, wanted.echo))


def test_every_kind_that_reports_wrongly_is_tried_above() -> None:
    (mark,) = test_each_kind_changes_what_it_names_and_nothing_else.pytestmark
    assert {case[0].kind for case in mark.args[1]} == set(CHANGES) | {FaultKind.UNIFORM_FLOOR}


def test_over_a_uniform_floor_the_velocity_may_be_noise_about_zero() -> None:
    wrong = WrongValues([fault("uniform_floor", value=1)])
    told = [wrong.report(2.0 + 0.005 * n, HONEST).velocity for n in range(400)]
    assert len(set(told)) == 400
    for axis in range(2):
        values = [velocity[axis] for velocity in told]
        assert abs(sum(values) / 400) < 0.01
        assert 0.01 < math.sqrt(sum(value**2 for value in values) / 400) < 0.05


def test_over_a_uniform_floor_the_velocity_may_follow_the_tilts_alone() -> None:
    wrong = WrongValues([fault("uniform_floor", value=2)])
    told = [wrong.report(2.0 + 0.005 * n, replace(HONEST, roll=0.0, pitch=0.0)).vx for n in range(800)]
    assert told[0] == pytest.approx(0.4, abs=0.05)
    assert told[-1] == pytest.approx(0.4 * math.exp(-2.0), abs=0.05)
    leaning = [wrong.report(6.0 + 0.005 * n, replace(HONEST, roll=0.0, pitch=0.05)).vx for n in range(200)]
    assert leaning[-1] > told[-1] + 0.3


def test_frozen_telemetry_repeats_all_it_said_last_clock_and_state_included() -> None:
    wrong = WrongValues([fault("telemetry_frozen", end_s=4.0)])
    said = [wrong.report(1.0 + 0.5 * n, replace(HONEST, ticks=n, roll=0.01 * n, status=(n,))) for n in range(8)]
    assert [one.ticks for one in said] == [0, 1, 2, 2, 2, 2, 6, 7]
    assert said[5] == said[2]


def test_delayed_telemetry_is_as_old_as_told() -> None:
    wrong = WrongValues([fault("telemetry_delayed", value=1.0)])
    said = [wrong.report(0.5 * n, replace(HONEST, ticks=n)).ticks for n in range(8)]
    assert said == [0, 1, 2, 3, 2, 3, 4, 5]


def test_two_faults_add_up() -> None:
    both = reported(3.0, fault("velocity_jumping", value=1.0), fault("velocity_scaled", value=0.5))
    assert both.velocity[0] == pytest.approx(0.7)


def test_on_the_floor_an_obstacle_changes_nothing() -> None:
    standing = replace(HONEST, height=0.0, echo=0.243)
    assert reported(3.0, fault("obstacle_below"), honest=standing) == standing


class Drone:
    """A flying emulated AR.Drone, and its `ArDroneEdge`."""

    def __init__(self, *faults: Fault, **scenario: Any) -> None:
        figures = DroneScenario(**scenario)
        self.body = Quadrotor((0.0, 0.0), 0.7, figures, TICK_S, generator_of(1, "drone_1"))
        self.onboard = Onboard(figures, TICK_S, self.body.airframe, generator_of(1, "drone_1/onboard"))
        self.onboard.trim()
        self.edge = ArDroneEdge(self.body, self.onboard, FlightControl(self.body, self.onboard), WrongValues(faults))
        self.writer, self.ticks = NavdataWriter(), 0

    def fly(self, seconds: float) -> "Drone":
        self.body.autopilot.take_off()
        for _ in range(round(seconds / TICK_S)):
            self.ticks += 1
            self.body.step((0.0, 0.0, 0.0))
            self.onboard.step(self.body, self.body.autopilot.motors_on, air=self.body.air)
            self.edge.step(self.ticks * TICK_NS)
        return self

    def packet(self) -> bytes:
        state, readings, ticks = self.edge.reported(self.ticks)
        return bytes(self.writer.full(state, readings, ticks, self.ticks))


def test_an_ardrone_repeats_its_packet_but_for_the_number() -> None:
    drone = Drone(fault("telemetry_frozen"))
    drone.fly(5.0)
    first = navdata.decode(drone.packet())
    drone.fly(0.5)
    second = navdata.decode(drone.packet())
    assert first.sequence != second.sequence
    assert (first.state, first.options) == (second.state, second.options)


def test_an_ardrone_reports_the_velocity_it_is_told_to() -> None:
    drone = Drone(fault("velocity_stuck", value=0.5)).fly(5.0)
    demo = navdata.decode(drone.packet()).read(DEMO)
    assert demo is not None
    assert (demo.vx_mm_s, demo.vy_mm_s) == pytest.approx((500.0, 0.0))


def test_over_a_uniform_floor_nothing_stops_a_drone() -> None:
    seeing, blind = Drone().fly(6.0), Drone().fly(6.0)
    blind.body.autopilot.blind = True
    for drone in (seeing, blind):
        drone.body.airframe.vx = 0.5
        drone.fly(2.0)
    assert abs(seeing.body.airframe.vx) < 0.1
    assert blind.body.airframe.vx > 0.35


def test_over_an_obstacle_a_drone_rises_by_its_height() -> None:
    drone = Drone().fly(8.0)
    before = drone.body.airframe.z
    drone.body.autopilot.floor_m = 0.4
    drone.fly(6.0)
    assert drone.body.airframe.z - before == pytest.approx(0.4, abs=0.08)


def test_wind_leans_an_ardrone_and_its_navdata_do_not_say_so() -> None:
    drone = Drone(attitude_noise_deg=0.0, attitude_bias_deg=0.0).fly(6.0)
    push = GRAVITY_M_S2 * math.tan(math.radians(8.0))
    drone.body.wind = (push, 0.0)
    drone.fly(8.0)
    body = drone.body.airframe
    assert math.degrees(math.hypot(body.roll, body.pitch)) == pytest.approx(8.0, abs=1.0)
    assert math.degrees(math.hypot(drone.onboard.roll, drone.onboard.pitch)) < 1.0
    assert math.hypot(body.vx, body.vy) < 0.15


def test_moving_air_is_a_figure_of_the_scenario_and_still_by_default() -> None:
    leans = []
    for lean in (0.0, 10.0):
        drone = Drone(moving_air_lean_deg=lean, moving_air_correlation_s=2.0).fly(6.0)
        found = []
        for _ in range(200):
            drone.fly(0.1)
            found.append(math.degrees(math.atan(math.hypot(*drone.body.air) / GRAVITY_M_S2)))
        leans.append(max(found))
    assert leans[0] == 0.0
    assert 5.0 <= leans[1] <= 10.0 + 1e-9


def test_still_air_leaves_every_other_draw_as_it_was() -> None:
    still, moving = (Drone(moving_air_lean_deg=lean) for lean in (0.0, 10.0))
    assert still.body.battery == moving.body.battery
    assert [a.step() for a in still.body._unrest] == [a.step() for a in moving.body._unrest]


def copter() -> Speaker:
    body = MavlinkCopter((0.0, 0.0), 0.0, CopterScenario(), PX4_RESPONSE, TICK_S, generator_of(1, "drone_1"))
    for _ in range(20):
        body.estimate.aid((1.0, 2.0, 0.1), 0.3, 0)
    body.estimate.velocity = (0.3, 0.1, 0.0)
    return Speaker(Px4(body, Parameters(Flavour.PX4, 11, True)))


def test_a_mavlink_vehicle_reports_wrong_values_too() -> None:
    speaker = copter()
    speaker.boot_us = 3_000_000
    speaker.report(3.0, WrongValues([fault("velocity_stuck"), fault("battery_stuck", value=0.42)]))
    message: Any = speaker.local_position()
    assert (message.vx, message.vy) == (0.0, -0.0)
    assert (message.x, message.y) == (1.0, -2.0)
    battery: Any = speaker.battery()
    assert battery.battery_remaining == 42


def test_a_frozen_mavlink_vehicle_repeats_its_clock_and_its_mode() -> None:
    speaker = copter()
    wrong = WrongValues([fault("telemetry_frozen")])
    said = []
    for seconds in (2, 3, 4):
        speaker.boot_us = seconds * 1_000_000
        speaker.report(float(seconds), wrong)
        speaker._firmware.armed = True
        said.append((speaker.local_position(), speaker.heartbeat(), speaker.quaternion()))
    assert said[0] == said[1] == said[2]


def test_wind_moves_a_mavlink_vehicle_until_it_leans_against_it() -> None:
    body = MavlinkCopter((0.0, 0.0), 0.0, CopterScenario(), PX4_RESPONSE, TICK_S, generator_of(1, "drone_1"))
    body.airframe.z, body.airframe.on_ground = 1.0, False
    body.wind = (1.5, 0.0)
    for _ in range(1600):
        body.estimate.aid((body.airframe.x, body.airframe.y, body.airframe.z), body.airframe.yaw, 0)
        body.fly((0.0, 0.0, 0.0), 0.0)
        body.step((0.0, 0.0, 0.0))
        body.estimate.step(body.airframe, True)
    assert body.airframe.x > 0.1
    assert math.degrees(body.airframe.pitch) == pytest.approx(-8.7, abs=1.5)
    assert abs(body.airframe.vx) < 0.15


def test_every_kind_has_rules_and_every_vehicle_kind_is_applied_somewhere() -> None:
    assert set(RULES) == set(FaultKind)
    world = {"uniform_floor", "obstacle_below", "wind", "propeller_blocked", "battery_drop"}
    links = {"navdata_silent", "at_deaf", "ids_swapped"}
    of_vehicles = {k for k, rules in RULES.items() if rules.part in (Part.VEHICLE, Part.ABLE_VEHICLE)}
    assert of_vehicles == WRONG_VALUES | {FaultKind(kind) for kind in world | links}


@pytest.mark.parametrize(
    ("entry", "complaint"),
    [
        ({"kind": "telemetry_frozen", "value": 1}, "telemetry_frozen has no value"),
        ({"kind": "telemetry_delayed", "value": 11}, "value of telemetry_delayed must be from 0.0 to 10.0"),
        ({"kind": "wrong_board"}, "wrong_board needs another entity in other"),
        ({"kind": "wrong_board", "other": "drone_1"}, "wrong_board needs another entity in other"),
        ({"kind": "wind", "other": "drone_2"}, "wind has no other"),
        ({"kind": "ids_swapped", "other": "drone_2", "start_s": 1}, "swapped from the start"),
    ],
)
def test_faults_that_mean_nothing_are_refused(entry: dict[str, Any], complaint: str) -> None:
    with pytest.raises(SettingsError, match=complaint):
        parse_scenario(json.dumps({"faults": [{"entity": "drone_1", "start_s": 0} | entry]}))


def test_swapped_ids_lead_to_the_other_body() -> None:
    swap = Fault(kind=FaultKind.IDS_SWAPPED, entity="drone_1", other="drone_2", start_s=0)
    assert exchanged([swap]) == {"drone_1": "drone_2", "drone_2": "drone_1"}


def test_a_camera_is_turned_about_an_axis_of_its_image() -> None:
    up = turned_about(10.0, 0.0) @ [0.0, 0.0, 1.0]
    assert up[1] == pytest.approx(-math.sin(math.radians(10.0))), "image down is +y: it looks higher"
    left = turned_about(10.0, 90.0) @ [0.0, 0.0, 1.0]
    assert left[0] == pytest.approx(-math.sin(math.radians(10.0)))
