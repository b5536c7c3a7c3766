"""Rates, by key, at which a process receives samples that it only shows."""

from collections.abc import Iterable, Mapping

from groundstation.bus import keys
from groundstation.bus.topics import Topic


def rates_by_key(site: str, often: Iterable[tuple[Topic, Iterable[str], float]]) -> Mapping[str, float]:
    """Return samples a second [Hz] by key, from rows of topic, entities and rate: a rule of several keys shares one."""
    return {keys.expression(site, topic, name): rate_hz for topic, names, rate_hz in often for name in names}
