"""Bootstrap and configuration against a drone that acknowledges as the sheet says, with every delay."""

import math

import pytest

from drivers.ardrone.link import SequenceFilter
from drivers.ardrone.session import Phase, Session, configuration, scale_from_settings
from drivers.ardrone.settings import ArDroneDriverSettings, ArDroneLimits, Flight
from drivers.ardrone.wire import at
from drivers.ardrone.wire.state import StateBit

MS = 1_000_000
S = 1_000_000_000
COMMAND = int(StateBit.COMMAND)
BOOTSTRAP = int(StateBit.NAVDATA_BOOTSTRAP)
KEYS = (("general:navdata_demo", "FALSE"), ("control:outdoor", "FALSE"), ("control:altitude_max", "3000"))


class Drone:
    """Stores a CONFIG and raises bit 6; loses a CONFIG that comes while it is up; CTRL 5 clears it. Answers late."""

    def __init__(self, uplink=1, downlink=1, state=BOOTSTRAP):
        self.state = state
        self.stored = {}
        self.order = []
        self.uplink = [[] for _ in range(uplink)]
        self.downlink = [state] * downlink
        self.trims = 0

    def turn(self, commands):
        self.uplink.append(commands)
        for command in self.uplink.pop(0):
            if command.name == "CONFIG" and not self.state & COMMAND:
                self.stored[command.text(0)] = command.text(1)
                self.order.append(command.text(0))
                self.state = (self.state | COMMAND) & ~BOOTSTRAP
            if command.name == "CTRL" and command.integer(0) == at.CTRL_ACK:
                self.state &= ~COMMAND
            self.trims += command.name == "FTRIM"
        self.downlink.append(self.state)
        return self.downlink.pop(0)


@pytest.mark.parametrize("uplink", [1, 2, 4])
@pytest.mark.parametrize("downlink", [1, 3])
@pytest.mark.parametrize("state", [BOOTSTRAP, 0x4F8000D0])
def test_every_key_is_acknowledged_in_order_whatever_the_delay(uplink, downlink, state):
    drone, session = Drone(uplink, downlink, state), Session(KEYS)
    seen = drone.downlink[0]
    for _ in range(150):
        seen = drone.turn(session.step(seen, 0))
    assert session.phase is Phase.READY and session.detail == ""
    assert drone.stored == dict(KEYS)
    assert list(dict.fromkeys(drone.order)) == [key for key, _ in KEYS]
    assert not drone.state & COMMAND
    assert drone.trims == 3


def test_lost_datagrams_only_delay():
    drone, session = Drone(), Session(KEYS)
    seen = drone.state
    for i in range(300):
        commands = session.step(seen, 0)
        seen = drone.turn([] if i % 3 else commands)
    assert session.phase is Phase.READY and drone.stored == dict(KEYS)


def test_flat_trim_is_never_sent_in_flight():
    session = Session((), flat_trim=True)
    session.phase = Phase.READY
    assert session.step(int(StateBit.FLY), 0) == []
    assert session.step(0, 0) == [at.ftrim()]


def test_a_drone_that_forgot_us_is_configured_again():
    session = Session(KEYS)
    session.phase = Phase.READY
    session.step(BOOTSTRAP, 0)
    assert session.phase is Phase.CONFIGURING
    session.phase = Phase.READY
    session.step(int(StateBit.NAVDATA_DEMO), 0)
    assert session.phase is Phase.CONFIGURING


def test_silence_asks_again_after_1_s_and_starts_over_after_2_s():
    session = Session(KEYS)
    session.phase = Phase.READY
    assert not session.request_due(0, 900 * MS)
    assert session.request_due(10 * MS, 1100 * MS)
    assert not session.request_due(100 * MS, 1190 * MS)
    assert session.request_due(120 * MS, 1210 * MS)
    assert session.step(0, 2100 * MS) == []
    assert session.phase is Phase.SEARCHING
    assert session.request_due(300 * MS, 0)


def test_what_is_configured_is_within_what_the_drone_accepts():
    settings = ArDroneDriverSettings(
        name="drone_1",
        address="127.0.0.1",
        limits=ArDroneLimits(max_tilt_deg=10, max_climb_m_s=0.1, max_yaw_rate_deg_s=20),
        flight=Flight(ultrasound_freq=7, altitude_max_m=2.5),
    )
    keys = dict(configuration(settings))
    assert keys["general:navdata_demo"] == "FALSE"
    assert keys["control:euler_angle_max"] == "0.174533"
    assert keys["control:control_vz_max"] == "200"
    assert keys["control:control_yaw"] == "0.7"
    assert (keys["control:altitude_max"], keys["pic:ultrasound_freq"]) == ("2500", "7")
    names = list(keys)
    assert names.index("control:outdoor") < names.index("control:euler_angle_max")
    scale = scale_from_settings(settings)
    assert scale.climb_m_s == pytest.approx(0.2) and scale.tilt_rad == pytest.approx(math.radians(10))


def test_navdata_numbers_must_rise():
    numbers = SequenceFilter()
    now = 10 * S
    assert [numbers.accept(now + i * MS, n) for i, n in enumerate((5, 6, 6, 5, 9, 1))] == [
        True, True, False, False, True, False,
    ]  # fmt: skip
    rate, quality = numbers.rates(now + 6 * MS)
    assert rate == 3 and quality == pytest.approx(3 / 5)


def test_a_lower_number_after_a_pause_is_a_new_session():
    numbers = SequenceFilter()
    assert numbers.accept(10 * S, 4_000_000_000)
    assert not numbers.accept(10 * S + 200 * MS, 1)
    assert numbers.accept(10 * S + 301 * MS, 1)
    assert numbers.accept(10 * S + 306 * MS, 2)
    assert numbers.rates(20 * S) == (0, None)
