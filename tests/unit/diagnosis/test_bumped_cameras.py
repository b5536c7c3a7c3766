"""A camera that the tracker finds bumped makes the diagnosis blame nobody."""

import math

import msgspec
import numpy as np
import pytest
from swinging_lab import TOPIC_OF, Lab

from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import (
    Belief,
    FlightState,
    Header,
    Message,
    MovedCamera,
    RelativeObservation,
    VehicleStatus,
)
from groundstation.bus.topics import BELIEF
from groundstation.diagnosis.judging import AtOnce
from groundstation.diagnosis.loop import Diagnosis
from groundstation.diagnosis.window import Window
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.rotations import rotation_from_euler
from sim_bridge.study.wrong_figures import WrongFigures

S = 1_000_000_000
BUMPED_S, FOUND_S = 108.0, 109.2
TURN = rotation_from_euler(math.radians(4.0), math.radians(3.0), math.radians(6.0))


def bumped(message: Message) -> Message:
    """Return a message as it is after the ceiling camera was turned."""
    if not isinstance(message, RelativeObservation) or message.observer != "ceiling":
        return message
    if message.header.stamp_ns < BUMPED_S * S:
        return message
    return msgspec.structs.replace(message, position_m=tuple((TURN @ np.array(message.position_m)).tolist()))


def belief(at_ns: int, *moved: MovedCamera) -> Belief:
    return Belief(
        header=Header(at_ns, "c", "team", "tracker", at_ns), mean=(), covariance_upper=(), layout=(), moved=moved
    )


def test_the_jump_of_a_bumped_camera_is_no_wrong_figure(
    lab_field: ResolvedField, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clock, "clock_id", lambda: "c")
    exchange = MemoryExchange()
    diagnosis = Diagnosis(MemoryBus(exchange, "lab", "diagnosis"), lab_field, AtOnce())
    buses = {name: MemoryBus(exchange, "lab", name) for name in ("ceiling", "tracker", *lab_field.drones)}
    for now_ns, inputs in Lab(lab_field, WrongFigures({}), seconds=16.0).flown().ticks:
        for kind, message in inputs:
            buses[message.header.source].publish(TOPIC_OF[kind], bumped(message))
        moved = (MovedCamera("ceiling", round((BUMPED_S - 0.1) * S)),) if now_ns >= FOUND_S * S else ()
        buses["tracker"].publish(BELIEF, belief(now_ns, *moved))
        diagnosis.turn(now_ns)
    assert diagnosis.notices == []


def sighting(at_s: float, camera: str) -> RelativeObservation:
    return RelativeObservation(
        header=Header(round(at_s * S), "c", camera, camera, round(1e3 * at_s)), observer=camera, camera=camera,
        subject="turtlebot", position_m=(0.0, 0.0, 1.0 + 0.01 * at_s), yaw_rad=None,
        covariance=(1e-4, 0.0, 0.0, 0.0, 1e-4, 0.0, 0.0, 0.0, 1e-4), picture_ns=round(at_s * S),
    )  # fmt: skip


def test_sightings_since_a_camera_was_in_place_do_not_count_and_earlier_ones_go_once_it_is_believed_again(
    lab_field: ResolvedField,
) -> None:
    window = Window(lab_field, "c")
    moved = MovedCamera("ceiling", 15 * S)
    for second in range(1, 31):
        now_ns = second * S
        state = FlightState.LANDED if second < 2 else FlightState.FLYING
        status = VehicleStatus(
            header=Header(now_ns, "c", "drone_1", "drone_1", second), flight_state=state, mode="TRACK"
        )
        window.take("status", status, now_ns)
        for camera in ("ceiling", "drone_1"):
            window.take(camera, sighting(second, camera), now_ns)
        if second in (17, 20):
            window.take("belief", belief(now_ns, moved), now_ns)
            assert seconds_of(window, "ceiling") == list(range(1, 16))
            assert window.forgotten == 1, "told again, it is no news"
        if second == 25:
            window.take("belief", belief(now_ns), now_ns)
            assert seconds_of(window, "ceiling") == []
    assert seconds_of(window, "ceiling") == list(range(26, 31))
    assert seconds_of(window, "drone_1") == list(range(1, 31))


def seconds_of(window: Window, camera: str) -> list[int]:
    flown = window.flown()
    assert flown is not None
    messages = [message for _, inputs in flown.ticks for _, message in inputs]
    return [m.header.stamp_ns // S for m in messages if isinstance(m, RelativeObservation) and m.camera == camera]
