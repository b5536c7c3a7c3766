"""The access control of a run's router, from the table of topics: publishers and subscribers by role.

Zenoh's traps: a rule must include the whole expression that is declared or put, `**` does not match a chunk that
begins with `@`, and a publisher stays mute unless subscriptions may be passed on to it (docs/reference/zenoh.md 10).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from groundstation.bus import keys
from groundstation.bus.roles import DEVICES, WITNESSES, Member, Role
from groundstation.bus.topics import EVENT, PROCESS_STATUS, TOPICS, Plane, Topic

_ABOUT_OTHERS = frozenset({EVENT, PROCESS_STATUS})


@dataclass(frozen=True, slots=True)
class AccessList:
    """The access that a router grants: the site, and all members that may join."""

    site: str
    members: tuple[Member, ...]


def publishable(site: str, member: Member) -> list[str]:
    """Return the key expressions that a member may publish under."""
    return [
        keys.expression(site, topic, entity, source)
        for topic in TOPICS.values()
        if member.role in topic.senders
        for entity in _entities(topic, member)
        for source in member.sources
    ]


def audible(site: str, role: Role) -> list[str]:
    """Return the key expressions that a role may subscribe to."""
    planes = tuple(Plane) if role in WITNESSES else (Plane.PRODUCTION,)
    return [keys.plane_expression(site, plane) for plane in planes]


def access_control(access: AccessList) -> dict[str, Any]:
    """Return the section `access_control` of the router's configuration; anything not listed is denied."""
    rules, policies = [], dict[str, list[str]]()
    for member in access.members:
        granted = {
            "hear": (["ingress"], ["declare_subscriber"], audible(access.site, member.role)),
            "get": (["egress"], ["put"], audible(access.site, member.role)),
            "learn": (["egress"], ["declare_subscriber"], audible(access.site, Role.VIEW)),
            "say": (["ingress"], ["put"], publishable(access.site, member)),
        }
        identity = f"{member.name} {member.role} {member.sources[0]}"
        own = [_rule(f"{identity} {what}", *grant) for what, grant in granted.items() if grant[2]]
        rules += own
        policies.setdefault(member.name, []).extend(rule["id"] for rule in own)
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": name, "cert_common_names": [name]} for name in policies],
        "policies": [{"rules": named, "subjects": [name]} for name, named in policies.items()],
    }


def _rule(identity: str, flows: list[str], messages: list[str], expressions: Iterable[str]) -> dict[str, Any]:
    return {
        "id": identity,
        "permission": "allow",
        "flows": flows,
        "messages": messages,
        "key_exprs": list(expressions),
    }


def _entities(topic: Topic, member: Member) -> tuple[str, ...]:
    return member.entities if member.role in DEVICES and topic not in _ABOUT_OTHERS else ("*",)
