"""A stop must last as long as its fault, and is judged only where there was time for it; a fall is a bound."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from groundstation.arrays import Array
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.study.faults.judge import Judge

PERIOD_S, BEGINS_S, BEFORE_S, END_S = 0.05, 10.0, 5.0, 22.0
ROOM: dict[str, Any] = {"fence": {"x_m": (-9.0, 9.0), "y_m": (-9.0, 9.0), "z_m": (0.0, 9.0)}}
FROZEN = Fault(kind=FaultKind.TELEMETRY_FROZEN, entity="a", start_s=BEGINS_S)

Velocity = Callable[[float], tuple[float, float]]


def flown(velocity: Velocity, told: Callable[[float], bool], height_m: float = 3.0) -> Judge:
    """Return the judge of a flight with a velocity forward and up [m/s] by time, until it reaches the floor."""
    judge = Judge(ROOM, {"a": 0.6}, PERIOD_S)
    x, z = -5.0, height_m
    for now_s in np.arange(BEFORE_S, END_S, PERIOD_S).tolist():
        forward, up = velocity(now_s) if z > 0.0 else (0.0, 0.0)
        x, z = x + PERIOD_S * forward, max(0.0, z + PERIOD_S * up)
        row: Array = np.array([x, 0.0, z, forward, 0.0, up, 0, 0, 0, 0, 0, 0, float(z == 0.0)])
        judge.see(now_s, {"a": row}, {"a": told(now_s)}, {"a": row[:2]})
    return judge


def unsafe(velocity: Velocity, told: Callable[[float], bool], fault: Fault = FROZEN) -> dict[str, float]:
    found: dict[str, float] = flown(velocity, told).verdict((fault,), (fault.start_s,))["unsafe"]
    return found


def still(now_s: float) -> tuple[float, float]:
    return (0.3, 0.0) if now_s < 11.0 else (0.0, 0.0)


def test_one_that_hovers_for_a_moment_and_flies_on_has_resumed() -> None:
    def velocity(now_s: float) -> tuple[float, float]:
        return (0.8, 0.0) if now_s > 11.6 else (0.0, 0.0)

    broken = unsafe(velocity, lambda now_s: not 10.19 < now_s < 10.21 and not 10.9 < now_s < 11.6)
    assert broken == {"resumed": pytest.approx(11.6, abs=0.11)}


@pytest.mark.parametrize("moving", [(0.35, 0.0), (0.0, 0.35)], ids=["along", "up"])
def test_one_that_moves_again_after_its_rest_has_resumed_whoever_moves_it(moving: tuple[float, float]) -> None:
    broken = unsafe(lambda now_s: moving if now_s > 15.0 else (0.0, 0.0), lambda now_s: now_s < 10.5)
    assert broken == {"resumed": pytest.approx(15.0, abs=0.6)}


def test_one_that_rises_and_sinks_does_not_rest() -> None:
    assert set(unsafe(lambda now_s: (0.0, 0.8 * math.sin(math.pi * now_s)), lambda _: False)) == {"rest"}


@pytest.mark.parametrize(
    ("velocity", "told", "fault"),
    [
        (lambda now_s: (0.8, 0.0) if now_s > 14.0 else still(now_s), lambda now_s: not 10.5 < now_s < 14.0,
         FROZEN.model_copy(update={"end_s": 14.0})),
        (lambda now_s: (0.15, -0.5) if now_s > 14.0 else still(now_s), lambda now_s: now_s < 10.5, FROZEN),
        (lambda now_s: (0.4 * math.sin(3.0 * now_s), 0.0) if now_s > 14.0 else still(now_s),
         lambda now_s: now_s < 10.5, FROZEN),
    ],
    ids=["healed", "lands", "corrects"],
)  # fmt: skip
def test_what_is_no_resumption(velocity: Velocity, told: Callable[[float], bool], fault: Fault) -> None:
    assert unsafe(velocity, told, fault) == {}


def falling(now_s: float) -> tuple[float, float]:
    return (0.0, -9.8 * max(0.0, now_s - 12.0))


@pytest.mark.parametrize(
    ("velocity", "height_m", "broken"),
    [(falling, 2.5, {"fell"}), (falling, 0.4, {"fell"}), (lambda now_s: (0.0, -1.5 * (now_s > 12.0)), 2.5, set())],
    ids=["high", "low", "as fast as any field allows"],
)
def test_a_fall_is_unsafe(velocity: Velocity, height_m: float, broken: set[str]) -> None:
    judge = flown(velocity, lambda _: True, height_m)
    assert set(judge.verdict((), ())["unsafe"]) == broken


@pytest.mark.parametrize(
    ("fault", "shown_s", "judged"),
    [
        (FROZEN, 10.0, True),
        (FROZEN, None, False),
        (FROZEN, END_S - 4.0, False),
        (FROZEN.model_copy(update={"end_s": 13.0}), 10.0, False),
        (Fault(kind=FaultKind.WIND, entity="a", start_s=10.0), 10.0, None),
    ],
    ids=["in time", "never showed", "too late", "healed", "need not stop"],
)
def test_a_stop_that_was_not_judged_has_no_figures(fault: Fault, shown_s: float | None, judged: bool | None) -> None:
    judge = flown(still, lambda now_s: now_s < 10.5)
    assert judge.stop_judged(fault, shown_s) is judged
    verdict = judge.verdict((fault,), (shown_s,))
    assert (verdict["hover_s"] is not None, verdict["rest_s"] is not None) == (bool(judged), bool(judged))


def test_nothing_is_judged_where_nobody_lifted_off() -> None:
    assert Judge(ROOM, {"a": 0.6}, PERIOD_S).stop_judged(FROZEN, 10.0) is False
