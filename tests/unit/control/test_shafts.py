"""Others keep away from where a robot climbs, and from one in the air that is not in the belief."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.bus.messages import FlightState, Header, RelativeObservation, VehicleStatus
from groundstation.control.flight_mode import FlightMode
from groundstation.control.output_limiter import Limited, limit_setpoint
from groundstation.control.parameters import SafetyParameters, safety_from_field
from groundstation.control.setpoints import Setpoint
from groundstation.control.shafts import Shaft, Shafts
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, EntityKind, StateLayout
from groundstation.estimation.parameters import parameters_from_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

LAB = resolved_field(load_field(Path(__file__).parents[3] / "config/lab.yaml"))
S = 1_000_000_000
PAD = LAB.drones["drone_2"].pad_m
SAFETY = SafetyParameters(fence=((-3.7, 3.7), (-2.7, 2.7), (0.0, 2.8)))


def belief(stamp_ns: int, **places: tuple[float, float]) -> JointBelief:
    layout = StateLayout()
    for name in places:
        layout = layout.with_entity(name, EntityKind.ROBOT, ROBOT_CORE)
    mean = np.array([value for x, y in places.values() for value in (x, y, 1.4, 0.0)])
    return JointBelief(mean, 0.03**2 * np.eye(layout.dim), layout, stamp_ns)


class Team:
    """drone_1 tracks, drone_2 does what a test says."""

    def __init__(self) -> None:
        self.shafts, self.airborne = Shafts(parameters_from_field(LAB), safety_from_field(LAB)), {"drone_1"}

    def says(self, at_s: float, state: FlightState, mode: str) -> None:
        header = Header(0, "here", "drone_2", "drone_2", 0)
        status = VehicleStatus(header=header, flight_state=state, mode=mode)
        self.shafts.hear(status, round(at_s * S))

    def is_seen(self, at_s: float, x: float, y: float) -> None:
        header = Header(0, "here", "ceiling", "ceiling", 0)
        more: dict[str, Any] = {"camera": "ceiling", "yaw_rad": 0.0, "covariance": tuple(np.eye(4).ravel().tolist())}
        sighting = RelativeObservation(
            header=header, observer="ceiling", subject="drone_2", position_m=(x, -y, 4.0), **more
        )
        self.shafts.see(sighting, round(at_s * S))

    def around(self, at_s: float, **places: tuple[float, float]) -> dict[str, Shaft]:
        now = belief(round(at_s * S), drone_1=(1.0, 1.0), **places)
        self.shafts.advance(now, dict.fromkeys(now.layout.robots, (0.2, 0.0, 0.0)))
        return self.shafts.around(now, self.airborne)


@pytest.fixture
def team() -> Team:
    team = Team()
    team.says(0.0, FlightState.LANDED, "LANDED")
    return team


def test_who_climbs_has_a_shaft_from_the_order_until_it_is_in_the_belief(team: Team) -> None:
    assert team.around(1.0) == {}
    team.says(1.0, FlightState.LANDED, "TAKING_OFF")
    assert team.around(1.0) == {"drone_2": Shaft(*PAD)}
    team.says(2.0, FlightState.TAKING_OFF, "TAKING_OFF")
    team.says(3.0, FlightState.LOST, "TAKING_OFF")
    assert set(team.around(3.0)) == {"drone_2"}
    team.airborne.add("drone_2")
    team.says(4.0, FlightState.HOVERING, "HOVER")
    assert set(team.around(4.0)) == {"drone_2"}, "nobody has seen it yet"
    assert team.around(4.1, drone_2=(-0.4, -0.5)) == {}


def test_a_climb_that_is_called_off_leaves_no_shaft(team: Team) -> None:
    team.says(1.0, FlightState.TAKING_OFF, "TAKING_OFF")
    team.says(2.0, FlightState.LANDED, "LANDED")
    assert team.around(2.0) == {}


def test_who_climbs_in_the_belief_has_one_there(team: Team) -> None:
    team.airborne.add("drone_2")
    team.says(1.0, FlightState.TAKING_OFF, "TAKING_OFF")
    shaft = team.around(1.0, drone_2=(-0.2, -0.4))["drone_2"]
    assert (shaft.x, shaft.y) == pytest.approx((-0.2 + 0.2 * SAFETY.reaction_s, -0.4))
    assert math.sqrt(shaft.variance) == pytest.approx(0.03)


def test_it_climbs_where_it_was_seen_last_or_landed(team: Team) -> None:
    team.airborne.add("drone_2")
    team.around(1.0, drone_2=(0.7, 0.9))
    team.airborne.discard("drone_2")
    team.says(5.0, FlightState.LANDED, "LANDED")
    team.says(6.0, FlightState.LANDED, "TAKING_OFF")
    assert team.around(6.0)["drone_2"].x == pytest.approx(0.7 + 0.2 * SAFETY.reaction_s)
    team.is_seen(7.0, -1.1, 0.3)  # carried there
    shaft = team.around(7.0)["drone_2"]
    assert (shaft.x, shaft.y, shaft.drifted_m) == pytest.approx((-1.1, 0.3, 0.0), abs=0.02)


def test_one_that_nobody_finds_may_drift_and_one_that_stands_does_not(team: Team) -> None:
    team.says(60.0, FlightState.LANDED, "LANDED")
    team.says(61.0, FlightState.TAKING_OFF, "TAKING_OFF")
    assert team.around(62.0)["drone_2"].drifted_m == pytest.approx(2.0 * SAFETY.drift_m_s)
    assert team.around(600.0)["drone_2"].drifted_m == pytest.approx(10.0 * SAFETY.drift_m_s)


def test_one_that_flew_before_anybody_listened_may_be_anywhere() -> None:
    team = Team()
    team.airborne.add("drone_2")
    team.says(1.0, FlightState.FLYING, "HOVER")
    assert team.around(1.0) == {}


def limited(x: float, z: float, wanted: tuple[float, float, float], shafts: dict[str, Shaft]) -> Limited:
    layout = StateLayout().with_entity("a", EntityKind.ROBOT, ROBOT_CORE)
    at = JointBelief(np.array([x, 0.0, z, 0.0]), 1e-6 * np.eye(4), layout, 0)
    still = {"a": np.zeros(3)}
    return limit_setpoint("a", Setpoint(wanted, 0.0, FlightMode.TRACK), at, 0, SAFETY, still, None, shafts)


@pytest.mark.parametrize("z", [0.3, 1.4, 2.3])
def test_a_shaft_is_kept_out_of_at_any_height(z: float) -> None:
    keep_m = SAFETY.min_separation_m + SAFETY.margin_m + 0.002
    shafts = {"b": Shaft(0.0, 0.0, 0.0)}
    near = limited(-keep_m - 0.1, z, (0.5, 0.2, 0.1), shafts)
    assert near.limited_by == ("separation",)
    assert near.setpoint.velocity_m_s == pytest.approx((0.1 / (4.0 * SAFETY.reaction_s), 0.2, 0.1), abs=1e-3)
    assert limited(-keep_m - 0.1, z, (-0.5, 0.2, 0.1), shafts).limited_by == ()
    farther = limited(-keep_m - 0.1, z, (0.5, 0.0, 0.0), {"b": Shaft(0.0, 0.0, 0.0, drifted_m=0.1)})
    assert farther.setpoint.velocity_m_s[0] == pytest.approx(0.0, abs=1e-3)
    assert limited(-keep_m, z, (0.5, 0.0, 0.0), {"a": Shaft(0.0, 0.0)}).limited_by == (), "its own"


def test_right_above_a_climb_every_way_out_is_open() -> None:
    out = limited(0.0, 1.4, (-0.4, 0.1, 0.0), {"b": Shaft(0.0, 0.0)})
    assert out.setpoint.velocity_m_s == pytest.approx((-0.4, 0.1, 0.0))
    assert limited(0.0, 1.4, (0.4, 0.1, 0.0), {"b": Shaft(0.0, 0.0)}).limited_by == ("separation",)
