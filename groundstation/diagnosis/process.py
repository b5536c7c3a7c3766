"""The diagnosis process: finds wrong figures of the field in flight. No setpoint depends on it.

Started as `groundstation.diagnosis.process:run`. Numba, which the sensor models need, is imported only after the kernel
cache is chosen.
"""

import msgspec

from groundstation.bus import clock
from groundstation.field.resolved import ResolvedField
from groundstation.process import numba_cache
from groundstation.process.child import Child
from groundstation.time_units import NS_PER_MS

_PERIOD_NS = 100 * NS_PER_MS


class DiagnosisSection(msgspec.Struct, frozen=True):
    """The diagnosis's section: the resolved field."""

    field: ResolvedField


def run(child: Child) -> int:
    """Watch until asked to stop or until the supervisor is gone."""
    numba_cache.activate()
    from groundstation.diagnosis.judging import OnThread
    from groundstation.diagnosis.loop import Diagnosis

    section = msgspec.json.decode(child.section, type=DiagnosisSection)
    diagnosis = Diagnosis(child.bus, section.field, OnThread())
    child.ready()
    for ticks in child.turns(_PERIOD_NS):
        diagnosis.turn(clock.now_ns())
        for notice in diagnosis.notices:
            child.event(notice.severity, notice.text, notice.remedy, notice.entity or None)
        diagnosis.notices.clear()
        child.tick_status(ticks=ticks, overflowed=diagnosis.overflowed)
    return 0
