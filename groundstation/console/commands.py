"""Commands of the page: sent as by the command line, repeated until acknowledged, followed until confirmed."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

from groundstation.bus.api import Bus
from groundstation.bus.messages import OPERATOR, AckStage, Command, CommandAck, Lease, Verb
from groundstation.bus.topics import COMMAND
from groundstation.runtime.acknowledgements import AwaitedAnswers
from groundstation.runtime.asking import command_of, patience_s
from groundstation.time_units import NS_PER_MS, NS_PER_S

# An order that waited in a page without connection, or in a frozen server's queue, must not be executed late.
_START_LIVES_MS = 2000.0
_STOP_LIVES_MS = 5000.0
# Number of followed commands: newer ones displace first those that need no repetition, the others only in a flood.
_KEPT, _MOST = 8, 32
_NOBODY: Mapping[str, str] = MappingProxyType({})


@dataclass(slots=True)
class Followed:
    """One command on the bus, with its answers; `by`: the viewer who gave it; `ref`: the id from that viewer's page.

    instead: the reported activity, at the time-out, of each drone that has not done it.
    """

    book: AwaitedAnswers
    given_ns: int
    repeated_ns: int = 0
    by: str = ""
    ref: str = ""
    closed: bool = False
    instead: dict[str, str] = field(default_factory=dict)

    @property
    def is_repeated(self) -> bool:
        """Return whether it was given here and still awaits an answer."""
        return bool(self.by) and not self.closed


@dataclass(frozen=True, slots=True)
class Given:
    """How a page gave a command: which viewer, how long ago, its own id of it, and whether against the checks."""

    by: str
    age_ms: float = 0.0
    ref: str = ""
    anyway: bool = False


class CommandDesk:
    """Sends commands, and follows these and those of all others.

    Stops go to the drones at once. Starts go to the run's operator, who holds the lease and takes off one by one.
    """

    def __init__(self, bus: Bus, drones: tuple[str, ...]) -> None:
        self._bus = bus
        self._drones = drones
        self._orders: dict[str, Followed] = {}
        # An answer may overtake its command: they come from different senders.
        self._early: dict[str, list[CommandAck]] = {}
        self._lease: Lease | None = None
        self._count = 0

    def hear_lease(self, lease: Lease) -> None:
        """Remember who holds the lease."""
        self._lease = lease

    def lease_holder(self, now_ns: int) -> str:
        """Return the holder of a live operator lease, or ""."""
        return self._lease.holder if self._lease is not None and self._lease.expires_ns > now_ns else ""

    def give(self, verb: Verb, drones: tuple[str, ...], given: Given, now_ns: int) -> str:
        """Send a command; returns "" or why it was not sent."""
        strangers = [name for name in drones if name not in self._drones]
        if strangers:
            return f"there is no drone {', '.join(strangers)}"
        if given.ref and any(order.ref == given.ref for order in self._orders.values()):
            return ""  # its page lost the connection before it saw the command accepted, and sent it again
        stop = verb.stops
        if given.age_ms > (_STOP_LIVES_MS if stop else _START_LIVES_MS):
            late = f"{verb} came too late ({given.age_ms / 1e3:.1f} s) and was dropped"
            return f"{late}: give it again if it is still wanted"
        if not stop and not self.lease_holder(now_ns):
            return "nobody holds the operator lease: is the ground station's main process alive?"
        self._count += 1
        command = command_of(self._bus, verb, drones, self._count, given.anyway, given.by)
        self._keep(Followed(self._book(command), now_ns, now_ns, given.by, given.ref))
        self._bus.publish(COMMAND, command)
        return ""

    def take(self, message: Command | CommandAck, now_ns: int) -> None:
        """Follow a command of any issuer, and every answer."""
        if isinstance(message, CommandAck):
            followed = self._orders.get(message.command_id)
            if followed is not None:
                followed.book.note(message)
            else:
                self._remember_early(message)
        elif message.id not in self._orders:
            followed = Followed(self._book(message), now_ns)
            for ack in self._early.pop(message.id, []):
                followed.book.note(ack)
            self._keep(followed)

    def step(self, now_ns: int, doing: Mapping[str, str] = _NOBODY) -> None:
        """Repeat unanswered commands; close settled and late ones. doing: the reported activity of each drone."""
        for order in self._orders.values():
            patience_ns = patience_s(order.book.command.verb) * NS_PER_S
            if not order.closed and now_ns - order.given_ns > patience_ns:
                late = (name for name, progress in order.book.progress.items() if not progress.settled)
                order.instead = {name: doing[name] for name in late if name in doing}
                order.closed = True
            order.closed = order.closed or order.book.settled
            due_ns = order.repeated_ns + order.book.repeat_after_s * NS_PER_S
            if order.is_repeated and now_ns > due_ns:
                order.repeated_ns = now_ns
                self._bus.publish(COMMAND, order.book.command)

    def summary(self) -> list[dict[str, Any]]:
        """Return the commands, newest first, each with its stage at each drone."""
        return [_summary(order) for order in reversed(self._orders.values())]

    def _book(self, command: Command) -> AwaitedAnswers:
        # The operator answers requests to it; drones answer for themselves.
        asked: Iterable[str] = (OPERATOR,) if OPERATOR in command.scope else command.scope or self._drones
        return AwaitedAnswers(command, tuple(asked))

    def _keep(self, followed: Followed) -> None:
        new = followed.book.command
        for identity, old in list(self._orders.items()):
            same = (old.book.command.issuer, old.book.command.verb, old.book.command.scope)
            if not old.by and same == (new.issuer, new.verb, new.scope):
                del self._orders[identity]  # a repetition by an issuer that uses new ids
        self._orders[followed.book.command.id] = followed
        self._make_room()

    def _make_room(self) -> None:
        spare = [identity for identity, order in self._orders.items() if not order.is_repeated]
        for identity in spare[: max(0, len(self._orders) - _KEPT)]:
            del self._orders[identity]
        while len(self._orders) > _MOST:
            del self._orders[next(iter(self._orders))]

    def _remember_early(self, ack: CommandAck) -> None:
        self._early.setdefault(ack.command_id, []).append(ack)
        while len(self._early) > _KEPT:
            del self._early[next(iter(self._early))]


def _summary(order: Followed) -> dict[str, Any]:
    book = order.book
    return {
        "id": book.command.id,
        "ref": order.ref,
        "verb": book.command.verb,
        "by": order.by or book.command.issuer,
        "team": not set(book.command.scope) - {OPERATOR},
        "given_ms": order.given_ns / NS_PER_MS,
        "closed": order.closed,
        "state": _state(order),
        "rows": [
            {"name": n, "stage": p.stage, "reason": p.reason, "instead": order.instead.get(n, "")}
            for n, p in book.progress.items()
        ],
    }


def _state(order: Followed) -> str:
    """Return sent, heard, confirmed, refused or not_confirmed: the state of the whole order."""
    book = order.book
    if book.confirmed:
        return "confirmed"
    if book.settled:
        return "refused"
    if order.closed:
        return "not_confirmed"
    return "sent" if book.unheard or any(p.stage is AckStage.REFUSED for p in book.progress.values()) else "heard"
