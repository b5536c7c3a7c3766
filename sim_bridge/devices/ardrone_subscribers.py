"""Clients of an emulated AR.Drone's navdata: each is served at its own port, with numbers from 1. Pure."""

from collections.abc import Iterator

from groundstation.time_units import NS_PER_S
from sim_bridge.devices.ardrone_session import COM_LOST_NS

Address = tuple[str, int]
_PATIENCE_NS = NS_PER_S
# Programs that restart ask from a new port each time and never say goodbye: the one silent for longest is dropped.
_MOST_LISTENERS = 4


class Listener:
    """One client of the navdata port."""

    __slots__ = ("address", "asked_ns", "bootstrap", "joined_ns", "sequence")

    def __init__(self, address: Address, now_ns: int) -> None:
        self.address = address
        self.joined_ns = self.asked_ns = now_ns
        self.bootstrap = True
        self.sequence = 0

    def next_sequence(self) -> int:
        """Return the number of the packet about to be sent."""
        self.sequence += 1
        return self.sequence


class Audience:
    """All clients of one drone's navdata port."""

    def __init__(self) -> None:
        self._listeners: dict[Address, Listener] = {}
        self._configured_ns: int | None = None

    def __iter__(self) -> Iterator[Listener]:
        return iter(tuple(self._listeners.values()))

    def __len__(self) -> int:
        return len(self._listeners)

    @property
    def bootstrap(self) -> bool:
        """Return whether no client has got more than status packets yet."""
        return all(listener.bootstrap for listener in self._listeners.values())

    def request(self, address: Address, now_ns: int) -> Listener | None:
        """Take a navdata request; returns the client if it is a new one."""
        known = self._listeners.get(address)
        if known is not None:
            known.asked_ns = now_ns
            return None
        if len(self._listeners) >= _MOST_LISTENERS:
            del self._listeners[min(self._listeners.values(), key=lambda each: each.asked_ns).address]
        self._listeners[address] = listener = Listener(address, now_ns)
        return listener

    def configured(self, now_ns: int) -> None:
        """Note that a client has chosen the navdata mode."""
        self._configured_ns = now_ns

    def leave_bootstrap(self, now_ns: int, ack: bool) -> None:
        """End the bootstrap of clients from before the choice of the mode, once that is acknowledged.

        Clients that never acknowledge wait for a second, and so do those that come after the choice.
        """
        chosen_ns = self._configured_ns
        if chosen_ns is None:
            return
        for listener in self._listeners.values():
            if listener.bootstrap:
                since_ns = max(chosen_ns, listener.joined_ns)
                answered = listener.joined_ns <= chosen_ns and not ack
                listener.bootstrap = not answered and now_ns - since_ns < _PATIENCE_NS

    def forget_silent(self, now_ns: int) -> None:
        """Drop clients that have not asked for 2 s; call it while no commands come either."""
        for listener in self:
            if now_ns - listener.asked_ns > COM_LOST_NS:
                del self._listeners[listener.address]
        if not self._listeners:
            self._configured_ns = None
