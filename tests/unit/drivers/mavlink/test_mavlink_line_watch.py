"""A serial line that loses what is sent is reported once for each spell."""

from drivers.mavlink.line_watch import LineWatch

S = 1_000_000_000


def texts(watch, now_s, **counts):
    return [text for text, _ in watch.news(now_s * S, counts)]


def test_a_line_that_loses_nothing_and_one_loss_are_no_news():
    watch = LineWatch()
    assert texts(watch, 0) == [] and texts(watch, 1, send_dropped=1, truncated=90) == []
    assert texts(watch, 20, send_dropped=9) == texts(watch, 40, send_dropped=18) == []


def test_each_spell_is_told_once():
    watch, told = LineWatch(), []
    for now_s in range(60):
        told += texts(watch, now_s, send_dropped=10 * now_s)
    assert told == ["the serial line carries less than is sent: poses and setpoints are left out"]
    assert texts(watch, 65, send_dropped=595) == [] and len(texts(watch, 80, send_dropped=700)) == 1


def test_a_device_that_takes_nothing_has_its_own_words():
    assert texts(LineWatch(), 0, send_failed=50) == ["the serial device takes nothing"]
