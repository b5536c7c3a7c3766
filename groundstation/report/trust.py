"""Judges whether a run can be trusted, by its sensors' claims, its cameras' survey and its plans' sightings."""

import math
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence

import msgspec
import numpy as np

from groundstation.arrays import Array
from groundstation.bus.messages import Belief, Innovation, Plan, Severity, Verdict
from groundstation.estimation.mean_interval import half_width
from groundstation.report.interval import tracking_interval
from groundstation.report.tracks import RunData, TimedMessage

# Errors of a sensor correlate from picture to picture: observations two seconds apart count as independent.
_BLOCK_S, _LEAST_BLOCKS = 2.0, 4
_TOO_SURE, _TOO_CAUTIOUS = 2.0, 0.4
_REFUSED_PERCENT = 10.0
# What is wrong with an observation, and its remedy. Not those that nobody could use: of what stands on the floor (a
# quarter of a fixed camera's in good runs), of what cannot be placed yet, or of targets that a camera may not observe.
_REFUSALS = {
    Verdict.IMPLAUSIBLE: ("implausible", "check how it is mounted, and its calibration (groundstation calibrate)"),
    Verdict.LATE: ("too late", "its link or its driver lags, or its delay in the field file is too large"),
    Verdict.UNSYNCED: ("of an unknown clock", "its host's clock is compared with none: check the link to that host"),
    Verdict.SINGULAR: ("without a usable covariance", "its driver states one that cannot be: repair that"),
    Verdict.FROZEN: ("repeated", "its sensor or stream hangs: restart it, or its driver"),
}
_MOVED_SIGMAS = 3.0
_LATE_MS, _LATE_SIGMAS = 20.0, 3.0
# Least time for which a plan counts on a link, and largest age of an observation of it.
_PLANNED_S, _SEEN_S, _SEEN_PERCENT = 5.0, 0.5, 50.0
# A plan lists all permitted edges; it counts on those that would determine a place to 0.1 m [1/m^2].
_COUNTED_ON = 100.0
_PLAN_LASTS_S = 1.0
_TRACKER, _DIAGNOSIS = "tracker", "diagnosis"
# By then the diagnosis has a verdict, unless it got no share of the processor.
_JUDGED_BY_S = 30.0


class SensorTrust(msgspec.Struct, frozen=True):
    """Of one observer: NIS per degree of freedom with its 95 % interval; refused: share of its observations [%].

    refused_as: what most of them were refused as, "" for none. verdict: consistent, too sure, too cautious, or too few
    observations to say.
    """

    observer: str
    observations: int
    nis_per_dof: float | None
    low: float | None
    high: float | None
    refused_percent: float
    verdict: str
    refused_as: str = ""


class SurveyShift(msgspec.Struct, frozen=True):
    """Difference of a fixed camera's mounting from the field file, by the filter's belief at the end.

    what: position or attitude; by, survey_std: [m] or [deg]; sigmas: by / survey_std of the worst axis.
    """

    camera: str
    what: str
    by: float
    survey_std: float
    sigmas: float


class DelayShift(msgspec.Struct, frozen=True):
    """True less configured delay of a camera [ms]."""

    camera: str
    offset_ms: float
    std_ms: float


class LinkForecast(msgspec.Struct, frozen=True):
    """Time for which plans counted on a link [s], and share of that time with observations [%]."""

    observer: str
    subject: str
    planned_s: float
    seen_percent: float


class Trust(msgspec.Struct, frozen=True):
    """doubts: each a sentence with its remedy; none: nothing speaks against the run."""

    sensors: list[SensorTrust]
    shifts: list[SurveyShift]
    delays: list[DelayShift]
    links: list[LinkForecast]
    doubts: list[str]


def trust_of(data: RunData) -> Trust:
    """Return the evidence for and against a run."""
    belief = data.belief
    sensors, shifts = _sensors(data), [] if belief is None else list(_shifts(data, belief))
    delays = [] if belief is None else [DelayShift(one.sensor, one.offset_ms, one.std_ms) for one in belief.lateness]
    links = _links(data)
    doubts = [
        *_told(data),
        *_unjudged(data),
        *_doubts_of_sensors(sensors),
        *_doubts_of_figures(shifts, delays),
        *_doubts_of_links(links),
    ]
    return Trust(sensors, shifts, delays, links, doubts)


def _sensors(data: RunData) -> list[SensorTrust]:
    found: defaultdict[str, list[TimedMessage[Innovation]]] = defaultdict(list)
    for item in data.innovations:
        found[item.message.observer].append(item)
    return [_sensor(observer, items) for observer, items in sorted(found.items())]


def _sensor(observer: str, items: list[TimedMessage[Innovation]]) -> SensorTrust:
    blocks: defaultdict[int, list[Innovation]] = defaultdict(list)
    for item in items:
        if item.message.verdict is Verdict.ACCEPTED and item.message.nis is not None:
            blocks[int(item.time_s / _BLOCK_S)].append(item.message)
    means = [sum(i.nis or 0.0 for i in some) / sum(len(i.residual) for i in some) for some in blocks.values()]
    refusals = Counter(i.message.verdict for i in items if i.message.verdict in _REFUSALS)
    refused, refused_as = 100.0 * refusals.total() / len(items), "".join(one for one, _ in refusals.most_common(1))
    if len(means) < _LEAST_BLOCKS:
        return SensorTrust(observer, len(items), None, None, None, refused, "too few observations to say", refused_as)
    mean, half = float(np.mean(means)), half_width(means)
    low, high = max(0.0, mean - half), mean + half
    verdict = "too sure" if low > _TOO_SURE else "too cautious" if high < _TOO_CAUTIOUS else "consistent"
    return SensorTrust(observer, len(items), mean, low, high, refused, verdict, refused_as)


def _shifts(data: RunData, belief: Belief) -> Iterator[SurveyShift]:
    mean = dict(zip(belief.layout, belief.mean, strict=True))
    for name, camera in data.resolved.cameras.items():
        if f"{name}.roll_error" not in mean:
            continue
        place = [mean[f"{name}.{axis}"] - was for axis, was in zip("xyz", camera.position_m, strict=True)]
        turned = [math.degrees(mean[f"{name}.{angle}"]) for angle in ("yaw", "roll_error", "pitch_error")]
        yield _shift(name, "position", place, camera.position_std_m)
        yield _shift(name, "attitude", turned, camera.attitude_std_deg)


def _shift(camera: str, what: str, errors: Sequence[float], std: float) -> SurveyShift:
    worst = max(abs(error) for error in errors) / std if std > 0.0 else math.inf
    return SurveyShift(camera, what, math.hypot(*errors), std, worst)


def _links(data: RunData) -> list[LinkForecast]:
    sighted_s = _sighting_times(data)
    planned: defaultdict[tuple[str, str], list[tuple[float, bool]]] = defaultdict(list)
    for plan, lasts_s in _plans(data):
        for edge in plan.message.edges:
            if edge.information >= _COUNTED_ON:
                times = sighted_s.get((edge.observer, edge.subject), np.empty(0))
                planned[edge.observer, edge.subject].append((lasts_s, _saw(times, plan.time_s)))
    return [_link(*edge, found) for edge, found in sorted(planned.items())]


def _sighting_times(data: RunData) -> dict[tuple[str, str], Array]:
    """Return the sorted times [s] of all observations of each pair of observer and subject."""
    seen: defaultdict[tuple[str, str], list[float]] = defaultdict(list)
    systems = data.resolved.ranging_links  # plans count on all its anchors together
    for item in data.innovations:
        observer = systems.get(item.message.observer, item.message.observer)
        seen[observer, item.message.subject].append(item.time_s)
    return {edge: np.sort(times) for edge, times in seen.items()}


def _plans(data: RunData) -> Iterator[tuple[TimedMessage[Plan], float]]:
    """Yield the plans made while the team tracked, and how long each was flown [s]."""
    start_s, end_s = tracking_interval(data) or (0.0, data.end_s)
    plans = [item for item in data.plans if start_s <= item.time_s < end_s]
    for plan, until_s in zip(plans, [*(plan.time_s for plan in plans[1:]), end_s], strict=False):
        yield plan, min(until_s - plan.time_s, _PLAN_LASTS_S)


def _saw(times: np.ndarray, now_s: float) -> bool:
    index = int(np.searchsorted(times, now_s - _SEEN_S))
    return index < len(times) and bool(times[index] <= now_s + _SEEN_S)


def _link(observer: str, subject: str, found: list[tuple[float, bool]]) -> LinkForecast:
    total_s = sum(lasts_s for lasts_s, _ in found)
    seen_s = sum(lasts_s for lasts_s, seen in found if seen)
    return LinkForecast(observer, subject, total_s, 100.0 * seen_s / total_s if total_s > 0.0 else 0.0)


def _told(data: RunData) -> Iterator[str]:
    """Yield the warnings of tracker and diagnosis in flight that have a remedy, once each."""
    said: dict[str, str] = {}
    for item in data.events:
        event = item.message
        if event.header.source in (_TRACKER, _DIAGNOSIS) and event.severity is Severity.WARNING and event.remedy:
            said.setdefault(event.text, f"told in flight, at {item.time_s:.0f} s: {event.text}; {event.remedy}")
    yield from said.values()


def _unjudged(data: RunData) -> Iterator[str]:
    """Yield a doubt if the diagnosis, which should have run, never judged the field's figures."""
    start_s, end_s = tracking_interval(data) or (0.0, 0.0)
    if _DIAGNOSIS in data.processes and end_s - start_s >= _JUDGED_BY_S and not data.suspicions:
        yield (
            "the diagnosis reached no verdict (the machine was too busy, or it failed): that it blamed no figure of "
            "the field says nothing; groundstation calibrate team looks for a wrong one in the recording"
        )


def _doubts_of_sensors(sensors: Sequence[SensorTrust]) -> Iterator[str]:
    for one in sensors:
        if one.verdict == "too sure":
            yield (
                f"{one.observer} is wrong by more than it claims (NIS {one.nis_per_dof:.1f} per degree of freedom): "
                "check how its camera is mounted, its calibration and its delay (groundstation calibrate)"
            )
        if one.refused_percent > _REFUSED_PERCENT:
            what, remedy = _REFUSALS[Verdict(one.refused_as)]
            yield f"{one.refused_percent:.0f} % of what {one.observer} saw was refused, most as {what}: {remedy}"


def _doubts_of_figures(shifts: Sequence[SurveyShift], delays: Sequence[DelayShift]) -> Iterator[str]:
    for shift in shifts:
        if shift.sigmas > _MOVED_SIGMAS:
            unit, digits = ("m", 3) if shift.what == "position" else ("deg", 1)
            yield (
                f"{shift.camera} seems to hang {shift.by:.{digits}f} {unit} from where the field file has it, "
                f"{shift.sigmas:.0f} standard deviations: it does, or a marker or a lens is not as the field says; "
                "groundstation calibrate team tells which"
            )
    for delay in delays:
        if abs(delay.offset_ms) > max(_LATE_MS, _LATE_SIGMAS * delay.std_ms):
            later = "later" if delay.offset_ms > 0 else "earlier"
            yield (
                f"pictures of {delay.camera} come {abs(delay.offset_ms):.0f} +- {delay.std_ms:.0f} ms {later} than the "
                "field file says: groundstation calibrate delay"
            )


def _doubts_of_links(links: Sequence[LinkForecast]) -> Iterator[str]:
    for link in links:
        if link.planned_s >= _PLANNED_S and link.seen_percent < _SEEN_PERCENT:
            yield (
                f"plans counted on {link.observer} seeing {link.subject} for {link.planned_s:.0f} s; it did in "
                f"{link.seen_percent:.0f} % of that: something hides it, or the camera's angle or range is wrong"
            )
