"""Every message passes the bus unchanged, and a message that contradicts its key is refused."""

import math
from functools import partial
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.bus import codec, keys, messages, topics
from groundstation.bus.messages import Header, Message, Odometry
from groundstation.errors import MessageError

HEADER = Header(1_000, "boot", "drone_1", "ardrone_drone_1", 7)
TYPED = [topic for topic in topics.TOPICS.values() if topic.type is not None]


def odometry(**changes: Any) -> Odometry:
    values: dict[str, Any] = {
        "header": HEADER,
        "velocity_m_s": (0.1, -0.2, 0.0),
        "velocity_covariance": (0.01,) * 9,
        "yaw_rad": 0.3,
        "roll_rad": 0.0,
        "pitch_rad": 0.01,
    }
    return Odometry(**{**values, **changes})


def key_of(topic: topics.Topic) -> keys.Key:
    return keys.Key("lab", HEADER.entity, topic, HEADER.source)


@pytest.mark.parametrize("topic", topics.TOPICS.values(), ids=lambda topic: f"{topic.plane}{topic.name}")
def test_every_key_parses_to_itself(topic: topics.Topic) -> None:
    key = key_of(topic)
    assert keys.parse(str(key)) == key


def test_truth_and_simulator_keys_match_no_production_pattern() -> None:
    for topic in topics.TOPICS.values():
        assert ("@" in str(key_of(topic)).removeprefix("gs/@v1")) == bool(topic.plane)


@pytest.mark.parametrize("topic", TYPED, ids=lambda topic: f"{topic.plane}{topic.name}")
def test_every_message_type_has_a_schema_and_requires_a_header(topic: topics.Topic) -> None:
    assert topic.type is not None
    definition = msgspec.json.schema(topic.type)["$defs"][topic.type.__name__]
    assert "header" in definition["required"]


def test_round_trip() -> None:
    message = odometry(height_m=1.5)
    assert codec.decode(key_of(topics.ODOMETRY), codec.encode(message)) == message


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_not_finite_cannot_be_built(value: float) -> None:
    with pytest.raises(ValueError, match="velocity_m_s is not finite"):
        odometry(velocity_m_s=(0.0, value, 0.0))


def test_a_covariance_of_the_wrong_size_cannot_be_built() -> None:
    with pytest.raises(ValueError, match="velocity_covariance has 3 entries"):
        odometry(velocity_covariance=(1.0, 1.0, 1.0))


@pytest.mark.parametrize(
    "wrong", [{"columns": 4}, {"columns": 0}, {"chances": ()}, {"cell_m": 0.0}, {"chances": (0, 256, 1)}]
)
def test_a_search_map_without_whole_rows_is_refused(wrong: dict[str, Any]) -> None:
    values: dict[str, Any] = {"header": HEADER, "first_m": (0.0, 0.0), "cell_m": 0.5, "columns": 3}
    right = codec.encode(messages.SearchMap(**values, chances=(0, 255, 40, 0, 10, 0)))
    with pytest.raises(MessageError, match="chances") as caught:
        codec.decode(key_of(topics.SEARCH_MAP), msgspec.json.encode(msgspec.json.decode(right) | wrong))
    assert caught.value.reason == "malformed"


@pytest.mark.parametrize("number", [b"1e999", b"null", b"NaN", b'"1"', b"[1]"])
def test_a_bad_number_on_the_wire_is_refused_by_name(number: bytes) -> None:
    payload = codec.encode(odometry()).replace(b"0.3", number)
    with pytest.raises(MessageError) as caught:
        codec.decode(key_of(topics.ODOMETRY), payload)
    assert caught.value.reason == "malformed"


@pytest.mark.parametrize("entity, source", [("drone_2", HEADER.source), ("drone_1", "someone_else")])
def test_a_header_that_contradicts_its_key_is_refused(entity: str, source: str) -> None:
    with pytest.raises(MessageError) as caught:
        codec.decode(keys.Key("lab", entity, topics.ODOMETRY, source), codec.encode(odometry()))
    assert caught.value.reason == "header_mismatch"


@pytest.mark.parametrize(
    "text, reason",
    [
        ("gs/@v1/lab/*/odometry/ardrone", "wildcard_key"),
        ("gs/@v1/lab/**", "wildcard_key"),
        ("gs/@v2/lab/drone_1/odometry/x", "foreign_key"),
        ("gs/@v1/lab/odometry", "foreign_key"),
        ("", "foreign_key"),
        ("gs/@v1/lab/drone_1/nonsense/x", "unknown_topic"),
        ("gs/@v1/lab/@other/drone_1/odometry/x", "unknown_topic"),
        ("gs/@v1/lab/@truth/drone_1/odometry/x", "unknown_topic"),
        ("gs/@v1/lab//odometry/x", "foreign_key"),
        ("gs/@v1/lab/drone_1/odometry/", "foreign_key"),
        ("gs/@v1/lab/drone_1/odometry/\x1b[2J", "foreign_key"),
    ],
)
def test_a_foreign_key_is_refused_by_name(text: str, reason: str) -> None:
    with pytest.raises(MessageError) as caught:
        keys.parse(text)
    assert caught.value.reason == reason


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=200))
def test_garbage_raises_nothing_but_a_message_error(payload: bytes) -> None:
    for topic in (topics.ODOMETRY, topics.PLAN, topics.COMMAND):
        with pytest.raises(MessageError):
            codec.decode(key_of(topic), payload)


@settings(max_examples=100, deadline=None)
@given(st.data())
def test_every_prefix_of_a_message_is_refused(data: st.DataObject) -> None:
    payload = codec.encode(odometry())
    cut = data.draw(st.integers(0, len(payload) - 1))
    with pytest.raises(MessageError):
        codec.decode(key_of(topics.ODOMETRY), payload[:cut])


_DEEP = b'{"x":' + b"[" * 100_000 + b"]" * 100_000 + b"}"


@pytest.mark.parametrize("payload", [_DEEP, _DEEP[:1000], b'{"header":' + _DEEP, b"[" * 100_000])
def test_nesting_without_end_is_refused_in_messages_and_in_attachments(payload: bytes) -> None:
    for topic in (topics.ODOMETRY, topics.IMAGE):
        decode = codec.decode if topic.type else codec.decode_header
        with pytest.raises(MessageError) as caught:
            decode(key_of(topic), payload)
        assert caught.value.reason == "malformed"


@pytest.mark.parametrize("number", [2**63, -(2**63) - 1, 10**30])
def test_whole_numbers_beyond_64_bits_are_refused(number: int) -> None:
    text = codec.encode(odometry()).decode()
    for field in (f'"stamp_ns":{HEADER.stamp_ns}', f'"seq":{HEADER.seq}'):
        assert field in text
        wrong = text.replace(field, f"{field.partition(':')[0]}:{number}").encode()
        with pytest.raises(MessageError):
            codec.decode(key_of(topics.ODOMETRY), wrong)
    attachment = codec.encode(HEADER).replace(str(HEADER.stamp_ns).encode(), str(number).encode(), 1)
    with pytest.raises(MessageError):
        codec.decode_header(key_of(topics.IMAGE), attachment)
    with pytest.raises(ValueError, match="rejected is not finite"):
        messages.VehicleStatus(
            header=HEADER, flight_state=messages.FlightState.LANDED, mode="", rejected={"replayed": 2**64}
        )


@pytest.mark.parametrize("number", [2**63, -(2**63) - 1])
def test_a_whole_number_beyond_64_bits_is_found_among_many(number: int) -> None:
    map_of = partial(messages.SearchMap, header=HEADER, first_m=(0.0, 0.0), cell_m=0.25, columns=3)
    assert map_of(chances=(0, 255, 7)).chances == (0, 255, 7)
    with pytest.raises(ValueError, match="chances is not finite"):
        map_of(chances=(0, number, 7))


def test_a_number_that_is_not_finite_is_found_inside_nested_parts() -> None:
    alternative = messages.PoseHypothesis((0.0, 0.0, math.inf), None, (1.0,) * 9)
    with pytest.raises(ValueError, match="alternative is not finite"):
        messages.RelativeObservation(
            header=HEADER,
            observer="drone_1",
            subject="turtlebot",
            camera="front",
            position_m=(0.0, 0.0, 1.0),
            yaw_rad=None,
            covariance=(1.0,) * 9,
            alternative=alternative,
        )


def test_messages_are_frozen() -> None:
    with pytest.raises(AttributeError):
        odometry().yaw_rad = 1.0  # type: ignore[misc]


def test_every_message_type_is_on_the_bus() -> None:
    on_the_bus = {topic.type for topic in TYPED}
    defined = {
        value
        for value in vars(messages).values()
        if isinstance(value, type) and issubclass(value, Message) and value is not Message
    }
    assert defined == on_the_bus
