"""All figures of a run, from its data; pure."""

from collections import Counter

import msgspec
import numpy as np

from groundstation.arrays import Array
from groundstation.bus.messages import Severity, Verdict
from groundstation.estimation.tracking_errors import TrackingFigures, tracking_figures
from groundstation.report import load, safety, topology_use
from groundstation.report.accuracy import RATE_HZ, Accuracy, accuracy, errors_at, time_grid
from groundstation.report.aloft import aloft_at, anybody_flew, in_the_air
from groundstation.report.certainty import drone_uncertain_s, target_unseen_s
from groundstation.report.happenings import cuts_in_flight, happenings, landings
from groundstation.report.interval import recorded_share, tracking_spans, whole
from groundstation.report.tracks import RunData
from groundstation.report.unreported import unreported


class RunFigures(msgspec.Struct, frozen=True, kw_only=True):
    """The figures of report.json; None where there was nothing to measure.

    target_*: of several targets, those of the worst; target: all figures of the one with the largest error; found: of
    each target from when it was found, None if it never was. target_unseen_s, drone_uncertain_s: by the estimates.
    flew: whether any drone did. recorded_share: of the flights, without holes. drones_judged: share of each drone's
    flights for which motion capture knows its place. unreported: drones that flew without a report of their own.
    failsafe_landings: which drones a failsafe landed or cut, when and why; cuts_in_flight: which fell because somebody
    ordered it. unplanned_s: for how long at most all plans were too old to be flown. truth: the reference of the
    errors, a motion capture system of the field or the simulator, "" for nothing. starved_s: how long other programs
    of the computer kept processes of the run from it; waited: the share of the time for which each waited for a core.
    """

    flew: bool = True
    tracked_s: float
    recorded_share: float | None = None
    target_rmse_m: float | None
    target_lost_s: float | None
    target_unseen_s: float | None = None
    drone_uncertain_s: float | None = None
    target: Accuracy | None
    targets: dict[str, Accuracy] = {}
    found: dict[str, TrackingFigures | None] = {}
    robots: dict[str, Accuracy]
    max_fence_violation_m: float | None
    min_separation_m: float | None
    min_obstacle_m: float | None = None
    drones_judged: dict[str, float] = {}
    landed: bool | None
    unreported: list[str] = []
    failsafe_landings: list[str] = []
    cuts_in_flight: list[str] = []
    topology_seconds: dict[str, float]
    topology_switches: int
    unplanned_s: float | None = None
    planner_p50_ms: float | None
    planner_p99_ms: float | None
    tracker_ticks: int
    tracker_missed: int
    tracker_missed_percent: float | None
    tracker_rate_hz: float | None
    mean_cpu_cores: float | None
    cpu_cores: dict[str, float]
    sim_overrun_percent: float | None
    starved_s: float = 0.0
    waited: dict[str, float] = {}
    command_to_airborne_s: float | None
    verdicts: dict[str, int]
    mean_nis: dict[str, float]
    overflowed: dict[str, int]
    events: dict[str, int]
    loud_events: list[str]
    truth: str = ""


_LOUD_EVENTS = 50


def figures_of(data: RunData) -> RunFigures:
    """Return the figures of a run."""
    spans = tracking_spans(data)
    interval = whole(spans)
    start, end = interval or (0.0, 0.0)
    grid = np.concatenate([time_grid(*span) for span in spans]) if spans else np.empty(0)
    targets, robots = _accuracies(data, grid) if spans else ({}, {})
    target = max(targets.values(), key=lambda one: one.rmse_m, default=None)
    planner = None if data.rerun else load.planner_ms(data)  # a re-run's plans have no real time
    ticks, missed, rate = load.tracker_deadlines(data)
    cores, hidden = load.cpu_cores(data), unreported(data)
    return RunFigures(
        flew=bool(spans or hidden) or anybody_flew(data),
        tracked_s=round(sum(until - since for since, until in spans), 3),
        recorded_share=recorded_share(data),
        target_rmse_m=target.rmse_m if target else None,
        target_lost_s=max((one.lost_s for one in targets.values()), default=None),
        target_unseen_s=target_unseen_s(data, grid),
        drone_uncertain_s=drone_uncertain_s(data, grid),
        target=target,
        targets=targets,
        found={name: _found(data, name, grid) for name in targets},
        robots=robots,
        max_fence_violation_m=safety.max_fence_violation_m(data),
        min_separation_m=safety.min_separation_m(data),
        min_obstacle_m=safety.min_obstacle_m(data),
        drones_judged=safety.judged_shares(data),
        landed=safety.landed(data),
        unreported=hidden,
        failsafe_landings=[item.line for item in landings(happenings(data))],
        cuts_in_flight=[item.line for item in cuts_in_flight(data)],
        topology_seconds=topology_use.topology_seconds(data, start, end),
        topology_switches=topology_use.switches(data, start, end),
        unplanned_s=load.unplanned_s(data, grid),
        planner_p50_ms=planner[0] if planner else None,
        planner_p99_ms=planner[1] if planner else None,
        tracker_ticks=ticks,
        tracker_missed=missed,
        tracker_missed_percent=100.0 * missed / ticks if ticks else None,
        tracker_rate_hz=rate,
        mean_cpu_cores=sum(cores.values()) if cores else None,
        cpu_cores=cores,
        sim_overrun_percent=load.sim_overrun_percent(data),
        starved_s=load.starved_s(data, *(in_the_air(data) or (0.0, data.end_s))),
        waited=load.waited(data, *(interval or (0.0, data.end_s))),
        command_to_airborne_s=_command_to_airborne_s(data),
        verdicts=dict(Counter(str(item.message.verdict) for item in data.innovations)),
        mean_nis=_mean_nis(data),
        overflowed=load.overflowed(data),
        events=dict(Counter(str(event.message.severity) for event in data.events)),
        loud_events=_loud(data),
        truth=data.resolved.truth.get("from", "simulator") if data.truth else "",
    )


def _accuracies(data: RunData, grid: Array) -> tuple[dict[str, Accuracy], dict[str, Accuracy]]:
    """Return the figures of all targets and of all robots at some times."""
    targets: dict[str, Accuracy] = {}
    robots: dict[str, Accuracy] = {}
    for name in data.tracked:
        truth = data.truth.get(name)
        if truth is not None and (found := accuracy(grid, truth, data.estimates.get(name), 2)) is not None:
            targets[name] = found
    for name in data.drones:
        truth = data.truth.get(name)
        if truth is None:
            continue
        # A truth with gaps does not tell for how long it flew: its own reports do.
        aloft = truth.airborne_at(grid) if truth.is_simulated else aloft_at(data.vehicles.get(name, ()), grid)
        if (found := accuracy(grid[aloft], truth, data.estimates.get(name), 3)) is not None:
            robots[name] = found
    return targets, robots


def _found(data: RunData, name: str, grid: Array) -> TrackingFigures | None:
    """Return the figures of a target from when it was found, over the times at which its truth is known."""
    truth = data.truth[name]
    errors = errors_at(grid[truth.known_at(grid)], truth, data.estimates.get(name), 2)
    return tracking_figures(np.linalg.norm(errors, axis=1), 1.0 / RATE_HZ)


def _command_to_airborne_s(data: RunData) -> float | None:
    airborne = safety.all_airborne_s(data)
    if airborne is None or data.facts.command_unix_ns == 0:
        return None
    after_s = airborne + (data.start_unix_ns - data.facts.command_unix_ns) / 1e9
    return after_s if after_s >= 0.0 else None  # one of the clocks was set meanwhile


def _mean_nis(data: RunData) -> dict[str, float]:
    by_edge: dict[str, list[float]] = {}
    for item in data.innovations:
        innovation = item.message
        if innovation.nis is not None and innovation.verdict is Verdict.ACCEPTED:
            per_dim = innovation.nis / max(1, len(innovation.residual))
            by_edge.setdefault(f"{innovation.observer} -> {innovation.subject}", []).append(per_dim)
    return {edge: float(np.mean(values)) for edge, values in sorted(by_edge.items())}


def _loud(data: RunData) -> list[str]:
    # Faults of the scenario are among the happenings.
    loud = [e for e in data.events if e.message.severity is not Severity.INFO and not e.message.injected]
    return [
        f"{event.time_s:.1f} s {event.message.severity} {event.message.header.entity}: {event.message.text}"
        for event in loud[-_LOUD_EVENTS:]
    ]
