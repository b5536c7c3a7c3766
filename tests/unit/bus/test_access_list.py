"""Rights to publish and subscribe: from the table of topics to the router's configuration."""

import re

import pytest

from groundstation.bus import keys
from groundstation.bus.access import AccessList, access_control, audible, publishable
from groundstation.bus.roles import SHELLS, Member, Role
from groundstation.bus.topics import (
    COMMAND,
    EVENT,
    LEASE,
    OBSERVATION,
    ODOMETRY,
    REPORTED_MOTION,
    SETPOINT,
    TOPICS,
    TRUTH,
    Plane,
    Topic,
)

DRIVER = Member("drone_1", Role.DRIVER, ("drone_1",), ("drone_1", "drone_2"))
TRACKER = Member("tracker", Role.TRACKER, ("tracker",))


def covers(expressions: list[str], key: str) -> bool:
    """Return whether a concrete key lies within one of the expressions, as Zenoh matches them."""

    def pattern(chunk: str) -> str:
        return "[^/@]+" if chunk == "*" else re.escape(chunk).replace(r"\$\*", "[^/]*")

    def matches(expression: str) -> bool:
        chunks = expression.split("/")
        tail = "(/[^/@]+)*" if chunks[-1] == "**" else ""
        return bool(re.fullmatch("/".join(map(pattern, chunks[:-1] if tail else chunks)) + tail, key))

    return any(map(matches, expressions))


def may(member: Member, topic: Topic, entity: str, source: str) -> bool:
    return covers(publishable("lab", member), keys.expression("lab", topic, entity, source))


def test_a_driver_speaks_of_its_own_vehicles_and_as_itself_only() -> None:
    assert may(DRIVER, ODOMETRY, "drone_1", "drone_1") and may(DRIVER, ODOMETRY, "drone_2", "drone_1")
    assert not may(DRIVER, ODOMETRY, "drone_3", "drone_1")
    assert not may(DRIVER, ODOMETRY, "drone_1", "drone_2")
    assert may(DRIVER, EVENT, "anything", "drone_1")
    for topic in (SETPOINT, LEASE, COMMAND):
        assert not may(DRIVER, topic, "drone_1", "drone_1")


def test_a_target_speaks_of_its_own_motion_and_nothing_else() -> None:
    target = Member("turtlebot_odometry", Role.TARGET, ("turtlebot_odometry",), ("turtlebot", "turtlebot_odometry"))
    assert may(target, REPORTED_MOTION, "turtlebot", "turtlebot_odometry")
    assert not may(target, REPORTED_MOTION, "rover", "turtlebot_odometry")
    assert not may(target, REPORTED_MOTION, "turtlebot", "rover_odometry")
    for topic in (ODOMETRY, OBSERVATION, SETPOINT, COMMAND):
        assert not may(target, topic, "turtlebot", "turtlebot_odometry")
    camera = Member("ceiling", Role.CAMERA, ("ceiling",), ("turtlebot",))
    assert not may(camera, REPORTED_MOTION, "turtlebot", "ceiling")


@pytest.mark.parametrize("topic", [SETPOINT, LEASE])
def test_topics_that_move_a_drone_have_one_sender(topic: Topic) -> None:
    assert len(topic.senders) == 1


def test_views_say_nothing_and_shells_order_under_their_own_names() -> None:
    cli, console, view = SHELLS
    assert publishable("lab", view) == []
    assert may(cli, COMMAND, "team", "cli_4711") and may(cli, COMMAND, "team", "deadman_1")
    assert not may(cli, COMMAND, "team", "supervisor") and not may(cli, COMMAND, "team", "console_1")
    assert may(console, COMMAND, "operator", "console_1") and not may(console, LEASE, "team", "console_1")


def test_truth_is_for_witnesses_only() -> None:
    key = keys.expression("lab", TRUTH, "drone_1", "sim_bridge")
    deaf = {role for role in Role if not covers(audible("lab", role), key)}
    devices = {Role.DRIVER, Role.CAMERA, Role.TARGET}
    assert deaf == devices | {Role.SUPERVISOR, Role.TRACKER, Role.DIAGNOSIS, Role.CLI, Role.LIAISON, Role.HOST}


def test_each_topic_that_is_spoken_of_has_a_sender() -> None:
    assert [topic.name for topic in TOPICS.values() if not topic.senders] == []


def test_the_router_denies_all_that_is_not_listed() -> None:
    section = access_control(AccessList("lab", (DRIVER, TRACKER, *SHELLS)))
    assert section["default_permission"] == "deny"
    rules = {rule["id"]: rule for rule in section["rules"]}
    assert all(rule["key_exprs"] and rule["permission"] == "allow" for rule in rules.values())
    for policy in section["policies"]:
        assert set(policy["rules"]) <= set(rules)
        assert all(rule.startswith(policy["subjects"][0]) for rule in policy["rules"])
    assert any(rule.startswith("view-shell") for rule in rules)
    assert not any(rule.startswith("view-shell") and rule.endswith("say") for rule in rules)


def test_one_certificate_may_be_a_host_and_its_devices() -> None:
    members = [Member("host-pc", *rest) for rest in ((Role.HOST, ("pc",)), (Role.CAMERA, ("west",), ("west",)))]
    section = access_control(AccessList("lab", tuple(members)))
    assert section["subjects"] == [{"id": "host-pc", "cert_common_names": ["host-pc"]}]
    (policy,) = section["policies"]
    assert policy["rules"] == [rule["id"] for rule in section["rules"]] and len(set(policy["rules"])) == 8


def test_the_expression_of_a_plane_leaves_the_other_planes_out() -> None:
    production = [keys.plane_expression("lab", Plane.PRODUCTION)]
    for topic in TOPICS.values():
        assert covers(production, keys.expression("lab", topic, "a", "b")) is (topic.plane is Plane.PRODUCTION)
