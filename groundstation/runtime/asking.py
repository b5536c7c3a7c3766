"""Commands that a page or a shell gives to the team, and how long their answers may take."""

from msgspec import structs

from groundstation.bus.api import Bus, Received
from groundstation.bus.messages import OPERATOR, Command, Verb
from groundstation.time_units import NS_PER_S

TEAM = "team"
# A start that has not arrived by then is dropped: executed later, it would surprise people.
START_LIVES_NS = 5 * NS_PER_S
_PATIENCE_S = {Verb.LAND: 20.0, Verb.TAKEOFF: 60.0, Verb.TRACK: 8.0, Verb.RESUME: 8.0}
_PATIENCE_DEFAULT_S = 5.0


def patience_s(verb: Verb) -> float:
    """Return how long to wait until all drones have done it [s]; after that it is not confirmed."""
    return _PATIENCE_S.get(verb, _PATIENCE_DEFAULT_S)


def command_of(
    bus: Bus, verb: Verb, drones: tuple[str, ...], number: int, anyway: bool = False, viewer: str = ""
) -> Command:
    """Return a command to drones (none: all), stamped now.

    A stop goes to the drones at once and never expires; a start goes to the operator, who holds the lease. number:
    distinguishes commands with one stamp; anyway: take off although the checks forbid it; viewer: the person at a
    console who gave it.
    """
    stop = verb.stops
    header = bus.header(TEAM if stop else OPERATOR)
    return Command(
        header=header,
        id=f"{bus.source}-{header.stamp_ns}-{number}",
        verb=verb,
        scope=drones if stop else (OPERATOR, *drones),
        issuer=f"{bus.source} ({viewer})" if anyway and viewer else bus.source,
        expires_ns=0 if stop else header.stamp_ns + START_LIVES_NS,
        run=bus.run,
        anyway=anyway,
    )


def by_clock_of(lease: Received, start: Command) -> Command:
    """Return a start of this host, stamped on the clock of a lease that was received here from the run's host.

    The stamp is early by the time that the lease was on its way, so no start passes for younger than it is.
    """
    shift_ns = lease.header.stamp_ns - lease.arrived_ns
    stamp_ns = start.header.stamp_ns + shift_ns
    header = structs.replace(start.header, stamp_ns=stamp_ns, clock=lease.header.clock)
    return structs.replace(start, header=header, expires_ns=start.expires_ns + shift_ns)
