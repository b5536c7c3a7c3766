"""A source of another package that fails, or hands over what is no frame, ends nothing; later frames are used."""

from collections import Counter
from collections.abc import Callable
from typing import Any

import pytest
from stream_child import StreamChild

from drivers.motion_capture.captured_frame import CapturedFrame
from drivers.motion_capture.convert import Placement
from drivers.motion_capture.driver import MotionCaptureDriver
from drivers.motion_capture.plug_in_source import PlugInSource
from drivers.motion_capture.settings import BodySection, MotionCaptureSection
from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.topics import OBSERVATION
from groundstation.errors import DriverError

NORTH = (0.0, 0.0, 0.0, 1.0)
HUGE = 10**401
SECTION = MotionCaptureSection(
    name="mocap",
    source="natnet://127.0.0.1",
    bodies=(BodySection(entity="drone_1", name="b"),),
    observed=("drone_1",),
    volume_m=((-9.0, 9.0),) * 3,
)


class Scripted:
    """Hands over the results of functions, one a poll."""

    def __init__(self, *script: Callable[[], Any]) -> None:
        self.rejected: Counter[str] = Counter(damaged=1)
        self.detail = "no frame yet"
        self._script = list(script)

    def poll(self, wait_s: float) -> Any:
        return self._script.pop(0)() if self._script else []

    def close(self) -> None: ...


def frame(pose: Any = ((1.0, 2.0, 1.0), NORTH), **changes: Any) -> CapturedFrame:
    values: dict[str, Any] = {"arrival_ns": clock.now_ns(), "processing_ns": 0, "poses": {"b": pose}}
    return CapturedFrame(**values | changes)


def test_an_exception_is_told_and_counted_until_a_frame_comes() -> None:
    good = frame()
    source = PlugInSource("anchors", Scripted(lambda: 1 / 0, list, lambda: [good]))
    assert source.detail == "no frame yet" and source.rejected == {"damaged": 1}
    for _ in range(2):
        assert source.poll(0.0) == []
        assert source.detail == "anchors://: ZeroDivisionError: division by zero"
    assert source.poll(0.0) == [good]
    assert source.detail == "no frame yet" and source.rejected == {"damaged": 1, "failed": 1}


def test_a_source_may_ask_for_a_new_process() -> None:
    def lost() -> None:
        raise DriverError("connecting anew")

    with pytest.raises(DriverError, match="connecting anew"):
        PlugInSource("anchors", Scripted(lost)).poll(0.0)


@pytest.mark.parametrize(
    "nonsense",
    [
        None,
        ["frame"],
        [frame(((1.0, 2.0, 1.0),))],
        [frame(poses=None)],
        [frame(arrival_ns=HUGE)],
        [frame(processing_ns=float("nan"))],
        [frame(behind_ns={"b": "late"})],
        [frame(deviations={"b": (0.1, 0.1)})],
        [frame(deviations={"b": (float("nan"),) * 4})],
        *([frame((place, NORTH))] for place in ((None, 0, 1), "abc", (HUGE, 0, 1), (1.0, 2.0), (float("inf"), 0, 1))),
        [frame(((0.0, 0.0, 1.0), "abcd"))],
        [frame(((0.0, 0.0, 1.0), (HUGE, 0, 0, 1)))],
    ],
)
def test_nothing_that_it_hands_over_ends_the_process(nonsense: Any) -> None:
    exchange = MemoryExchange()
    child: Any = StreamChild(MemoryBus(exchange, "lab", "mocap"), "mocap")
    heard = MemoryBus(exchange, "lab", "test").subscribe([OBSERVATION])
    source = PlugInSource("anchors", Scripted(lambda: nonsense, lambda: [frame()]))
    driver = MotionCaptureDriver(child, SECTION, source)
    driver.turn()
    driver.turn()
    assert source.rejected["failed"] + driver.counts["no pose"] == 1
    assert len(heard.drain()) == 1


@pytest.mark.parametrize("number", [None, "1", float("nan"), float("inf"), HUGE, 1j])
def test_what_is_no_finite_number_is_no_pose(number: Any) -> None:
    placement, body = Placement(SECTION), SECTION.bodies[0]
    assert placement.entity_pose(body, (number, 0.0, 1.0), NORTH) is None
    assert placement.entity_pose(body, (0.0, 0.0, 1.0), (number, 0.0, 0.0, 1.0)) is None
