"""Each tick of a recording finds its inputs, whatever stamps the messages carry."""

from collections.abc import Iterator

import pytest

from groundstation.bus import codec, keys
from groundstation.bus.messages import Header, ImuSample, JournalEntry, Message
from groundstation.bus.topics import IMU, JOURNAL, Topic
from groundstation.recording.chunks import RawRecord
from groundstation.replay.tick_log import Tape
from groundstation.time_units import NS_PER_MS, NS_PER_S

START_NS = 1_000 * NS_PER_S


def record(topic: Topic, message: Message) -> RawRecord:
    header = message.header
    key = keys.parse(keys.expression("lab", topic, header.entity, header.source))
    return RawRecord(key, header.stamp_ns, header.stamp_ns, header.seq, codec.encode(message))


def imu(robot: str, stamp_ns: int, seq: int) -> RawRecord:
    header = Header(stamp_ns, "here", robot, robot, seq)
    return record(
        IMU, ImuSample(header=header, angular_velocity_rad_s=(0.0, 0.0, 0.0), specific_force_m_s2=(0.0, 0.0, 9.8))
    )


def journal(tick: int, ingested: tuple[tuple[str, int], ...]) -> RawRecord:
    now_ns = START_NS + 20 * tick * NS_PER_MS
    header = Header(now_ns, "here", "team", "tracker", tick)
    return record(JOURNAL, JournalEntry(header=header, tick=tick, now_ns=now_ns, ingested=ingested))


def test_an_input_that_is_stamped_seconds_ahead_costs_no_other_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    late, ahead = imu("drone_1", START_NS - NS_PER_MS, 7), imu("drone_2", START_NS + 5 * NS_PER_S, 3)
    names = ((str(late.key), 7), (str(ahead.key), 3))
    # The recorder receives one sender a little later than the tracker, whose journal names both already.
    rows = [journal(0, names), ahead, late, *(journal(tick, ()) for tick in range(1, 200))]

    def records(_tape: Tape) -> Iterator[RawRecord]:
        yield from rows

    monkeypatch.setattr(Tape, "_records", records)
    ticks = list(Tape(()).ticks())
    assert len(ticks) == 200 and not any(tick.missing for tick in ticks)
    assert [key for key, _ in ticks[0].inputs] == [key for key, _ in names]
