"""Nanoseconds, the unit of all stamps."""

NS_PER_S = 1_000_000_000
NS_PER_MS = 1_000_000
NEVER_NS = 1 << 62
