"""Delay estimation from the calibration manoeuvre under the ceiling camera, at message level."""

import math

import msgspec
import pytest

from groundstation.bus.messages import Message, RelativeObservation, Severity
from groundstation.calibration.delay import delays
from groundstation.calibration.flown import Flown
from groundstation.calibration.sensor_delay import Delay
from groundstation.field.resolved import ResolvedField
from groundstation.runtime.latency_watch import PictureAge
from sim_bridge.scenario import Scenario
from sim_bridge.study.runner import CLOCK, Study, StudyOptions
from sim_bridge.world.world import TICK_NS

DURATION_S = 30.0
Ticks = list[tuple[int, tuple[tuple[str, Message], ...]]]


class Manoeuvre(Study):
    """Drones that are commanded to and fro, and all messages that reached the tracker."""

    def __init__(self, field: ResolvedField, seed: int) -> None:
        super().__init__(field, Scenario(), StudyOptions(seed, DURATION_S, plan=False))
        self.ticks: Ticks = []

    def _arrived(self) -> tuple[tuple[str, Message], ...]:
        due = super()._arrived()
        self.ticks.append((self.now_ns, due))
        return due

    def _tick(self, tracking: bool) -> None:
        super()._tick(tracking)
        now_s = self.world.time_s
        for index, pilot in enumerate(self._pilots.values() if tracking else ()):
            way = [1.0 if (now_s / period_s + 0.5 * index) % 1.0 < 0.5 else -1.0 for period_s in (2.0, 2.6, 5.0, 3.0)]
            pilot.obey((0.4 * way[0], 0.3 * way[1], 0.35 * way[2]), math.radians(60.0) * way[3], now_s)


@pytest.fixture(scope="module")
def manoeuvre(lab_field: ResolvedField) -> Manoeuvre:
    flight = Manoeuvre(lab_field, 2)
    flight.run()
    return flight


def told_in_flight(field: ResolvedField, ticks: Ticks, error_ms: float) -> tuple[PictureAge, list[str]]:
    """Replay the flight with a ceiling camera whose delay setting is too small by an error."""
    age, warnings = PictureAge(field, CLOCK), []
    for number, (_, inputs) in enumerate(ticks):
        for _, message in inputs:
            if isinstance(message, RelativeObservation) and message.observer == "ceiling":
                stamp_ns = message.header.stamp_ns + round(error_ms * 1e6)
                message = msgspec.structs.replace(
                    message, header=msgspec.structs.replace(message.header, stamp_ns=stamp_ns)
                )
            age.take(message)
        if number % 50 == 49:
            told = [notice for notice in age.notices() if notice.severity is Severity.WARNING]
            warnings += [f"{notice.entity}: {notice.text}; {notice.remedy}" for notice in told]
    return age, warnings


@pytest.mark.parametrize(
    ("error_ms", "than", "proposed"),
    [pytest.param(40.0, "older", 160.0, marks=pytest.mark.slow), (-40.0, "newer", 80.0)],
)
def test_a_wrong_delay_is_told_in_flight_with_the_setting_that_mends_it(
    lab_field: ResolvedField, manoeuvre: Manoeuvre, error_ms: float, than: str, proposed: float
) -> None:
    age, warnings = told_in_flight(lab_field, manoeuvre.ticks, error_ms)
    (ceiling,) = [one for one in age.lateness() if one.sensor == "ceiling"]
    assert ceiling.offset_ms == pytest.approx(error_ms, abs=3.0 * ceiling.std_ms + 5.0)
    assert ceiling.std_ms < 8.0
    (warning,) = [text for text in warnings if text.startswith("ceiling")]
    assert f"ms {than} than configured" in warning and "calibrate team" in warning
    other = "newer" if than == "older" else "older"
    assert f"the telemetry that they are compared with is as much {other}; groundstation" in warning
    setting = float(warning.split("cameras.ceiling.video_delay_ms: ")[1].split(" ")[0])
    assert setting == pytest.approx(proposed, abs=15.0)


def test_a_right_delay_raises_no_warning(lab_field: ResolvedField, manoeuvre: Manoeuvre) -> None:
    age, warnings = told_in_flight(lab_field, manoeuvre.ticks, 0.0)
    assert warnings == []
    assert abs(next(one for one in age.lateness() if one.sensor == "ceiling").offset_ms) < 10.0


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_velocities_are_dated_by_a_flight_that_dashes_to_and_fro(
    lab_field: ResolvedField, manoeuvre: Manoeuvre
) -> None:
    found = {one.sensor: one for one in delays(Flown(tuple(manoeuvre.ticks), CLOCK), lab_field)}
    tick_ms = TICK_NS / 1e6
    for name, onboard in manoeuvre.world.onboard.items():
        truth_ms = tick_ms * math.ceil(1e3 * onboard.velocity_delay_s / tick_ms)
        one = found[f"{name} velocity"]
        assert one.sure and one.measured_ms == pytest.approx(truth_ms, abs=15.0), (one, truth_ms)
    assert found["ceiling"].measured_ms == pytest.approx(120.0, abs=8.0)


def test_only_what_is_sure_and_not_doubted_is_proposed() -> None:
    assert Delay("ceiling", "cameras.ceiling.video_delay_ms", 120.0, 160.0, 5.0).differs
    assert not Delay("ceiling", "cameras.ceiling.video_delay_ms", 120.0, 160.0, 20.0).differs
    assert not Delay("ceiling", "cameras.ceiling.video_delay_ms", 120.0, 160.0, 5.0, "doubtful").differs
