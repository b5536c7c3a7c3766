"""A second ground station that commands the vehicles of a link is reported once, with a remedy."""

from collections import Counter

import pytest

from drivers.mavlink.other_stations import REMEDY, GivenOrders, OtherStations, speaks_as_we
from drivers.mavlink.wire.flight import CommandAckMessage, command_to
from drivers.mavlink.wire.frames import Message, ReceivedFrame
from drivers.mavlink.wire.names import MavCmd
from drivers.mavlink.wire.telemetry import OUR_HEARTBEAT, Heartbeat

QGROUNDCONTROL = Heartbeat(6, 8, 192, 0, 4)
US = (255, 190)


def stations(*riders: int) -> OtherStations:
    return OtherStations(US, {11: "drone_2", 12: "drone_3"}, riders)


def frame(system: int, message: Message, component: int = 190) -> ReceivedFrame:
    return ReceivedFrame(system, component, 0, message)


def ack(command: int, to: int, component: int = 190) -> CommandAckMessage:
    return CommandAckMessage(command, 0, 0, 0, to, component)


def test_its_heartbeat_is_told_once() -> None:
    heard = stations()
    for _ in range(3):
        heard.take(frame(254, QGROUNDCONTROL))
        heard.take(frame(253, QGROUNDCONTROL))
    assert list(heard.news) == [
        (f"another ground station is on this link (system {system})", REMEDY) for system in (254, 253)
    ]


def test_an_answer_to_its_order_is_told() -> None:
    heard = stations()
    heard.take(frame(11, ack(MavCmd.COMPONENT_ARM_DISARM, 254), 1))
    heard.take(frame(11, ack(MavCmd.NAV_LAND, 254), 1))
    assert list(heard.news) == [("drone_2 answers orders of another ground station (system 254)", REMEDY)]


def test_a_station_with_our_system_id_is_told_by_its_component() -> None:
    """MAVProxy is 255/230; its heartbeat hides the loss of ours from an ArduPilot."""
    heard = stations()
    heard.take(frame(11, ack(MavCmd.NAV_LAND, 255, 230), 1))
    heard.take(frame(255, QGROUNDCONTROL, 230))
    assert [text for text, _ in heard.news] == [
        "drone_2 answers orders of another ground station (system 255, component 230)",
        "another ground station is on this link (system 255, component 230)",
    ]


@pytest.mark.parametrize(
    ("system", "message"),
    [
        (1, Heartbeat(2, 12, 0, 0, 3)),  # a vehicle: reported as one that is not in the field file
        (11, Heartbeat(18, 8, 0, 0, 4)),  # its computer on board
        (11, QGROUNDCONTROL),  # a companion that identifies as a ground station, under the vehicle's id
        (255, OUR_HEARTBEAT),
        (11, ack(MavCmd.NAV_LAND, 255)),
        (11, ack(MavCmd.NAV_LAND, 0)),
        (11, ack(MavCmd.NAV_LAND, 255, 0)),  # to all components
        (11, ack(MavCmd.NAV_LAND, 255, 255)),
        (11, ack(MavCmd.GET_HOME_POSITION, 255, 230)),  # it only observes
        (11, ack(MavCmd.NAV_LAND, 11)),  # PX4 answers itself
        (11, ack(MavCmd.REQUEST_MESSAGE, 254)),  # it only observes
        (1, ack(MavCmd.NAV_LAND, 254)),  # another operator's vehicle
    ],
)
def test_messages_of_no_second_ground_station_are_not_reported(system: int, message: Message) -> None:
    heard = stations()
    heard.take(frame(system, message))
    assert not heard.news


def test_answers_to_a_station_forwarded_by_us_are_not_reported() -> None:
    heard = stations(11)
    heard.take(frame(11, ack(MavCmd.NAV_LAND, 254), 1))
    assert not heard.news
    heard.take(frame(12, ack(MavCmd.NAV_LAND, 254), 1))
    assert len(heard.news) == 1


def test_a_flood_of_numbers_is_told_within_bounds() -> None:
    heard = stations()
    for system in range(20, 250):
        heard.take(frame(system, QGROUNDCONTROL))
    assert len(heard.news) == 16


def test_our_own_ids_are_ours_and_a_heartbeat_that_we_do_not_send_is_not() -> None:
    rejected: Counter[str] = Counter()
    assert speaks_as_we(frame(255, OUR_HEARTBEAT), US, rejected) and not rejected  # a radio's echo
    assert speaks_as_we(frame(255, ack(MavCmd.NAV_LAND, 11)), US, rejected) and not rejected
    assert speaks_as_we(frame(255, QGROUNDCONTROL), US, rejected) and rejected == {"own_id": 1}
    assert not speaks_as_we(frame(254, QGROUNDCONTROL), US, rejected)
    assert not speaks_as_we(frame(255, QGROUNDCONTROL, 1), US, rejected)


S = 1_000_000_000


def test_an_answer_under_our_ids_to_an_order_that_we_never_gave_is_noticed_once() -> None:
    given = GivenOrders(forwards=False)
    given.note(20 * S, command_to(11, MavCmd.DO_SET_MODE))
    given.note(31 * S, OUR_HEARTBEAT)
    assert given.is_foreign(31 * S, MavCmd.NAV_TAKEOFF)
    assert not given.is_foreign(32 * S, MavCmd.NAV_TAKEOFF)


@pytest.mark.parametrize(
    ("at_s", "command"),
    [
        (29, MavCmd.DO_SET_MODE),  # late, as through a slow radio
        (19, MavCmd.NAV_TAKEOFF),  # of the driver before this one
        (31, MavCmd.REQUEST_MESSAGE),  # every station asks
        (31, MavCmd.NAV_LAND),  # the supervisor's, while this driver hung
    ],
)
def test_an_answer_that_may_be_ours_is_not(at_s: int, command: int) -> None:
    given = GivenOrders(forwards=False)
    given.note(10 * S, OUR_HEARTBEAT)
    given.note(20 * S, command_to(11, MavCmd.DO_SET_MODE))
    assert not given.is_foreign(at_s * S, command)


def test_answers_to_a_station_that_we_forward_are_expected() -> None:
    given = GivenOrders(forwards=True)
    given.note(10 * S, OUR_HEARTBEAT)
    assert not given.is_foreign(40 * S, MavCmd.NAV_TAKEOFF)


@pytest.mark.parametrize(("component", "reported"), [(190, True), (230, False)])
def test_only_an_answer_to_us_answers_our_request(rig_of, component: int, reported: bool) -> None:
    rig = rig_of("px4").connect()
    rig.vehicle._requests.ask(rig.hand.now, "land", MavCmd.NAV_LAND)
    rig.link.send = lambda system, message: None
    rig.run(0.1)
    rig.emulator._send_to_all(ack(MavCmd.NAV_LAND, 255, component))
    rig.run(0.1)
    assert ("land" in rig.vehicle._requests.accepted) == reported


def test_the_driver_names_an_order_of_a_station_with_our_ids(rig_of) -> None:
    rig = rig_of("px4").connect().run(10.0)
    rig.emulator._send_to_all(ack(MavCmd.DO_REPOSITION, 255))
    rig.run(0.1)
    assert [text for text in rig.texts if "not ours" in text]
    rig.take_off()
    assert len([text for text in rig.texts if "not ours" in text]) == 1
