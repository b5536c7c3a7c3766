"""Ranging at message level: distances from the transponder, lasting errors, reflections, silence, full rounds."""

import math
from typing import Any

import numpy as np
import pytest

from groundstation.geometry.rotations import rotation_from_euler
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.ranges import Radios
from sim_bridge.scenario import Scenario
from sim_bridge.scenario_fit import misfits
from sim_bridge.site import SiteRanging
from sim_bridge.study.ranging_model import RangingEye

ANCHORS = {
    "a": (-3.0, -3.0, 2.5),
    "b": (3.0, -3.0, 2.5),
    "c": (3.0, 3.0, 2.5),
    "d": (-3.0, 3.0, 2.5),
    "e": (0.0, 30.0, 0.2),
}
BOX = {"x_m": (-3.0, 3.0), "y_m": (-3.0, 3.0), "z_m": (-0.1, 2.5)}
ROW = np.array([0.5, -0.3, 1.2, 0, 0, 0, 0.1, -0.05, 0.7, 0, 0, 0, 0])


def system(**changes: Any) -> SiteRanging:
    own = {"drone_1": {"position_m": (0.1, 0.0, 0.05)}}
    exact = {"range_std_m": 1e-9, "outlier_share": 0.0, "reach_m": 20.0, "transponders": own}
    return SiteRanging.model_validate({"anchors": ANCHORS, "volume_m": BOX, **exact, **changes})


def rounds(radios: Radios, count: int, robot: str = "drone_1") -> list[dict[str, float]]:
    return [radios.ranges_m(robot, ROW) for _ in range(count)]


def errors(told: list[dict[str, float]]) -> dict[str, np.ndarray]:
    point = ROW[:3] + rotation_from_euler(*ROW[6:9].tolist()) @ np.array([0.1, 0.0, 0.05])
    return {
        name: np.array([one[name] for one in told if name in one]) - math.dist(point.tolist(), at)
        for name, at in ANCHORS.items()
    }


def test_distances_are_the_transponders_and_end_at_the_reach() -> None:
    found = errors(rounds(Radios(system(), errors=False, rng=np.random.default_rng(1)), 200))
    assert all(np.abs(found[name]).max() < 1e-6 and 180 <= len(found[name]) < 200 for name in "abcd")
    assert len(found["e"]) == 0


def test_lasting_errors_belong_to_anchors_and_to_pairs() -> None:
    radios = Radios(system(bias_std_m=0.1), errors=True, rng=np.random.default_rng(3))
    one = [errors(rounds(radios, 2000))[name].mean() for name in "abcd"]
    other = [errors(rounds(radios, 2000, "drone_2"))[name].mean() for name in "abcd"]
    assert 0.02 < np.std(one) < 0.2 and np.corrcoef(one, other)[0, 1] > 0.5
    assert 0.03 < errors(rounds(radios, 2000))["a"].std() < 0.12


def test_reflections_are_too_long_and_as_often_as_told() -> None:
    found = errors(rounds(Radios(system(outlier_share=0.1), errors=False, rng=np.random.default_rng(2)), 1000))["a"]
    far = found[found > 0.1]
    assert 0.07 < len(far) / len(found) < 0.13 and far.min() > 0.19 and found.min() > -1e-6


def test_a_frozen_anchor_holds_its_last_range_to_each_robot() -> None:
    fault = Fault(kind=FaultKind.ANCHOR_FROZEN, entity="uwb", other="b", start_s=1.0, end_s=2.0)
    radios = Radios(system(range_std_m=0.1), errors=False, rng=np.random.default_rng(1), faults=[fault])
    told = {robot: [radios.ranges_m(robot, ROW, 0.1 * k) for k in range(30)] for robot in ("drone_1", "drone_2")}
    held = {robot: {one["b"] for one in rounds[10:20] if "b" in one} for robot, rounds in told.items()}
    assert all(len(values) == 1 for values in held.values()) and held["drone_1"] != held["drone_2"]
    assert all(len({one["a"] for one in rounds if "a" in one}) > 20 for rounds in told.values())
    assert all(len({one["b"] for one in rounds[20:] if "b" in one}) > 5 for rounds in told.values())


@pytest.mark.parametrize(
    ("entity", "other", "wrong"), [("uwb", "b", []), ("uwb", "z", ["'z' is none of a, b, c, d, e"]), ("x", "b", None)]
)
def test_a_frozen_anchor_is_one_of_its_system(entity: str, other: str, wrong: list[str] | None) -> None:
    empty: dict[str, Any] = {"drones": {}, "tracked": {}, "bodies": (), "motion_capture": {}}
    site: Any = type("Layout", (), {"ranging": {"uwb": system()}, **empty})
    fault = Fault(kind=FaultKind.ANCHOR_FROZEN, entity=entity, other=other, start_s=1.0)
    found = [one.text for one in misfits(Scenario(faults=(fault,)), site, ())]
    assert found == wrong if wrong is not None else "'x' is none of uwb" in found


class Room:
    """A sensor model's view of a world: two drones."""

    bodies = ("drone_1", "drone_2")
    time_s = 5.0

    def states(self) -> np.ndarray:
        return np.array([ROW, ROW + 0.2])


def test_each_round_is_placed_as_by_the_driver() -> None:
    site: Any = type("Layout", (), {"ranging": {"uwb": system(rate_hz=20.0)}, "drones": {"drone_1": 0, "drone_2": 0}})
    eye, room = RangingEye("uwb", site, errors=False, rng=np.random.default_rng(1)), Room()
    world: Any = room
    told = [one for stamp in range(10) for one in eye.look(world, stamp, "c")]
    assert eye.period_s == pytest.approx(0.05) and [one.subject for one in told[:2]] == ["drone_1", "drone_2"]
    placed = [one.position_m for one in told if one.subject == "drone_2" and one.position_m is not None]
    assert placed and math.dist(placed[0], (ROW + 0.2)[:3].tolist()) < 0.1
    assert [one.header.seq for one in told] == list(range(1, len(told) + 1))
