"""The diagnosis loop: its inputs, the times of its judgements, and its messages."""

import threading
import time
from dataclasses import replace

import msgspec
import pytest
from swinging_lab import TOPIC_OF, Lab

from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import (
    FlightState,
    Header,
    Message,
    Odometry,
    RelativeObservation,
    Severity,
    Suspicion,
    VehicleStatus,
)
from groundstation.bus.topics import SUSPICION, VEHICLE_STATUS
from groundstation.calibration.team_record import team_record
from groundstation.diagnosis.judging import AtOnce, OnThread
from groundstation.diagnosis.loop import Diagnosis
from groundstation.diagnosis.suspects import Verdict
from groundstation.diagnosis.window import Window
from groundstation.field.resolved import ResolvedField
from sim_bridge.study.wrong_figures import WrongFigures

S = 1_000_000_000


def status(at_s: float, state: FlightState, clock_id: str = "c", name: str = "drone_1") -> Message:
    return VehicleStatus(header=Header(round(at_s * S), clock_id, name, "d", 1), flight_state=state, mode="TRACK")


@pytest.mark.parametrize("end", [FlightState.LANDED, FlightState.EMERGENCY])
def test_only_a_flight_of_some_seconds_is_judged_and_its_last_forty(lab_field: ResolvedField, end: FlightState) -> None:
    window = Window(lab_field, "c")
    assert window.flown() is None
    window.take("k", status(0, FlightState.LANDED), 0)
    assert first_flown(window, 1) == 8
    flown = window.flown()
    assert flown is not None and flown.duration_s == 40.0
    window.take("k", status(100, end), 100 * S)
    assert window.flown() is None, "nobody flies"


def test_a_flight_whose_start_was_missed_is_judged_later(lab_field: ResolvedField) -> None:
    """Of healthy flights of 8 to 14 s, joined in the air without a pad, one in eight had a wrong lens or delay."""
    assert first_flown(Window(lab_field, "c"), 0) == 20


def first_flown(window: Window, since_s: int) -> int | None:
    """Fly on until 100 s; returns the time of the first stretch to be judged."""
    first = None
    for second in range(since_s, 100):
        window.take("k", status(second, FlightState.FLYING), second * S)
        if first is None and window.flown() is not None:
            first = second
    return first


def test_a_drone_that_landed_long_ago_is_not_taken_to_stand_on_its_pad(lab_field: ResolvedField) -> None:
    """It stood for the whole window of 40 s, but where it landed; the ceiling camera was blamed for the difference."""
    window = Window(lab_field, "c")
    for second in range(100):
        first = FlightState.FLYING if 2 <= second < 30 else FlightState.LANDED
        second_one = FlightState.LANDED if second < 2 else FlightState.FLYING
        window.take("k", status(second, first), second * S)
        window.take("k", status(second + 0.1, second_one, name="drone_2"), round((second + 0.1) * S))
        if second == 60:
            before = window.flown()
    after = window.flown()
    assert before is not None and after is not None
    assert before.off_pads == {"drone_2", "drone_1"} and after.off_pads == {"drone_1", "drone_2"}
    assert team_record(after, lab_field).stands == {}
    assert team_record(replace(after, off_pads=frozenset()), lab_field).stands.keys() == {"drone_1"}


def test_stands_before_the_first_flight_count_only_if_its_start_was_seen(lab_field: ResolvedField) -> None:
    for first in (FlightState.LANDED, FlightState.FLYING):
        window = Window(lab_field, "c")
        window.take("k", status(0.0, first, name="drone_2"), 0)
        for second in range(1, 31):
            window.take("k", status(second, FlightState.LANDED), second * S)
            window.take("k", status(second + 0.1, FlightState.FLYING, name="drone_2"), round((second + 0.1) * S))
        flown = window.flown()
        assert flown is not None
        assert team_record(flown, lab_field).stands.keys() == ({"drone_1"} if first is FlightState.LANDED else set())


def test_messages_stamped_by_another_clock_are_ignored(lab_field: ResolvedField) -> None:
    window = Window(lab_field, "c")
    for second in range(20):
        window.take("k", status(second, FlightState.FLYING, "elsewhere"), second * S)
    assert window.flown() is None


def sighting(at_s: float, picture_s: float, camera: str = "drone_1_camera") -> Message:
    return RelativeObservation(
        header=Header(round(at_s * S), "c", "drone_1", camera, round(1e3 * at_s)), observer="drone_1", camera=camera,
        subject="turtlebot", position_m=(0.0, 0.0, 1.0 + 0.01 * at_s), yaw_rad=None,
        covariance=(1e-4, 0.0, 0.0, 0.0, 1e-4, 0.0, 0.0, 0.0, 1e-4), picture_ns=round(picture_s * S),
    )  # fmt: skip


def test_observations_of_a_frozen_camera_are_removed_once_that_is_known(lab_field: ResolvedField) -> None:
    window = Window(lab_field, "c")
    for tenth in range(200):
        at_s = tenth / 10
        window.take("s", status(at_s, FlightState.LANDED if at_s < 1 else FlightState.FLYING), round(at_s * S))
        window.take("o", sighting(at_s, 15.0 if at_s >= 17.0 else at_s), round(at_s * S))
        window.take("p", sighting(at_s, at_s, "another"), round(at_s * S))
    flown = window.flown()
    assert flown is not None
    seen = [m for _, row in flown.ticks for _, m in row if isinstance(m, RelativeObservation)]
    assert max(m.picture_ns for m in seen if m.camera == "drone_1_camera") == 15 * S
    assert max(m.picture_ns for m in seen if m.camera == "another") == round(19.9 * S)


def hanging(message: Message, at_s: float) -> Message:
    """Return a message as a frozen picture or autopilot repeats it."""
    header = msgspec.structs.replace(message.header, stamp_ns=round(at_s * S), seq=round(1e3 * at_s))
    return msgspec.structs.replace(message, header=header)


@pytest.mark.parametrize("kind", [Odometry, RelativeObservation])
def test_frozen_absurd_or_future_measurements_are_ignored(lab_field: ResolvedField, kind: type[Message]) -> None:
    rows = Lab(lab_field, WrongFigures({})).flown().ticks
    sample = next(message for _, inputs in rows for _, message in inputs if isinstance(message, kind))
    absurd = {"velocity_m_s": (1e200, 0.0, 0.0)} if kind is Odometry else {"position_m": (1e200, 0.0, 1.0)}
    window = Window(lab_field, "c")
    window.take("status", status(99, FlightState.LANDED), 99 * S)
    for step in range(200):
        at_s = 100.0 + 0.05 * step
        window.take("status", status(at_s, FlightState.FLYING), round(at_s * S))
        window.take("k", hanging(sample, at_s), round(at_s * S))
        window.take("absurd", msgspec.structs.replace(hanging(sample, at_s), **absurd), round(at_s * S))
        if kind is Odometry:
            window.take("late", hanging(sample, at_s + 3600.0), round(at_s * S))
    flown = window.flown()
    assert flown is not None
    counted = [m for _, inputs in flown.ticks for _, m in inputs if isinstance(m, kind)]
    assert len(counted) <= 10, "until it is sure that it hangs"


def fed(diagnosis: Diagnosis, exchange: MemoryExchange, lab: Lab) -> int:
    """Send a flight of the lab through the bus; returns its end [ns]."""
    buses = {name: MemoryBus(exchange, "lab", name) for name in ("ceiling", *lab.field.drones)}
    now_ns = 0
    for now_ns, inputs in lab.flown().ticks:
        for kind, message in inputs:
            buses[message.header.source].publish(TOPIC_OF[kind], message)
        diagnosis.turn(now_ns)
    return now_ns


def test_a_wrong_figure_is_told_to_operator_and_tracker(
    lab_field: ResolvedField, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clock, "clock_id", lambda: "c")
    exchange = MemoryExchange()
    heard = MemoryBus(exchange, "lab", "tracker").subscribe([SUSPICION])
    diagnosis = Diagnosis(MemoryBus(exchange, "lab", "diagnosis"), lab_field, AtOnce())
    fed(diagnosis, exchange, Lab(lab_field, WrongFigures({("drone_1", "delay"): 60.0})))
    (notice,) = diagnosis.notices
    assert notice.severity is Severity.WARNING and "the pictures of drone_1's camera are" in notice.text
    causes = [one.message.cause for one in heard.drain() if isinstance(one.message, Suspicion)]
    assert causes and "the pictures of drone_1's camera are" in causes[-1]
    assert diagnosis.overflowed == 0


def test_a_suspicion_is_repeated_for_consoles_that_start_later(
    lab_field: ResolvedField, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clock, "clock_id", lambda: "c")
    exchange = MemoryExchange()
    diagnosis = Diagnosis(MemoryBus(exchange, "lab", "diagnosis"), lab_field, AtOnce())
    ended_ns = fed(diagnosis, exchange, Lab(lab_field, WrongFigures({("drone_1", "delay"): 60.0})))
    for name in lab_field.drones:  # nobody flies any more: no further verdict is reached
        landed = status(ended_ns / S, FlightState.LANDED)
        header = msgspec.structs.replace(landed.header, entity=name, source=name)
        MemoryBus(exchange, "lab", name).publish(VEHICLE_STATUS, msgspec.structs.replace(landed, header=header))
    late = MemoryBus(exchange, "lab", "console").subscribe([SUSPICION])
    for second in range(1, 12):
        diagnosis.turn(ended_ns + second * S)
    told = [one.message for one in late.drain() if isinstance(one.message, Suspicion)]
    assert len(told) == 2 and "drone_1's camera" in told[0].figures[0].text
    assert told[0].figures[0].told_ns < ended_ns


def test_a_verdict_on_a_thread_keeps_the_loop_waiting_for_nothing() -> None:
    judging, may_end, verdict = OnThread(), threading.Event(), Verdict((), {})

    def judge() -> Verdict:
        may_end.wait(10.0)
        return verdict

    judging.begin(judge)
    assert judging.busy and judging.take() is None
    may_end.set()
    while judging.busy:
        time.sleep(0.001)
    assert judging.take() is verdict and judging.take() is None
