"""Flights of the kit: their type, their list, and how one is flown."""

import os
from collections.abc import Callable
from dataclasses import dataclass, replace

from groundstation.field.drones import DroneLimits
from sim_bridge.conformance.bench import Bench, FlightFailed
from sim_bridge.conformance.record import Record
from sim_bridge.conformance.subject import LIMITS, Subject
from sim_bridge.fault_kinds import Fault

_TRIES = 3
_STOOD_MS = 150.0


@dataclass(frozen=True, slots=True)
class Script:
    """One flight: its script, the faults of the vehicle's reports in it, and the limits of its field file."""

    name: str
    run: Callable[[Bench], None]
    faults: tuple[Fault, ...] = ()
    limits: DroneLimits = LIMITS


SCRIPTS: dict[str, Script] = {}


def script(
    *faults: Fault, limits: DroneLimits = LIMITS
) -> Callable[[Callable[[Bench], None]], Callable[[Bench], None]]:
    """Return a decorator that adds a flight to the list, under its function's name."""

    def added(run: Callable[[Bench], None]) -> Callable[[Bench], None]:
        name = run.__name__.removeprefix("_")
        SCRIPTS[name] = Script(name, run, faults, limits)
        return run

    return added


def fly(script: Script, subject: Subject, damaged: int) -> Record:
    """Return the record of a flight; one in which this machine stood still is flown again, three times at most.

    damaged: number of datagrams to damage in all.
    """
    record = Record()
    for _ in range(_TRIES):
        try:
            bench = Bench(replace(subject, limits=script.limits), script.faults)
        except OSError as error:
            return Record(failure=f"the room could not be opened: {error}")
        record = bench.record
        record.facts["damaged"] = damaged
        with bench:
            try:
                script.run(bench)
            except FlightFailed as error:
                record.failure = str(error)
        record.load = os.getloadavg()[0] / len(os.sched_getaffinity(0))
        if record.failure:
            record.failure += record.burden
        if record.stood_ms <= _STOOD_MS:
            return record
    record.failure = f"this machine stood still for {record.stood_ms:.0f} ms in each of {_TRIES} flights: not judged"
    record.marks.clear()
    return record
