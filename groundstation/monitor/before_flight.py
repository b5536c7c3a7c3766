"""What forbids the first take-off, in the words of the events that told it. Pure."""

from collections.abc import Iterator

from groundstation.monitor.state import MonitorState

_MUST = "MUST"
# The list comes every 3 s; without its sender nobody knows whether it still holds.
_OLD_S = 10.0


def forbidding(state: MonitorState, now_ns: int) -> Iterator[tuple[str, str]]:
    """Yield each finding that forbids a take-off, with its remedy, until somebody flies."""
    if state.flown or state.preflight is None or state.preflight.age_s(now_ns) > _OLD_S:
        return
    checks = state.preflight.message
    for one in checks.findings:
        if one.level == _MUST:
            entity = one.subject if one.subject in state.cast.drones else checks.header.entity
            yield f"{entity}: before take-off: {one.subject}: {one.found}", one.remedy
