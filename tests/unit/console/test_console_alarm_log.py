"""The log of past alarms: start and end; a flickering alarm, or one whose figures change, is one entry."""

from groundstation.console.alarm_log import AlarmLog
from groundstation.monitor.alarm import Alarm

S = 1_000_000_000


def test_an_alarm_is_logged_when_it_ends_with_its_last_words_and_its_times() -> None:
    log = AlarmLog()
    for second in range(1, 4):
        log.note([Alarm("drone_1 silent", f"drone_1: nothing heard for {second} s")], second * S)
        assert log.as_json() == []
    log.note([], 4 * S)
    (past,) = log.as_json()
    assert past == {"text": "drone_1: nothing heard for 3 s", "asks": False, "began": 1000.0, "ended": 4000.0}
    log.note([], 20 * S)
    assert log.as_json() == [past]


def test_a_flickering_alarm_is_one_entry_that_still_asks() -> None:
    log = AlarmLog()
    log.note([Alarm("drone_1 link", "drone_1: weak link, 29%", advice="To do: LAND it.")], 1 * S)
    log.note([], 2 * S)
    log.note([Alarm("drone_1 link", "drone_1: weak link, 59%", grave=False)], 3 * S)
    assert log.as_json() == []
    log.note([], 4 * S)
    assert [(past["began"], past["ended"], past["asks"]) for past in log.as_json()] == [(1000.0, 4000.0, True)]


def test_a_later_recurrence_is_another_alarm_and_newest_come_first() -> None:
    log, lost = AlarmLog(), Alarm("turtlebot lost", "turtlebot: not seen for 3 s", grave=False)
    for second, standing in ((1, [lost]), (2, []), (5, [lost]), (6, [])):
        log.note(standing, second * S)
    assert [past["began"] for past in log.as_json()] == [5000.0, 1000.0]


def test_only_the_newest_fifty_are_kept() -> None:
    log = AlarmLog()
    for second in range(120):
        log.note([Alarm(f"alarm {second}", f"alarm {second}")], second * S)
    assert [past["text"] for past in log.as_json()][:2] == ["alarm 118", "alarm 117"]
    assert len(log.as_json()) == 49  # and the one that lasts
