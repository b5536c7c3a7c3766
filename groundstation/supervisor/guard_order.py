"""The guardian's order: the slots of the heartbeat block that it watches, and the datagrams for their drones."""

from dataclasses import replace

import msgspec

from groundstation.supervisor.process_spec import FailsafeDatagrams, ProcessSpec, slot_of
from groundstation.supervisor.process_table import GUARDIAN

_MARGIN_S = 3.0


class Post(msgspec.Struct, frozen=True):
    """One guarded driver: its name, its slot in the heartbeat block, the datagrams for its drone."""

    name: str
    slot: int
    words: FailsafeDatagrams


class GuardOrder(msgspec.Struct, frozen=True):
    """The guardian's section; landing_s: how long LAND is sent before it may end, the time of a descent from 3 m."""

    posts: tuple[Post, ...]
    landing_s: float = 10.0


def guarded(table: tuple[ProcessSpec, ...]) -> tuple[ProcessSpec, ...]:
    """Return the table with a guardian ahead, if there is a drone."""
    posts = tuple(
        Post(spec.name, slot_of(index), spec.failsafe_datagrams)
        for index, spec in enumerate(table, start=1)
        if spec.failsafe_datagrams is not None
    )
    if not posts:
        return table
    order = GuardOrder(posts)
    # If its driver died during the stop, a drone is commanded to hover, and then to land, before the guardian ends.
    stop_limit_s = max(post.words.land_after_s for post in posts) + order.landing_s + _MARGIN_S
    section = msgspec.json.encode(order).decode()
    return (replace(GUARDIAN, section=section, stop_limit_s=stop_limit_s), *table)
