"""The monitor process of a run: draws on the supervisor's terminal, which it inherits.

Started as `groundstation.runtime.monitor:run`. `groundstation monitor` draws the same from another terminal.
"""

import msgspec

from groundstation.bus import clock
from groundstation.field.resolved import ResolvedField
from groundstation.monitor.screen import Screen
from groundstation.monitor.state import cast_from_field
from groundstation.process.child import Child
from groundstation.time_units import NS_PER_MS

# A third of the drawing period: the heartbeat needs 10 turns a second, the eye four pictures.
_PERIOD_NS = 84 * NS_PER_MS


class MonitorSection(msgspec.Struct, frozen=True):
    """The monitor's section: the resolved field."""

    field: ResolvedField


def run(child: Child) -> int:
    """Draw until asked to stop or until the supervisor is gone; always restores the terminal."""
    section = msgspec.json.decode(child.section, type=MonitorSection)
    cast = cast_from_field(section.field)
    with Screen(child.bus, cast, clock.now_ns(), hint="Ctrl-C lands all") as screen:
        child.ready()
        for ticks in child.turns(_PERIOD_NS):
            screen.turn(clock.now_ns())
            child.tick_status(ticks=ticks)
    return 0
