"""Delays from a flight in which the drones' own headings jump, as an AR.Drone's does at lift-off."""

import bisect
from collections.abc import Iterator

import msgspec
import pytest
from swinging_lab import Lab

from groundstation.bus.messages import Message, Odometry, RelativeObservation
from groundstation.calibration.delay import delays
from groundstation.field.resolved import ResolvedField
from sim_bridge.study.wrong_figures import WrongFigures

SENSORS = ("ceiling", "drone_1 velocity", "drone_2 velocity")


class Jumping(Lab):  # type: ignore[misc]  # its module lies beside, where mypy does not look
    """The swinging lab, seen by its ceiling camera alone, 25 times a second; all headings jump at these times [s]."""

    jumps_s: tuple[float, ...] = ()
    jump_rad = 0.0

    def messages(self, t: float, tick: int) -> Iterator[tuple[str, Message]]:
        for key, message in super().messages(t, 5 * (tick // 2) + tick % 2):
            if not isinstance(message, RelativeObservation) or message.observer == "ceiling":
                yield key, message

    def own(self, name: str, t: float) -> Odometry:
        told = super().own(name, t)
        reset = bisect.bisect(self.jumps_s, t)
        return msgspec.structs.replace(told, yaw_rad=told.yaw_rad + reset * self.jump_rad, reset=reset)


def measured(field: ResolvedField, jumps_s: tuple[float, ...], jump_rad: float) -> dict[str, float | None]:
    lab = Jumping(field, WrongFigures({}), seed=3, seconds=24.0)
    lab.jumps_s, lab.jump_rad = jumps_s, jump_rad
    return {one.sensor: one.measured_ms for one in delays(lab.flown(), field) if one.sensor in SENSORS}


@pytest.mark.parametrize("jumps_s", [(2.1,), (2.1, 6.0, 9.0)])
def test_a_jump_of_the_heading_shifts_no_delay(lab_field: ResolvedField, jumps_s: tuple[float, ...]) -> None:
    smooth, jumped = measured(lab_field, (), 0.0), measured(lab_field, jumps_s, -2.3)
    assert jumped == pytest.approx(measured(lab_field, jumps_s, -0.4), abs=0.1)
    assert smooth["ceiling"] == pytest.approx(120.0, abs=3.0)
    assert jumped == pytest.approx(smooth, abs=10.0)
