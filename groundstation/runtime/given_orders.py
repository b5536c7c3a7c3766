"""The orders that an operator gave and that are still followed, until they are confirmed or given up."""

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass

from groundstation.bus.api import Bus
from groundstation.bus.messages import OPERATOR, AckStage, Command, CommandAck, Verb
from groundstation.bus.topics import COMMAND
from groundstation.runtime.acknowledgements import AwaitedAnswers
from groundstation.runtime.asking import START_LIVES_NS, TEAM
from groundstation.runtime.requests import Requests, asked_ns
from groundstation.time_units import NS_PER_S

_CONFIRM_NS = {Verb.LAND: 20 * NS_PER_S, Verb.TAKEOFF: 20 * NS_PER_S}
_CONFIRM_DEFAULT_NS = 6 * NS_PER_S


@dataclass(slots=True)
class _Order:
    """An order that is still being followed, and the request of another shell that it answers."""

    book: AwaitedAnswers
    number: int
    given_ns: int
    repeated_ns: int
    request: Command | None = None


class GivenOrders:
    """Sends orders, repeats unanswered ones, and answers the requests of other shells that led to them.

    Call `follow` 10 times a second or more; `say` receives lines for the person.
    """

    def __init__(self, bus: Bus, requests: Requests, say: Callable[[str], None]) -> None:
        self._bus, self._requests, self._say = bus, requests, say
        self._orders: list[_Order] = []
        self._said: dict[str, str] = {}
        self._count = self._last_start = 0

    @property
    def lands_all(self) -> bool:
        """Return whether a LAND for the whole team is being followed that came after all that was started."""
        latest = (order.book.command for order in self._orders if order.number > self._last_start)
        return any(command.verb is Verb.LAND and not command.scope for command in latest)

    def give(
        self, verb: Verb, scope: tuple[str, ...], met: Iterable[str], now_ns: int, request: Command | None = None
    ) -> AwaitedAnswers:
        """Send an order to the drones of its scope (empty: all, of which those that were met must answer)."""
        self._count += 1
        header = self._bus.header(TEAM, asked_ns(request))
        command = Command(
            header=header,
            id=f"{OPERATOR}-{header.stamp_ns}-{self._count}",
            verb=verb,
            scope=scope,
            issuer=OPERATOR,
            expires_ns=0 if verb.stops else header.stamp_ns + START_LIVES_NS,
            run=self._bus.run,
        )
        if not verb.stops:
            self._last_start = self._count
        book = AwaitedAnswers(command, scope or tuple(met))
        self._orders.append(_Order(book, self._count, now_ns, now_ns, request))
        self._bus.publish(COMMAND, command)
        return book

    def take(self, ack: CommandAck) -> bool:
        """Take a driver's answer; return whether it belongs to an order that is being followed."""
        answered = [order.book for order in self._orders if order.book.note(ack)]
        for book in answered:
            progress = book.progress[ack.header.entity]
            line = f"{ack.header.entity}: {ack.verb} {progress.text()}"
            if progress.settled and line != self._said.get(ack.header.entity):
                self._said[ack.header.entity] = line  # the same refusal comes several times a second
                self._say(line)
        return bool(answered)

    def end_starts(self, why: str, drones: Collection[str] = ()) -> None:
        """Repeat starts no more to stopped drones (none given: to any); refuse requests of which nothing is left.

        A driver that was restarted has forgotten the stop, and would obey the repetition.
        """
        for order in [order for order in self._orders if not order.book.command.verb.stops]:
            if drones and order.book.leave_out(drones, why):
                continue
            self._orders.remove(order)
            if order.request is not None:
                self._requests.answer(order.request, AckStage.REFUSED, why)

    def follow(self, now_ns: int) -> None:
        """Repeat orders that were not answered; close those that are settled or timed out."""
        for order in list(self._orders):
            book, verb = order.book, order.book.command.verb
            late = now_ns - order.given_ns > _CONFIRM_NS.get(verb, _CONFIRM_DEFAULT_NS)
            if book.settled or late:
                self._orders.remove(order)
                self._close(order)
            elif now_ns - order.repeated_ns > book.repeat_after_s * NS_PER_S:
                order.repeated_ns = now_ns
                self._bus.publish(COMMAND, book.command)

    def _close(self, order: _Order) -> None:
        book = order.book
        open_ends = {name: p.text(final=True) for name, p in book.progress.items() if not p.settled}
        for name, text in open_ends.items():
            self._say(f"{name}: {book.command.verb} {text}")
        if order.request is None:
            return
        if book.confirmed:
            self._requests.answer(order.request, AckStage.EFFECTIVE)
        else:
            failed = [
                f"{n}: {p.text(final=True)}" for n, p in book.progress.items() if p.stage is not AckStage.EFFECTIVE
            ]
            self._requests.answer(order.request, AckStage.REFUSED, "; ".join(failed) or "no drone is up")
