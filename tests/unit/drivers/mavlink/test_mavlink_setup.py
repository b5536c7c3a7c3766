"""What `groundstation mavlink setup` reads and writes, by the names that a firmware has."""

from collections import deque

import pytest

from drivers.mavlink.links.seam import Heard
from drivers.mavlink.parameters import needed
from drivers.mavlink.setup import ParameterSetup
from drivers.mavlink.wire.flight import CommandLong
from drivers.mavlink.wire.frames import Message, ReceivedFrame
from drivers.mavlink.wire.names import Flavour
from drivers.mavlink.wire.parameters import REAL32
from drivers.mavlink.wire.service import ParamRequestRead, ParamSet, ParamValue
from drivers.mavlink.wire.telemetry import SysStatus


class Vehicle:
    """A link with one ArduPilot of system 1 on it, which knows only its own parameters."""

    def __init__(self, values: dict[str, float]) -> None:
        self.values = values
        self._answers: deque[Message] = deque()

    def send(self, system: int, message: Message) -> None:
        match message:
            case CommandLong():
                self._answers.append(SysStatus(0, 0, 0))
            case ParamSet() if message.param_id in self.values:
                self.values[message.param_id] = message.param_value
                self._tell(message.param_id)
            case ParamRequestRead() if message.param_id in self.values:
                self._tell(message.param_id)

    def _tell(self, name: str) -> None:
        self._answers.append(ParamValue(name, self.values[name], REAL32, 1, 0))

    def receive(self) -> list[Heard]:
        answers = [Heard(0, ReceivedFrame(1, 1, 0, message)) for message in self._answers]
        self._answers.clear()
        return answers


@pytest.mark.parametrize("later", [False, True])
def test_an_ardupilot_is_set_up_by_the_names_of_its_release(later: bool) -> None:
    """4.6 has ARMING_CHECK and LAND_SPEED, 4.7 has ARMING_SKIPCHK and LAND_SPD_MS instead."""
    rows = [(later and one.successor) or one for one in needed(Flavour.ARDUPILOT, 255)]
    vehicle = Vehicle({one.name: one.value for one in rows})
    vehicle.values |= {"ARMING_SKIPCHK": 64.0, "LAND_SPD_MS": 0.5} if later else {"LAND_SPEED": 50.0}
    setup = ParameterSetup(vehicle, 1, Flavour.ARDUPILOT, 255)  # type: ignore[arg-type]
    found = list(setup.differences())
    assert {one.wanted.name for one in found} == ({"ARMING_SKIPCHK", "LAND_SPD_MS"} if later else {"LAND_SPEED"})
    assert all(setup.apply(one.wanted) for one in found)
    assert vehicle.values["LAND_SPD_MS" if later else "LAND_SPEED"] == pytest.approx(0.7 if later else 70)
    assert not later or vehicle.values["ARMING_SKIPCHK"] == 0
    assert not list(setup.differences())
