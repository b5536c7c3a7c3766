"""Asks kinds for what their vehicles fly by, and refuses an answer that would first fail in an emergency."""

from collections.abc import Iterator, Sequence
from typing import Any

from groundstation.errors import SettingsError
from groundstation.vehicles.kind import DriverProcess, StopDatagrams, VehicleKind, VehicleOrder
from groundstation.vehicles.registry import ask

MOST_BYTES = 1472
"""Longest datagram that fits into one packet."""


def processes_of(kind: VehicleKind, orders: Sequence[VehicleOrder]) -> list[DriverProcess]:
    """Return a kind's driver processes for some vehicles; raises SettingsError."""
    processes = ask(kind, "processes", orders)
    if not isinstance(processes, list | tuple) or not all(isinstance(one, DriverProcess) for one in processes):
        raise _refusal(kind, "processes", [f"must be a list of DriverProcess (got {processes!r:.60})"])
    given, flown = (sorted(names) for names in ((o.name for o in orders), (n for p in processes for n in p.vehicles)))
    if given != flown:
        raise _refusal(kind, "processes", [f"must fly each of {', '.join(given)} once (got {', '.join(flown)})"])
    return list(processes)


def stop_of(kind: VehicleKind, orders: Sequence[VehicleOrder]) -> StopDatagrams:
    """Return a kind's stop datagrams to the vehicles of one driver process; raises SettingsError."""
    stop = ask(kind, "stop", orders)
    if not isinstance(stop, StopDatagrams):
        raise _refusal(kind, "stop", [f"must return StopDatagrams (got {type(stop).__name__})"])
    if faults := list(_faults(stop)):
        raise _refusal(kind, "stop", faults)
    return stop


def _faults(stop: Any) -> Iterator[str]:
    # Types too: Python takes any in a dataclass, and a text in place of bytes fails only when it is sent.
    if not isinstance(stop.port, int) or not 0 < stop.port < 65536:
        yield f"port must be a whole number from 1 to 65535 (got {stop.port!r})"
    for name, datagram in (("hover", stop.hover), ("land", stop.land)):
        if not isinstance(datagram, bytes) or not datagram:
            yield f"{name} must be bytes, and not empty (got {datagram!r:.60})"
        elif not stop.transport and len(datagram) > MOST_BYTES:
            yield f"{name} must have {MOST_BYTES} bytes at most (got {len(datagram)})"
    for name, text in (("transport", stop.transport), ("way", stop.way)):
        if not isinstance(text, str):
            yield f"{name} must be text (got {text!r:.60})"
    if isinstance(stop.transport, str) and stop.transport and ":" not in stop.transport:
        yield f'transport must be "module:function" (got {stop.transport!r:.60})'
    if not isinstance(stop.called, bool):
        yield f"called must be True or False (got {stop.called!r:.60})"
    if not isinstance(stop.hovers_s, int | float) or not stop.hovers_s >= 0.0:
        yield f"hovers_s must be a number of seconds, 0 or more (got {stop.hovers_s!r:.60})"


def _refusal(kind: VehicleKind, part: str, faults: Sequence[str]) -> SettingsError:
    return SettingsError([f"kind: {kind.name}: {part}: {fault}" for fault in faults])
