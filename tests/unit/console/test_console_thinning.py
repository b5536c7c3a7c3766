"""Input of the console: only messages more frequent than its display rate are thinned."""

from groundstation.bus import keys
from groundstation.bus.topics import COMMAND, COMMAND_ACK, ESTIMATE, SETPOINT, TRUTH
from groundstation.console.section import enough_hz
from groundstation.console.server import RATE_HZ


def test_motion_of_each_body_comes_a_little_more_often_than_it_is_looked_at() -> None:
    enough = enough_hz("lab", ("drone_1", "drone_2"), ("turtlebot",))
    thinned = [(SETPOINT, "drone_1"), (SETPOINT, "drone_2")]
    thinned += [(TRUTH, name) for name in ("drone_1", "drone_2", "turtlebot")]
    assert set(enough) == {keys.expression("lab", topic, name) for topic, name in thinned}
    assert all(RATE_HZ / 2 < rate_hz < RATE_HZ for rate_hz in enough.values())


def test_orders_and_estimates_are_not_thinned() -> None:
    enough = " ".join(enough_hz("lab", ("drone_1",), ("turtlebot",)))
    assert not any(f"/{topic.name}/" in enough for topic in (COMMAND, COMMAND_ACK, ESTIMATE))
