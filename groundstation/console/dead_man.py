"""A dead man's handle: while it is held all continues; released, the team holds, then lands. No web server involved."""

from dataclasses import dataclass
from enum import StrEnum

from groundstation.bus.messages import Verb
from groundstation.time_units import NS_PER_S

_LAND_AFTER_NS = 5 * NS_PER_S


class Grip(StrEnum):
    """DISARMED until it is held for the first time; HELD while it is; then LOOSE, and at last LANDED by us."""

    DISARMED = "DISARMED"
    HELD = "HELD"
    LOOSE = "LOOSE"
    LANDED = "LANDED"


@dataclass(slots=True)
class DeadMan:
    """Pure: call `press` at each sign that the handle is held, `step` often; they return the due stop, if any.

    patience_ns: permitted time without a sign. A keyboard repeats a held key, but only after some 0.5 s.
    """

    patience_ns: int
    grip: Grip = Grip.DISARMED
    _felt_ns: int = 0
    _loose_ns: int = 0

    def press(self, now_ns: int) -> None:
        """Note that the handle is held. Stopped drones stay stopped until the operator's RESUME."""
        self._felt_ns = now_ns
        self.grip = Grip.HELD

    def release(self, now_ns: int) -> Verb | None:
        """Note that the handle is released (as a gamepad reports, or when it is gone)."""
        if self.grip is not Grip.HELD:
            return None
        self.grip, self._loose_ns = Grip.LOOSE, now_ns
        return Verb.HOLD

    def step(self, now_ns: int) -> Verb | None:
        """Let time pass."""
        if self.grip is Grip.HELD and now_ns - self._felt_ns > self.patience_ns:
            return self.release(now_ns)
        if self.grip is Grip.LOOSE and now_ns - self._loose_ns > _LAND_AFTER_NS:
            return self.land()
        return None

    def land(self) -> Verb:
        """Land at once."""
        self.grip = Grip.LANDED
        return Verb.LAND
