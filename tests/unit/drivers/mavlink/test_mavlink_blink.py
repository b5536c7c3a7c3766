"""A MAVLink vehicle plays a tune to identify itself; an armed one does not."""

import pytest

from drivers.mavlink import blink as blinking
from drivers.mavlink.links.seam import Heard
from drivers.mavlink.wire.frames import ReceivedFrame
from drivers.mavlink.wire.names import ARMED
from drivers.mavlink.wire.service import PlayTune
from drivers.mavlink.wire.telemetry import Heartbeat
from groundstation.errors import DriverError
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.settings.sections import driver_sections


class Link:
    """A link to vehicles with these systems and base modes."""

    def __init__(self, modes):
        self.modes, self.sent, self.closed = modes, [], False

    def receive(self):
        beats = [(system, Heartbeat(2, 12, mode, 0, 4)) for system, mode in self.modes.items()]
        return [Heard(0, ReceivedFrame(system, 1, 0, beat)) for system, beat in beats]

    def send(self, system, message):
        self.sent.append((system, message))

    def close(self):
        self.closed = True


@pytest.fixture
def blink(monkeypatch):
    """Return the function that makes drone_2 of the mixed team blink on a link with vehicles by system id."""
    (section,) = (one for one in driver_sections(load_field(find_field("mixed-team"))) if "drone_2" in one.entities
                  and one.kind == "mavlink")  # fmt: skip
    monkeypatch.setattr(blinking, "_LASTS_S", 0.0)
    monkeypatch.setattr(blinking, "_CONNECT_S", 0.05)

    def call(modes):
        link = Link(modes)
        monkeypatch.setattr(blinking, "open_link", lambda _: link)
        try:
            return link, blinking.blink(section.section, "drone_2")
        finally:
            assert link.closed

    return call


def test_the_vehicle_of_that_name_plays(blink):
    link, told = blink({11: 0, 12: 0})
    assert "tune" in told
    ((system, tune),) = [(to, message) for to, message in link.sent if isinstance(message, PlayTune)]
    assert system == tune.target_system == 11 and 0 < len(tune.tune) <= 30


def test_an_armed_vehicle_is_left_alone_and_a_silent_one_named(blink):
    with pytest.raises(DriverError, match="is armed"):
        blink({11: ARMED})
    with pytest.raises(DriverError, match="system 11 does not answer"):
        blink({12: 0})
