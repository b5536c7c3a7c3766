"""One operator at a time among the viewers, of this console and of others; anybody may stop, and anybody may take over,
visibly to all.
"""

from dataclasses import dataclass

from groundstation.time_units import NS_PER_S

# A page that reconnects within this time is still the operator.
_GRACE_NS = 15 * NS_PER_S
# Prefix of another console's name: no page here has it, whose id holds no such signs.
_ELSEWHERE = "elsewhere: "


@dataclass(slots=True)
class OperatorLock:
    """The viewer who is the operator: `client` survives a reconnection, `name` is shown to others."""

    client: str = ""
    name: str = ""
    _left_ns: int = 0

    def may_start(self, client: str) -> bool:
        """Return whether a viewer may give starting orders: as the operator, or if there is none."""
        return self.client in ("", client)

    def take(self, client: str, name: str) -> str:
        """Make a viewer the operator; returns the name of the one it replaces, or ""."""
        replaced = self.name if self.client not in ("", client) else ""
        self.client, self.name, self._left_ns = client, name, 0
        return replaced

    def passed_to(self, console: str) -> bool:
        """Note that a start was given at another console of the run; returns whether a viewer here was the operator.

        It stays there until somebody here takes over: the closing of the other page is not noticed here.
        """
        replaced = bool(self.client) and not self.client.startswith(_ELSEWHERE)
        self.client, self.name, self._left_ns = f"{_ELSEWHERE}{console}", console, 0
        return replaced

    def release(self, client: str) -> None:
        """Release the lock, if it is that viewer's."""
        if client == self.client:
            self.client = self.name = ""

    def arrived(self, client: str, name: str) -> None:
        """Note that a viewer came (back)."""
        if client == self.client:
            self.name, self._left_ns = name, 0

    def left(self, client: str, now_ns: int) -> None:
        """Note that a viewer's connection ended."""
        if client == self.client:
            self._left_ns = now_ns

    def step(self, now_ns: int) -> None:
        """Free the lock when its viewer stays away."""
        if self.client and self._left_ns and now_ns - self._left_ns > _GRACE_NS:
            self.client = self.name = ""
