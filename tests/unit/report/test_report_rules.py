"""The rules of the report one by one: definitions of tracking, switch, late, CPU."""

import math
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from groundstation.bus import messages as m
from groundstation.field.drones import FieldDrone, OnboardCamera
from groundstation.field.room import Fence, LensCalibration, RoomObstacle
from groundstation.field.targets import DroneMarker, Target, TargetMarker
from groundstation.geometry.ellipse import semi_axes_95
from groundstation.report import load, topology_use
from groundstation.report.accuracy import accuracy
from groundstation.report.criteria import Criterion, criteria_of, invalidity, overload
from groundstation.report.interval import tracking_interval, tracking_spans
from groundstation.report.judge import judge
from groundstation.report.metrics import figures_of
from groundstation.report.run_facts import RunFacts
from groundstation.report.safety import all_airborne_s, fence_violation_m, min_obstacle_m
from groundstation.report.tracks import UNKNOWN_FIELD, EstimateTrack, ProcessTrack, RunData, TimedMessage, TruthTrack

LENS = LensCalibration(
    model="plumb_bob",
    width_px=640,
    height_px=360,
    fx_px=560.0,
    fy_px=560.0,
    cx_px=320.0,
    cy_px=180.0,
    distortion=(0.0, 0.0, 0.0, 0.0, 0.0),
)
DRONE = FieldDrone(
    kind="ardrone",
    address="192.168.1.11",
    marker=DroneMarker(code=1),
    camera=OnboardCamera(source="/dev/video0", calibration=LENS),
    pad_m=(0.0, 0.0),
)
TARGET = Target(marker=TargetMarker(code=5))
HEADER = m.Header(0, "here", "team", "tester", 0)
STARVED = [(0.6, 1.2, 2.0), (0.6, 0.1, 0.0), (0.05, 1.2, 0.0), (0.95, 0.4, 2.0), (0.6, 0.4, 0.0)]


def _data(**content: object) -> RunData:
    resolved = msgspec.structs.replace(UNKNOWN_FIELD, drones={"a": DRONE, "b": DRONE})
    return RunData(resolved, RunFacts(), end_s=100.0, **content)  # type: ignore[arg-type]


def _ack(time_s: float, verb: m.Verb, stage: m.AckStage, name: str = "x") -> TimedMessage[m.CommandAck]:
    return TimedMessage(time_s, m.CommandAck(header=HEADER, command_id=name, verb=verb, stage=stage))


def _command(time_s: float, verb: m.Verb, *scope: str) -> TimedMessage[m.Command]:
    return TimedMessage(time_s, m.Command(header=HEADER, id="x", verb=verb, scope=scope, issuer="me"))


def _plan(time_s: float, text: str, seconds: float = 0.01) -> TimedMessage[m.Plan]:
    solver = m.SolverReport("ok", 1, seconds, 1, 1)
    plan = m.Plan(
        header=HEADER, topology=text, cost=1.0, controls=(), edges=(), alternatives=(), solver=solver, mode="multistart"
    )
    return TimedMessage(time_s, plan)


def _status(time_s: float, state: m.FlightState) -> TimedMessage[m.VehicleStatus]:
    return TimedMessage(time_s, m.VehicleStatus(header=HEADER, flight_state=state, mode="HOVER"))


def _track(times: np.ndarray, cpu: np.ndarray, counters: np.ndarray | None = None) -> ProcessTrack:
    count = len(times)
    nobody = np.full(count, np.nan)
    return ProcessTrack(times, cpu, np.zeros((count, 4)) if counters is None else counters, np.zeros(count), nobody)


def _truth(ground: list[bool], z: float = 1.0) -> TruthTrack:
    count = len(ground)
    position = np.tile([0.0, 0.0, z], (count, 1))
    return TruthTrack(np.arange(count, dtype=np.float64), position, np.zeros(count), np.array(ground))


@pytest.mark.parametrize(
    ("text", "kind"),
    [("a,b", "flat"), ("a/b", "string"), ("a/b/c", "string"), ("a,b/c", "other"), ("a", "other"), ("", "other")],
)
def test_kinds_of_topology(text: str, kind: str) -> None:
    assert topology_use.kind_of(text) == kind


@pytest.mark.parametrize(
    ("mode", "tracking_s", "failed"),
    [
        ("demo", None, {"topology_seconds.string"}),
        ("demo", 30.0, {"topology_seconds.string"}),
        ("demo", 29.0, set()),
        ("sitl", None, set()),
        ("fly", None, set()),
    ],
)
def test_both_topologies_must_occur_in_a_demo_that_lasts(mode: str, tracking_s: float | None, failed: set[str]) -> None:
    data = _data(plans=[_plan(0.0, "a,b"), _plan(10.0, "a,b")])
    seconds = topology_use.topology_seconds(data, 0.0, 20.0)
    figures = msgspec.structs.replace(figures_of(data), topology_seconds=seconds, sim_overrun_percent=0.0)
    facts = RunFacts(mode=mode, tracking_s=tracking_s)
    judged = [c for c in criteria_of(figures, data.resolved, facts) if c.name.startswith("topology")]
    assert {criterion.name for criterion in judged if not criterion.ok} == failed
    assert bool(judged) == bool(failed)


def test_a_refused_track_starts_nothing() -> None:
    assert tracking_interval(_data(acks=[_ack(5.0, m.Verb.TRACK, m.AckStage.REFUSED)])) is None


def test_tracking_begins_with_the_first_drone_and_ends_with_the_teams_landing() -> None:
    acks = [_ack(time_s, m.Verb.TRACK, m.AckStage.ACCEPTED) for time_s in (5.0, 5.1)]
    commands = [
        _command(1.0, m.Verb.LAND),
        _command(20.0, m.Verb.LAND, "a"),
        _command(30.0, m.Verb.HOLD),
        _command(40.0, m.Verb.LAND, "b", "a"),
    ]
    assert tracking_interval(_data(acks=acks, commands=commands)) == (5.0, 40.0)
    assert tracking_interval(_data(acks=acks, commands=commands[:3])) == (5.0, 100.0)


def test_each_flight_of_a_run_counts_but_not_the_time_between_them() -> None:
    acks = [
        _ack(at_s, m.Verb.TRACK, m.AckStage.ACCEPTED, name) for at_s, name in ((5.0, "x"), (60.0, "y"), (41.0, "x"))
    ]
    commands = [_command(40.0, m.Verb.LAND), _command(55.0, m.Verb.TAKEOFF), _command(90.0, m.Verb.CUT_MOTORS)]
    data = _data(acks=acks, commands=commands)
    assert tracking_spans(data) == ((5.0, 40.0), (60.0, 90.0)) and tracking_interval(data) == (5.0, 90.0)
    at_s = np.arange(0.0, 100.0, 0.05)
    away_m = np.select([at_s < 40.0, at_s < 60.0], [0.0, 100.0], 0.4)
    estimate = EstimateTrack(
        "target", at_s, np.column_stack((away_m, 0.0 * at_s)), np.tile(np.eye(2), (len(at_s), 1, 1))
    )
    still = TruthTrack(at_s, np.zeros((len(at_s), 3)), np.zeros(len(at_s)), np.ones(len(at_s), bool))
    resolved = msgspec.structs.replace(data.resolved, target=None, targets={"t": TARGET})
    figures = figures_of(replace(data, resolved=resolved, truth={"t": still}, estimates={"t": estimate}))
    assert figures.tracked_s == 65.0
    assert figures.target_rmse_m == pytest.approx(0.4 * math.sqrt(30.0 / 65.0), abs=0.002)


def test_drones_that_are_landed_one_by_one_end_a_flight_and_a_change_of_battery_does_not() -> None:
    acks = [_ack(5.0, m.Verb.TRACK, m.AckStage.ACCEPTED)]
    lands_a, lands_b = _command(20.0, m.Verb.LAND, "a"), _command(30.0, m.Verb.LAND, "b")
    assert tracking_spans(_data(acks=acks, commands=[lands_a, lands_b])) == ((5.0, 30.0),)
    again = _command(25.0, m.Verb.TAKEOFF, "a")
    assert tracking_spans(_data(acks=acks, commands=[lands_a, again, lands_b])) == ((5.0, 100.0),)


def test_a_robot_that_joins_is_no_switch() -> None:
    data = _data(plans=[_plan(time_s, text) for time_s, text in ((0.0, "a"), (0.1, "a,b"), (0.2, "a/b"), (0.3, "b/a"))])
    assert topology_use.switches(data, 0.0, 1.0) == 2


def test_a_silent_planner_flies_no_topology() -> None:
    seconds = topology_use.topology_seconds(_data(plans=[_plan(0.0, "a,b"), _plan(10.0, "a,b")]), 0.0, 20.0)
    assert seconds == {"flat": 1.0, "string": 0.0, "other": 0.0, "a,b": 1.0}


def test_counters_go_on_across_a_restart() -> None:
    # columns: pid, ticks, overruns, overflowed
    counters = np.array([[1, 50, 0, 0], [1, 100, 2, 0], [2, 10, 0, 0], [2, 60, 1, 0]], dtype=float)
    data = _data(processes={"tracker": _track(np.array([1.0, 2.0, 3.0, 4.0]), np.zeros(4), counters)})
    ticks, missed, _rate = load.tracker_deadlines(data)
    assert (ticks, missed) == (160, 3)


def test_planner_and_tracker_are_judged_in_flight_not_on_the_floor() -> None:
    """Nine hundred quiet seconds on the pads hid a tracker that stood still for seven in the air."""
    times = np.arange(1.0, 901.0)
    flying = (times > 890.0) & (times <= 897.0)
    ticks, missed = np.cumsum(np.where(flying, 10.0, 50.0)), np.cumsum(np.where(flying, 5.0, 0.0))
    counters = np.column_stack((np.ones(900), ticks, missed, np.zeros(900)))
    plans = [_plan(at_s, "a,b", 0.4 if slow else 0.003) for at_s, slow in zip(times, flying, strict=True)]
    known = replace(_data(plans=plans), end_s=900.0)
    known.processes["tracker"] = _track(times, np.zeros(900), counters)
    orders = [_command(897.0, m.Verb.LAND)]
    tracked = replace(known, acks=[_ack(890.5, m.Verb.TRACK, m.AckStage.ACCEPTED)], commands=orders)
    said = [_status(890.5, m.FlightState.HOVERING), _status(897.0, m.FlightState.LANDED)]
    for data in (tracked, replace(known, vehicles={"a": said})):
        figures = figures_of(data)
        assert (figures.tracker_ticks, figures.tracker_missed, figures.tracker_rate_hz) == (70, 35, 10.0)
        assert figures.planner_p99_ms == pytest.approx(400.0)
    resting = figures_of(known)
    assert resting.tracker_missed_percent is not None and resting.tracker_missed_percent < 1.0
    assert figures_of(replace(tracked, plans=plans[:800])).planner_p99_ms is None, "it planned nothing in flight"


def test_cpu_is_averaged_over_the_whole_run() -> None:
    whole = _track(np.arange(11.0), np.full(11, 0.5))
    half = _track(np.arange(6.0), np.full(6, 0.4))
    cores = load.cpu_cores(_data(processes={"tracker": whole, "camera": half}))
    assert cores == pytest.approx({"camera": 0.2, "tracker": 0.5})


def _load(waited: float, others_cpu: float) -> RunData:
    times = np.arange(1.0, 41.0)
    camera = replace(_track(times + 0.3, np.full(40, 0.2)), waited=np.where(times < 13.0, waited, 0.05))
    supervisor = replace(_track(times, np.full(40, 0.01)), others_cpu=np.where(times > 10.0, others_cpu, 0.1))
    return _data(processes={"camera": camera, "supervisor": supervisor})


@pytest.mark.parametrize(("waited", "others_cpu", "starved_s"), STARVED)
def test_a_run_that_waits_for_cores_of_others_starves(waited: float, others_cpu: float, starved_s: float) -> None:
    assert load.starved_s(_load(waited, others_cpu), 5.0, 30.0) == starved_s


def test_a_run_that_waits_for_cores_of_a_small_computer_is_told_so() -> None:
    shares = load.waited(_load(0.6, 0.1), 2.0, 12.0)
    assert shares == {"camera": pytest.approx(0.6), "supervisor": pytest.approx(0.0)}
    figures = msgspec.structs.replace(figures_of(_data()), waited={**shares, "diagnosis": 0.9})
    assert overload(figures).startswith("camera waited for a core 60% of the time")
    assert overload(msgspec.structs.replace(figures, waited={"camera": 0.19, "diagnosis": 0.9})) == ""


def test_a_starved_simulated_run_that_fails_says_nothing_and_one_that_passes_counts() -> None:
    figures = msgspec.structs.replace(figures_of(_data()), sim_overrun_percent=0.9, starved_s=4.0)
    met, missed = Criterion("landed", True, "==", True, ok=True), Criterion("target_lost_s", 2.1, "<=", 2.0, ok=False)
    unsafe = Criterion("max_fence_violation_m", 0.1, "<=", 0.0, ok=False)
    assert invalidity(figures, [met]) == ""
    assert invalidity(figures, [met, missed]) == "other programs kept it from the processor for 4 s"
    assert invalidity(figures, [missed, unsafe]) == ""  # must not happen on any computer
    assert invalidity(msgspec.structs.replace(figures, starved_s=1.0), [missed]) == ""
    assert invalidity(msgspec.structs.replace(figures, sim_overrun_percent=None), [missed]) == ""


def test_the_distance_from_obstacles_is_that_of_flying_drones() -> None:
    data, box = _data(truth={"a": _truth([True, False])}), RoomObstacle(centre_m=(3.0, 0.0), size_m=(1.0, 1.0, 2.0))
    room = msgspec.structs.replace(data.resolved.room, obstacles={"box": box})
    boxed = replace(data, resolved=msgspec.structs.replace(data.resolved, room=room))
    assert min_obstacle_m(boxed) == pytest.approx(2.5)
    assert min_obstacle_m(replace(boxed, truth={"a": _truth([True, True])})) is None
    assert min_obstacle_m(data) is None


def test_the_fence_binds_flying_drones_only() -> None:
    fence = Fence(x_m=(-1.0, 1.0), y_m=(-1.0, 1.0), z_m=(0.0, 0.7))
    assert fence_violation_m(_truth([True, True]), fence) == 0.0
    assert fence_violation_m(_truth([True, False]), fence) == pytest.approx(0.3)
    assert fence_violation_m(_truth([False], z=-0.0005), fence) == 0.0


def test_airborne_means_all_at_once() -> None:
    apart = {"a": _truth([False, False, True, True]), "b": _truth([True, True, False, False])}
    assert all_airborne_s(_data(truth=apart)) is None
    together = {"a": _truth([True, False, False, True]), "b": _truth([True, True, False, False])}
    assert all_airborne_s(_data(truth=together)) == 2.0


def test_honest_covariance_gives_one() -> None:
    generator = np.random.default_rng(3)
    times = np.arange(4000) / 10
    covariance = np.array([[0.04, 0.01], [0.01, 0.02]])
    noise = generator.multivariate_normal([0.0, 0.0], covariance, len(times))
    truth = TruthTrack(times, np.zeros((len(times), 3)), np.zeros(len(times)), np.ones(len(times), dtype=bool))
    estimate = EstimateTrack("target", times, noise, np.tile(covariance, (len(times), 1, 1)))
    figures = accuracy(times, truth, estimate, 2)
    assert figures is not None
    assert figures.anees == pytest.approx(1.0, abs=0.06)
    assert figures.rmse_m == pytest.approx(np.sqrt(0.06), rel=0.05)
    assert figures.covered == 1.0


def test_a_singular_covariance_gives_no_ratio_and_no_crash() -> None:
    times = np.arange(10) / 10
    truth = TruthTrack(times, np.zeros((10, 3)), np.zeros(10), np.ones(10, dtype=bool))
    estimate = EstimateTrack("target", times, np.zeros((10, 2)), np.zeros((10, 2, 2)))
    figures = accuracy(times, truth, estimate, 2)
    assert figures is not None and figures.anees is None


def test_ellipse_holds_95_percent() -> None:
    major, minor, angle = semi_axes_95(1.0, 0.0, 4.0)
    assert (major, minor) == pytest.approx((2 * 2.4477, 2.4477), abs=1e-3)
    assert abs(np.sin(angle)) == pytest.approx(1.0)
    assert semi_axes_95(2.0, 1.0, 2.0)[2] == pytest.approx(np.pi / 4)
    smallest, largest = np.linalg.eigvalsh([[0.04, 0.015], [0.015, 0.02]])
    axes = semi_axes_95(0.04, 0.015, 0.02)[:2]
    assert axes == pytest.approx((np.sqrt(largest * 5.991), np.sqrt(smallest * 5.991)), rel=1e-3)
    samples = np.random.default_rng(1).normal(size=(20000, 2)) * [1.0, 2.0]
    inside = (samples[:, 1] / major) ** 2 + (samples[:, 0] / minor) ** 2 <= 1
    assert np.mean(inside) == pytest.approx(0.95, abs=0.006)


@pytest.mark.parametrize(("counters", "percent"), [([1000, 5, 0, 0], 0.5), ([1000, 5, 200, 4], 2.0)])
def test_a_simulator_is_as_late_as_the_worse_of_its_ticks_and_pictures(counters: list[int], percent: float) -> None:
    assert load.sim_overrun_percent(_data(sim_counters=np.array([counters], dtype=float))) == pytest.approx(percent)


def test_a_run_that_was_broken_off_before_it_flew_failed_for_that_reason_alone(tmp_path: Path) -> None:
    text = "run ended: nobody took off: drone_1 stands on the pad of drone_2; all drones are on the ground"
    header = m.Header(0, "here", m.RUN, "supervisor", 0)
    ended = TimedMessage(2.0, m.Event(header=header, severity=m.Severity.ERROR, text=text))
    assert judge(_data(events=[ended]), tmp_path).reasons == (text.removeprefix(m.RUN_ENDED),)


def test_a_landing_missing_from_a_truncated_recording_is_not_judged(tmp_path: Path) -> None:
    flying = {"a": _truth([True, False]), "b": _truth([True, False])}
    cut = judge(_data(truth=flying, damage=["state.mcap: cut off at byte 9"]), tmp_path)
    assert cut.figures.landed is None
    assert cut.reasons[0] == "the recording breaks off after 100 s, before the run ended"
    assert judge(_data(truth=flying), tmp_path).figures.landed is False


def test_a_flight_that_a_failure_ended_fails_for_that_reason(tmp_path: Path) -> None:
    text = "run ended: this computer slept for 12 s in flight: nobody watched over the drones; all drones have landed"
    header = m.Header(0, "here", m.RUN, "supervisor", 0)
    ended = TimedMessage(90.0, m.Event(header=header, severity=m.Severity.ERROR, text=text))
    track, land = _ack(5.0, m.Verb.TRACK, m.AckStage.ACCEPTED), _command(80.0, m.Verb.LAND)
    report = judge(_data(events=[ended], acks=[track], commands=[land]), tmp_path)
    assert (report.passed, report.verdict) == (False, "failed")
    assert report.reasons[0] == text.removeprefix(m.RUN_ENDED)
    assert not replace(report, criteria=()).passed, "whatever else it met"
