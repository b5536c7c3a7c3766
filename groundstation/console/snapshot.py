"""The viewers' data: named sections of JSON, each with the turn in which it last changed."""

from collections import deque
from collections.abc import Iterable
from typing import Any

import msgspec

_KEPT = 1000
_encoder = msgspec.json.Encoder(decimal_format="number")


class Snapshot:
    """Sections are encoded once for all viewers; a viewer gets those that changed since its last frame.

    So a slow viewer costs nothing, and misses only values that newer ones have replaced; added items are not replaced.
    """

    def __init__(self) -> None:
        self.turn = 0
        self._sections: dict[str, bytes] = {}
        self._changed: dict[str, int] = {}
        self._added: dict[str, deque[tuple[int, bytes]]] = {}
        self._composed: dict[int, bytes] = {}

    def begin(self) -> None:
        """Begin the next turn; sections put from now on belong to it."""
        self.turn += 1
        self._composed.clear()

    def forget(self) -> None:
        """Forget all sections: later ones belong to another time."""
        self._sections.clear()
        self._changed.clear()
        self._added.clear()
        self._composed.clear()

    def put(self, name: str, content: Any) -> None:
        """Set a section; it counts as changed only if its JSON differs."""
        encoded = _encoder.encode(content)
        if self._sections.get(name) != encoded:
            self._sections[name] = encoded
            self._changed[name] = self.turn
            self._composed.clear()

    def add(self, name: str, items: Iterable[Any]) -> None:
        """Add items that each viewer gets once, with its next frame; the last 1000 of a name are kept for slow ones."""
        for item in items:
            self._added.setdefault(name, deque(maxlen=_KEPT)).append((self.turn, _encoder.encode(item)))
            self._composed.clear()

    def since(self, turn: int) -> bytes:
        """Return the JSON object of all sections that changed after a turn (-1: all, without added items)."""
        composed = self._composed.get(turn)
        if composed is None:
            parts = [
                b'"%s":%s' % (name.encode(), self._sections[name]) for name, at in self._changed.items() if at > turn
            ]
            added = {name: [item for at, item in items if at > turn >= 0] for name, items in self._added.items()}
            parts += [b'"%s":[%s]' % (name.encode(), b",".join(items)) for name, items in added.items() if items]
            composed = self._composed[turn] = b"{%s}" % b",".join(parts)
        return composed
