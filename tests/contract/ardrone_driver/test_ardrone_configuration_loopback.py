"""The driver's queries of a drone, and its configuration, over loopback UDP and TCP."""

import itertools
import time

import pytest

from drivers.ardrone.desired_config import ids_of
from drivers.ardrone.link import ArDroneLink
from drivers.ardrone.settings import ArDroneDriverSettings, Video
from drivers.datagrams import DatagramLog
from groundstation.bus.messages import AckStage, Verb
from groundstation.bus.topics import COMMAND_ACK
from groundstation.errors import DriverError

FLY, BOOTSTRAP = 1 << 0, 1 << 11


def told(rig):
    return {notice.text: notice for notice in rig.drone.news()}


def test_ready_comes_after_the_configuration_and_then_the_first_take_off_is_accepted(rig):
    while not rig.fake.config:
        rig.turn()
    assert rig.process.states == [], "heard, but not configured"
    rig.until(lambda: rig.process.states != [])
    assert rig.process.states[0].startswith("READY") and rig.fake.config["control:altitude_max"] == "3000"
    rig.order(Verb.TAKEOFF)
    rig.until(lambda: rig.decision.mode == "HOVER")
    assert AckStage.REFUSED not in [ack.stage for ack in rig.messages(COMMAND_ACK)]


def test_a_flying_drone_is_taken_over_before_it_is_configured(rig):
    rig.fake.state |= FLY
    rig.until(lambda: rig.process.states != [])
    assert rig.drone._session.phase != "READY" and rig.decision.mode == "LANDING"


def test_ids_go_before_every_key_and_everything_is_read_back(new_rig):
    rig = new_rig("2.4.8", video=Video(codec="h264_720p", channel="bottom", bitrate=2500)).connect()
    config, ids = rig.fake.config, ids_of("drone_1")
    assert config["custom:session_id"] == ids.session and config["custom:application_id"] == ids.application
    assert (config["video:video_codec"], config["video:video_channel"]) == ("131", "1")
    assert config["video:max_bitrate"] == "2500"
    keys = [arguments for name, _, arguments in rig.fake.lines if name in ("CONFIG", "CONFIG_IDS")]
    for before, key in itertools.pairwise(keys):
        if "navdata_demo" not in key and key.count('"') == 4:
            assert before == ",".join(f'"{one}"' for one in ids)
    assert "4,0" in rig.fake.said("CTRL")
    (text,) = [text for text in told(rig) if "configured in" in text]
    assert "AR.Drone 2.0, firmware 2.4.8, serial PS721000AB2L01234" in text


@pytest.mark.parametrize(("pinned", "flies"), [("PS721000AB2L01234", True), ("PS721000AB2L09999", False)])
def test_another_drone_at_the_address_does_not_take_off(new_rig, pinned, flies):
    rig = new_rig("2.4.8", serial_number=pinned).connect()
    rig.order(Verb.TAKEOFF)
    rig.turn()
    acks = [ack for ack in rig.messages(COMMAND_ACK) if ack.stage is not AckStage.RECEIVED]
    assert (acks[-1].stage is AckStage.ACCEPTED) is flies
    assert flies or "its serial number is PS721000AB2L01234, the field says PS721000AB2L09999" in acks[-1].reason


@pytest.mark.parametrize(("stored", "phase"), [("60", "FAILED"), ("2", "READY"), (None, "READY")])
def test_a_watchdog_that_the_drone_does_not_take_grounds_it_only_where_it_is_another(new_rig, stored, phase):
    rig = new_rig("2.4.8")
    rig.fake.deaf_to = {"general:com_watchdog"}
    if stored is not None:
        rig.fake.config["general:com_watchdog"] = stored
    rig.until(lambda: rig.drone._session.phase == phase)


def test_a_drone_in_the_operators_hands_is_not_trimmed(rig):
    rig.fake.theta, rig.fake.force_mg = 12_000.0, 208.0
    rig.until(lambda: rig.drone._session.phase == "TRIMMING")
    until = time.monotonic() + 1.3
    while time.monotonic() < until:
        rig.turn()
    assert rig.fake.said("FTRIM") == []
    assert rig.drone.view(time.monotonic_ns()).not_ready == "waits until it stands still and level"
    rig.fake.theta, rig.fake.force_mg = 1000.0, 0.0
    rig.connect()
    assert rig.fake.said("FTRIM")


def test_a_limit_that_is_not_stored_grounds_the_drone_and_says_why(new_rig):
    rig = new_rig("2.3.3")
    rig.fake.deaf_to = {"control:altitude_max"}
    rig.fake.config["control:altitude_max"] = "100000"
    rig.until(lambda: rig.drone._session.phase == "FAILED")
    rig.order(Verb.TAKEOFF)
    rig.turn()
    ack = rig.messages(COMMAND_ACK)[-1]
    assert ack.stage is AckStage.REFUSED and "altitude_max is 100000 on the drone, and 3000 was written" in ack.reason
    assert any("not configured" in text and notice.severity == "ERROR" for text, notice in told(rig).items())
    assert rig.fake.said("REF").count("290718208") == 0


def test_video_of_an_ar1_is_refused_by_name_and_never_asked_for(new_rig):
    rig = new_rig("1.7.4", video=Video()).connect()
    texts = told(rig)
    assert any("AR.Drone 1.0" in text and "out of scope" in text for text in texts)
    assert not any(key.startswith("video:") for key in rig.fake.config)
    assert told(rig) == {}, "told once"


def test_a_drone_that_was_restarted_is_numbered_and_configured_anew_and_does_not_take_off(rig):
    rig.take_off()
    rig.order(Verb.TRACK)
    rig.tracking = True
    rig.speaking = False
    began = time.monotonic()
    while time.monotonic() - began < 3.3:
        rig.turn()
        time.sleep(0.03)
    rig.fake._waiting(rig.fake.at), rig.fake._waiting(rig.fake.navdata)
    rig.fake.lines.clear(), rig.fake.config.clear()
    rig.fake.state, rig.fake.sequence, rig.fake.client, rig.fake.major = BOOTSTRAP, 0, None, 2
    rig.speaking = True
    rig.until(lambda: rig.decision.mode == "LANDED" and rig.drone._session.phase == "READY")
    assert rig.fake.lines[0][1] == 1 and rig.fake.config["general:navdata_demo"] == "FALSE"
    assert rig.fake.config["control:altitude_max"] == "3000"
    assert set(rig.fake.said("REF")) == {"290717696"}, "no start bit, though it had been flying"
    assert all(arguments == "0,0,0,0,0" for arguments in rig.fake.said("PCMD"))


@pytest.mark.parametrize("bit", [BOOTSTRAP, 1 << 10])
def test_a_take_off_is_not_sent_to_a_drone_that_forgot_its_limits(rig, bit):
    rig.connect()
    rig.drone._session.phase = type(rig.drone._session.phase).CONFIGURING
    rig.fake.lines.clear()
    rig.order(Verb.TAKEOFF)
    rig.turn()
    assert rig.messages(COMMAND_ACK)[-1].stage is AckStage.REFUSED
    assert "290718208" not in rig.fake.said("REF")


def test_bound_ports_are_used_and_a_taken_one_is_named(new_rig):
    rig = new_rig(local_address="127.0.0.1", local_navdata_port=45554, local_at_port=45556)
    rig.connect()
    assert rig.fake.client == ("127.0.0.1", 45554)
    other = ArDroneDriverSettings(name="drone_2", address="127.0.0.2", local_address="127.0.0.1")
    for taken in ({"local_navdata_port": 45554}, {"local_at_port": 45556}):
        settings = other.model_copy(update=taken)
        with pytest.raises(DriverError, match=r"cannot bind 127.0.0.1:4555[46] \(UDP\)"):
            ArDroneLink(settings, DatagramLog(rig.process.bus, "drone_2"))
