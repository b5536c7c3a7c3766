"""Delayed messages arrive in the order of their due times, and once; at equal times in the order of sending."""

from sim_bridge.study.delay_queue import DelayQueue


def test_due_messages_come_in_order_and_once() -> None:
    queue = DelayQueue[str]()
    for due_ns, item in ((30, "late"), (10, "early"), (20, "first of two"), (20, "second of two"), (31, "later")):
        queue.send(due_ns, item)
    assert list(queue.due(9)) == []
    assert list(queue.due(30)) == ["early", "first of two", "second of two", "late"]
    assert list(queue.due(30)) == []
    assert list(queue.due(31)) == ["later"]


def test_things_that_cannot_be_compared_may_be_due_at_one_time() -> None:
    queue = DelayQueue[object]()
    things = [object() for _ in range(5)]
    for thing in things:
        queue.send(1, thing)
    assert list(queue.due(1)) == things
