"""The guardian's launch specification: the rows of the process table that it stands in, and its time limit."""

import msgspec
import pytest
from dummy_table import spec

from groundstation.supervisor.guard_order import GuardOrder, guarded
from groundstation.supervisor.process_spec import FailsafeDatagrams, slot_of


def words(port: int, land_after_s: float) -> FailsafeDatagrams:
    return FailsafeDatagrams("127.0.0.1", port, b"hover", b"land", land_after_s)


def test_each_post_has_the_slot_of_its_driver_in_the_table_that_begins_with_the_guardian() -> None:
    rows = (
        spec("router", "idle"),
        spec("drone_1", "idle", failsafe_datagrams=words(1, 3.0)),
        spec("ceiling", "idle"),
        spec("drone_2", "idle", failsafe_datagrams=words(2, 0.5)),
    )
    table = guarded(rows)
    assert table[1:] == rows and table[0].name == "guardian"
    order = msgspec.json.decode(table[0].section, type=GuardOrder)
    assert [(post.name, post.slot) for post in order.posts] == [("drone_1", slot_of(2)), ("drone_2", slot_of(4))]
    assert [post.words for post in order.posts] == [words(1, 3.0), words(2, 0.5)]


def test_it_may_take_as_long_as_the_most_patient_drone_and_its_landing_and_three_seconds_more() -> None:
    guardian, *_ = guarded((spec("a", "idle", failsafe_datagrams=words(1, 3.0)),
                            spec("b", "idle", failsafe_datagrams=words(2, 0.5))))  # fmt: skip
    assert msgspec.json.decode(guardian.section, type=GuardOrder).landing_s == 10.0
    assert guardian.stop_limit_s == pytest.approx(3.0 + 10.0 + 3.0)


def test_where_nothing_flies_nobody_guards() -> None:
    rows = (spec("router", "idle"), spec("ceiling", "idle"))
    assert guarded(rows) == rows
