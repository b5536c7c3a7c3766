"""Bootstrap and configuration with a drone that acknowledges after any delay (docs/reference/ardrone.md 5.1)."""

import math

import pytest

from drivers.ardrone.desired_config import Ids, Wish, ids_of, scale_from_settings, wishes
from drivers.ardrone.identity import Identity, Model
from drivers.ardrone.session import ArdroneSession, SessionPhase
from drivers.ardrone.settings import ArDroneDriverSettings, ArDroneLimits, FlightConfiguration, Video
from drivers.ardrone.wire import at
from drivers.ardrone.wire.state import StateBit

MS = 1_000_000
S = 1_000_000_000
TICK = 33 * MS
COMMAND, BOOTSTRAP, FLY = int(StateBit.COMMAND), int(StateBit.NAVDATA_BOOTSTRAP), int(StateBit.FLY)
IDS = Ids("0000000a", "0000000b", "0000000c")
WISHES = (
    Wish("control:outdoor", "FALSE"),
    Wish("control:altitude_max", "3000"),
    Wish("pic:ultrasound_freq", "7", required=False),
)
ID_WISHES = tuple(
    Wish(f"custom:{kind}_id", value, required=False)
    for kind, value in zip(("session", "profile", "application"), IDS, strict=True)
)


def wanted(identity, with_ids):
    return (*(ID_WISHES if with_ids else ()), *WISHES)


class Tcp:
    """An inquirer that answers at once: with a version, and with a dump of the drone if it has a control port.

    broken: so many dumps get lost.
    """

    def __init__(self, drone, version="2.3.3", control=True, broken=0):
        self.drone, self.answer, self.control, self.broken = drone, version, control, broken
        self.version, self.listening = None, False
        self._answer: bytes | None = b""

    def ask_version(self):
        self.version = self.answer

    def ask_dump(self):
        self.listening, self._answer = self.control, None if self.control else b""

    @property
    def dump(self):
        if self._answer is None and self.drone.dumped:
            self.drone.dumped, self.broken = False, self.broken - 1
            text = "".join(f"{k} = {v}\n" for k, v in self.drone.stored.items())
            self._answer = text.encode() if self.broken < 0 else b""
        return self._answer


class Drone:
    """Stores a CONFIG and raises bit 6; loses a CONFIG that arrives while it is set; CTRL 5 clears it. Answers late.

    deaf_to: keys that it acknowledges and does not store, with the number of times.
    """

    def __init__(self, uplink=1, downlink=1, state=BOOTSTRAP, ids=True, **deaf_to):
        self.state = state
        self.stored = {"general:num_version_soft": "2.3.3", "control:altitude_max": "500"}
        self.order, self.bare = [], []
        self.uplink: list[list[at.AtCommand]] = [[] for _ in range(uplink)]
        self.downlink = [state] * downlink
        self.trims, self.dumped, self.keeps_ids = 0, False, ids
        self.deaf_to = {key.replace("__", ":"): count for key, count in deaf_to.items()}

    def turn(self, commands):
        self.uplink.append(commands)
        named = None
        for command in self.uplink.pop(0):
            if command.name == "CONFIG_IDS":
                named = command.arguments
            if command.name == "CONFIG" and not self.state & COMMAND:
                self.write(command.text(0), command.text(1), named)
            if command.name == "CTRL" and command.integer(0) == at.CTRL_ACK:
                self.state &= ~COMMAND
            if command.name == "CTRL" and command.integer(0) == at.CTRL_CONFIG_GET:
                self.dumped, self.state = True, self.state | COMMAND
            self.trims += command.name == "FTRIM"
        self.downlink.append(self.state)
        return self.downlink.pop(0)

    def write(self, key, value, named):
        self.state = (self.state | COMMAND) & ~BOOTSTRAP
        self.order.append(key)
        if named != tuple(IDS):
            self.bare.append(key)
        if self.deaf_to.get(key, 0) > 0:
            self.deaf_to[key] -= 1
        elif self.keeps_ids or not key.startswith("custom:"):
            self.stored[key] = value


def session_for(drone, **tcp):
    return ArdroneSession(wanted, IDS, Tcp(drone, **tcp))


def run(session, drone, ticks=400, every=1, until=SessionPhase.READY):
    seen = drone.downlink[0]
    for i in range(ticks):
        commands = session.step(i * TICK, seen, 0)
        seen = drone.turn([] if i % every else commands)
        if session.phase is until:
            return i
    return None


@pytest.mark.parametrize("uplink", [1, 2, 4])
@pytest.mark.parametrize("downlink", [1, 3])
@pytest.mark.parametrize("state", [BOOTSTRAP, 0x4F8000D0])
@pytest.mark.parametrize("control", [True, False])
def test_every_key_is_acknowledged_in_order_whatever_the_delay(uplink, downlink, state, control):
    drone = Drone(uplink, downlink, state)
    session = session_for(drone, control=control)
    assert run(session, drone) is not None and session.detail == ""
    keys = ["general:navdata_demo", *(wish.key for wish in (*ID_WISHES, *WISHES))]
    assert list(dict.fromkeys(drone.order)) == keys
    assert all(drone.stored[wish.key] == wish.value for wish in (*ID_WISHES, *WISHES))
    assert set(drone.bare) == {"general:navdata_demo"}, "ids go before every other CONFIG"
    assert not drone.state & COMMAND
    for _ in range(5):
        drone.turn([])
    assert drone.trims == 3, "trimmed before it is ready, not while the motors start"


def test_lost_datagrams_only_delay():
    drone = Drone()
    session = session_for(drone)
    assert run(session, drone, 600, every=3) is not None
    assert drone.stored["control:altitude_max"] == "3000"


def test_a_setting_acknowledged_but_not_stored_is_sent_again():
    drone = Drone(control__altitude_max=1)
    session = session_for(drone)
    assert run(session, drone) is not None
    assert drone.stored["control:altitude_max"] == "3000" and drone.order.count("control:altitude_max") == 2


def test_a_limit_that_the_drone_does_not_take_keeps_it_on_the_ground_with_the_reason():
    drone = Drone(control__altitude_max=1000)
    session = session_for(drone)
    assert run(session, drone, until=SessionPhase.FAILED) is not None
    assert drone.order.count("control:altitude_max") == 3, "bounded"
    assert session.detail == "control:altitude_max is 500 on the drone, and 3000 was written"
    assert [notice.severity for notice in session.news] == ["ERROR"]
    drone.deaf_to.clear()
    for i in range(1000, 1600):
        drone.downlink = [drone.turn(session.step(i * TICK, drone.downlink[0], 0))]
    assert session.phase is SessionPhase.READY, "it tries on"


@pytest.mark.parametrize(("broken", "stored"), [(0, True), (2, True), (1000, False)])
def test_a_dump_that_gets_lost_is_asked_for_again_and_its_want_is_told(broken, stored):
    drone = Drone(control__altitude_max=0 if broken > 2 else 1)
    session = session_for(drone, broken=broken)
    assert run(session, drone) is not None
    assert any("not read back" in notice.text for notice in session.news) is not stored
    assert drone.stored["control:altitude_max"] == "3000"


def test_a_drone_whose_serial_number_is_needed_waits_until_it_is_read():
    drone = Drone()
    drone.stored["general:drone_serial"] = "AB12"
    session = ArdroneSession(wanted, IDS, Tcp(drone, broken=3), serial_needed=True)
    assert run(session, drone, until=SessionPhase.FAILED) is not None
    assert session.detail == "its serial number was not read"
    seen = drone.state
    for i in range(1000, 1600):
        seen = drone.turn(session.step(i * TICK, seen, 0))
    assert session.phase is SessionPhase.READY and session.identity.serial == "AB12"


def test_a_wish_that_is_not_taken_is_told_and_does_not_ground():
    drone = Drone(pic__ultrasound_freq=1000)
    drone.stored["pic:ultrasound_freq"] = "8"
    session = session_for(drone)
    assert run(session, drone) is not None
    assert any("ultrasound_freq stays 8" in notice.text for notice in session.news)


def test_old_firmware_is_not_asked_for_ids_and_one_that_keeps_none_is_written_without():
    drone = Drone()
    session = session_for(drone, version="1.5.1")
    assert run(session, drone) is not None
    assert not any(key.startswith("custom:") for key in drone.order)
    drone = Drone(ids=False)
    drone.stored |= {wish.key: "00000000" for wish in ID_WISHES}
    session = session_for(drone, version="")
    assert run(session, drone, 800) is not None
    assert "control:altitude_max" in drone.bare


def test_a_drone_without_files_is_known_by_its_dump():
    drone = Drone()
    drone.stored |= {"general:num_version_soft": "1.7.4", "general:drone_serial": "AB12"}
    session = session_for(drone, version="")
    assert run(session, drone) is not None
    assert session.identity == Identity(Model.AR1, "1.7.4", "AB12")
    assert "AR.Drone 1.0, firmware 1.7.4, serial AB12" in session.news[0].text


def test_flat_trim_is_never_sent_in_flight():
    drone = Drone(state=FLY | BOOTSTRAP)
    session = session_for(drone)
    assert run(session, drone) is not None
    assert drone.trims == 0
    for i in range(10):
        assert session.step((500 + i) * TICK, 0, 0) == [], "nor after it has landed: it was trimmed when it started"


def test_flat_trim_waits_until_the_drone_stands_still_and_level():
    drone = Drone()
    session = session_for(drone)
    run(session, drone, until=SessionPhase.TRIMMING)
    for i in range(400, 500):
        assert session.step(i * TICK, drone.state, 0, still=False) == []
    assert session.phase == "TRIMMING" and session.detail == "waits until it stands still and level"
    sent = [command.name for i in range(500, 504) for command in session.step(i * TICK, drone.state, 0)]
    assert sent == ["FTRIM"] * 3 and session.phase is SessionPhase.READY


@pytest.mark.parametrize("bit", [StateBit.NAVDATA_BOOTSTRAP, StateBit.NAVDATA_DEMO])
def test_a_drone_that_was_restarted_is_configured_again(bit):
    drone = Drone()
    session = session_for(drone)
    ready = run(session, drone)
    phases = []
    for i in range(40):
        session.step((ready + i) * TICK, int(bit), 0)
        phases.append(session.phase)
    assert phases[19] is SessionPhase.READY, "a drone may say so for a while"
    assert phases[39] is SessionPhase.CONFIGURING
    assert session.detail == "configuring general:navdata_demo"


def test_silence_asks_again_after_1_s_and_starts_over_after_2_s():
    drone = Drone()
    session = session_for(drone)
    run(session, drone)
    assert not session.request_due(0, 900 * MS)
    assert session.request_due(10 * MS, 1100 * MS)
    assert not session.request_due(100 * MS, 1190 * MS)
    assert session.request_due(120 * MS, 1210 * MS)
    assert session.step(99 * S, 0, 2100 * MS) == []
    assert session.phase is SessionPhase.SEARCHING
    assert session.request_due(300 * MS, 0)


SETTINGS = ArDroneDriverSettings(
    name="drone_1",
    address="127.0.0.1",
    limits=ArDroneLimits(max_tilt_deg=10, max_climb_m_s=0.1, max_yaw_rate_deg_s=20),
    flight=FlightConfiguration(ultrasound_freq=7, altitude_max_m=2.5),
    video=Video(codec="h264_720p", channel="bottom", bitrate=3000),
)


def test_configured_values_are_within_the_limits_of_the_drone():
    keys = {wish.key: wish.value for wish in wishes(SETTINGS, Identity(Model.AR2), True)}
    assert keys["control:euler_angle_max"] == "0.174533"
    assert keys["control:control_vz_max"] == "200"
    assert keys["control:control_yaw"] == "0.7"
    assert (keys["control:altitude_max"], keys["pic:ultrasound_freq"]) == ("2500", "7")
    assert keys["general:com_watchdog"] == "2", "without commands it lands soon"
    names = list(keys)
    assert names[:3] == ["custom:session_id", "custom:profile_id", "custom:application_id"]
    assert names.index("control:outdoor") < names.index("control:euler_angle_max")
    scale = scale_from_settings(SETTINGS)
    assert scale.climb_m_s == pytest.approx(0.2) and scale.tilt_rad == pytest.approx(math.radians(10))
    assert all(len(value) == 8 and int(value, 16) for value in ids_of("drone_1"))
    assert ids_of("drone_1") != ids_of("drone_2")


def test_video_is_asked_of_an_ar2_only():
    ar2, ar1 = (
        {wish.key: wish.value for wish in wishes(SETTINGS, Identity(model), True)} for model in (Model.AR2, Model.AR1)
    )
    assert (ar2["video:video_codec"], ar2["video:video_channel"], ar2["video:max_bitrate"]) == ("131", "1", "3000")
    assert not any(key.startswith("video:") for key in ar1)
