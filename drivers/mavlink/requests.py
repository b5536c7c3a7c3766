"""Requests to one vehicle, repeated until acknowledged, with their answers. Pure."""

from collections import deque
from dataclasses import dataclass

from drivers.mavlink.wire.flight import CommandAckMessage, CommandLong, command_to
from drivers.mavlink.wire.names import MavCmd, MavResult
from groundstation.time_units import NS_PER_MS, NS_PER_S

_RETRY_NS = 500 * NS_PER_MS
_TRIES = 4
_SETTLE_NS = NS_PER_S
_REFUSED_NS = NS_PER_S
# WIRE (docs/reference/mavlink.md 5.15): PX4 1.16 answers once. Should a receiver accept whatever it is before its
# commander decides, or a router repeat an answer, the second one comes within milliseconds; the rest is for the link.
_ANSWERED_TWICE = frozenset((MavCmd.DO_SET_MODE,))
_SECOND_NS = NS_PER_S


@dataclass(slots=True)
class _Open:
    message: CommandLong
    due_ns: int
    tries: int = 0


class Requests:
    """Requests by key. Call `ask` as long as the request is wanted; it repeats none in progress.

    failures: requests refused or never answered, for the operator; drained by the driver.
    """

    def __init__(self, system: int) -> None:
        self._system = system
        self._open: dict[str, _Open] = {}
        self._quiet_until_ns: dict[str, int] = {}
        self._provisional: dict[int, tuple[str, int]] = {}  # by command: key, and until when it may be refused yet
        self.accepted: set[str] = set()
        self.failures: deque[str] = deque(maxlen=16)

    def ask(self, now_ns: int, key: str, command: MavCmd, *params: float) -> None:
        """Request a command; does nothing while it is in progress, or was answered within the last second."""
        if key in self._open or now_ns < self._quiet_until_ns.get(key, 0):
            return
        self._open[key] = _Open(command_to(self._system, command, *params), now_ns)

    def is_open(self, key: str) -> bool:
        """Return whether a request is in progress."""
        return key in self._open

    def drop(self, *keys: str) -> None:
        """Drop requests: a landing must not be followed by a late order to climb."""
        for key in keys:
            self._open.pop(key, None)
        for command in [c for c, (key, _) in self._provisional.items() if key in keys]:
            del self._provisional[command]

    def forget(self) -> None:
        """Begin anew, for a restarted vehicle."""
        self._open.clear()
        self._quiet_until_ns.clear()
        self._provisional.clear()
        self.accepted.clear()

    def due(self, now_ns: int) -> list[CommandLong]:
        """Return the requests to send now."""
        messages = []
        for key, request in list(self._open.items()):
            if now_ns < request.due_ns:
                continue
            if request.tries == _TRIES:
                del self._open[key]
                self._quiet_until_ns[key] = now_ns + _REFUSED_NS
                self.failures.append(f"{key}: no answer")
                continue
            messages.append(request.message._replace(confirmation=request.tries))
            request.tries, request.due_ns = request.tries + 1, now_ns + _RETRY_NS
        return messages

    def answer(self, now_ns: int, ack: CommandAckMessage) -> None:
        """Take an acknowledgement; it belongs to the oldest open request of that command that was sent.

        A refusal soon after an acceptance takes that back, where a vehicle answers twice.
        """
        sent = [key for key, r in self._open.items() if r.message.command == ack.command and r.tries]
        if not sent:
            self._take_second(now_ns, ack)
            return
        key, request = sent[0], self._open[sent[0]]
        if ack.result == MavResult.IN_PROGRESS:
            # The request arrived, so no try failed. It is sent again all the same, for it may be a stop.
            request.due_ns, request.tries = now_ns + _RETRY_NS, 1
            return
        del self._open[key]
        self._quiet_until_ns[key] = now_ns + _SETTLE_NS
        if ack.result == MavResult.ACCEPTED:
            self.accepted.add(key)
            if ack.command in _ANSWERED_TWICE:
                self._provisional[ack.command] = key, now_ns + _SECOND_NS
        else:
            self._refuse(now_ns, key, ack.result)

    def _take_second(self, now_ns: int, ack: CommandAckMessage) -> None:
        key, until_ns = self._provisional.get(ack.command, ("", 0))
        if now_ns < until_ns and ack.result not in (MavResult.ACCEPTED, MavResult.IN_PROGRESS):
            del self._provisional[ack.command]
            self.accepted.discard(key)
            self._refuse(now_ns, key, ack.result)

    def _refuse(self, now_ns: int, key: str, result: int) -> None:
        self._quiet_until_ns[key] = now_ns + _REFUSED_NS
        self.failures.append(f"{key}: {word_of(result)}")


def word_of(result: int) -> str:
    """Return the result of a command in words."""
    try:
        return MavResult(result).name.lower().replace("_", " ")
    except ValueError:
        return f"result {result}"
