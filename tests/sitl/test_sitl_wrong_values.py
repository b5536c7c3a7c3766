"""Wrong values in flight at the wire: the drone, or the team, stops in time and hits nothing."""

from collections.abc import Callable
from pathlib import Path

import pytest
from sitl_run import SitlRun
from wire_tap import WireTap
from wrong_values import START_S, fly

from sim_bridge.fault_kinds import Fault, FaultKind

# The same faults are flown at message level in the campaign, and its survivors with each slow suite.
pytestmark = [pytest.mark.sitl, pytest.mark.slow, pytest.mark.exhaustive, pytest.mark.timeout(240)]


def fault(kind: FaultKind, entity: str = "drone_1", value: float | None = None, direction_deg: float = 0.0) -> Fault:
    return Fault(kind=kind, entity=entity, start_s=START_S, value=value, direction_deg=direction_deg)


STOPPED = {
    "velocity stuck at 0": fault(FaultKind.VELOCITY_STUCK, value=0.0),
    "velocity stuck at 0.5": fault(FaultKind.VELOCITY_STUCK, value=0.5),
    "telemetry frozen": fault(FaultKind.TELEMETRY_FROZEN),
    "uniform floor": fault(FaultKind.UNIFORM_FLOOR),
    "ceiling picture frozen": fault(FaultKind.PICTURE_FROZEN, "ceiling"),
}
# These need not stop a drone, but must cause nothing unsafe.
BORNE = {
    "ceiling bumped": fault(FaultKind.CAMERA_BUMPED, "ceiling", 5.0),
    "ceiling picture black": fault(FaultKind.PICTURE_BLACK, "ceiling"),
    "velocity drifting": fault(FaultKind.VELOCITY_DRIFTING, value=0.05, direction_deg=90.0),
    "velocity jumping": fault(FaultKind.VELOCITY_JUMPING, value=0.5),
    "velocity scaled": fault(FaultKind.VELOCITY_SCALED, value=2.0),
    "telemetry late": fault(FaultKind.TELEMETRY_DELAYED, value=0.7),
    "heading jumping": fault(FaultKind.HEADING_JUMPING, value=60.0),
    "obstacle below": fault(FaultKind.OBSTACLE_BELOW, value=0.5),
    "battery stuck": fault(FaultKind.BATTERY_STUCK, value=1.0),
    "wind": fault(FaultKind.WIND, value=1.0, direction_deg=45.0),
}


@pytest.mark.parametrize("wrong", STOPPED.values(), ids=STOPPED)
def test_a_drone_with_wrong_values_stops_in_time(
    sitl: Callable[..., SitlRun], tap: WireTap, wrong: Fault, tmp_path: Path
) -> None:
    verdict = fly(sitl, tap, wrong, tmp_path)
    assert verdict["unsafe"] == {}, verdict
    # A drone that hardly moved when the fault began is stopped before its motion could show it.
    stopped = verdict["modes"].get(wrong.entity, "TRACK") != "TRACK"
    assert stopped or verdict["hover_s"] or verdict["rest_s"], "the fault never showed, or nobody moved"


@pytest.mark.parametrize("wrong", BORNE.values(), ids=BORNE)
def test_nothing_unsafe_follows(sitl: Callable[..., SitlRun], tap: WireTap, wrong: Fault, tmp_path: Path) -> None:
    verdict = fly(sitl, tap, wrong, tmp_path)
    assert verdict["unsafe"] == {}, verdict
