"""Cameras at message level whose pictures are wrong."""

import itertools
from collections.abc import Iterable, Sequence

import msgspec

from groundstation.bus.messages import RelativeObservation, SearchedPicture
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.study.camera_model import Eye
from sim_bridge.world.world import World

# A black picture shows nobody, and its driver does not count it as searched; it withholds what was held back.
_NOTHING = frozenset(
    {FaultKind.CAMERA_CUT, FaultKind.CAMERA_STALL, FaultKind.CAMERA_HELD_BACK, FaultKind.PICTURE_BLACK}
)
# A vehicle's own video is compressed, so that no two pictures of a hanging camera are equal; at the wire its driver
# knows it by markers that stand while it tilts, after some 0.8 s.
_KNOWN_S = 1.5
_WOBBLE = 1e-5


class WrongEye:
    """An eye with faults that begin and end; `look` and `searched` as the eye's."""

    def __init__(self, eye: Eye, faults: Iterable[Fault]) -> None:
        self.eye, self.name, self.period_s = eye, eye.name, eye.period_s
        self._faults = tuple(fault for fault in faults if fault.entity == eye.name)
        self._frozen: list[RelativeObservation] = []
        self._repeats_s: dict[Fault, float] = {}
        self._shows = True
        self._numbers = itertools.count(1_000_000)  # beyond those of the eye

    def look(self, world: World, stamp_ns: int, clock: str) -> list[RelativeObservation]:
        """Return the sightings of one exposure under its faults."""
        active = [fault for fault in self._faults if fault.covers(world.time_s)]
        bumped = [fault for fault in active if fault.kind is FaultKind.CAMERA_BUMPED]
        self.eye.bump(bumped[0].amount, bumped[0].direction_deg) if bumped else self.eye.bump(0.0, 0.0)
        kinds = {fault.kind for fault in active}
        self._shows = not kinds & _NOTHING
        if not self._shows:
            return []
        seen = self.eye.look(world, stamp_ns, clock)
        if not self.eye.arrived:
            return []
        if FaultKind.PICTURE_FROZEN not in kinds:
            self._frozen = seen
            return seen
        if self._frozen:
            self._repeats_s |= {fault: world.time_s for fault in active if fault not in self._repeats_s}
        since_s = max((self._repeats_s[fault] for fault in active if fault in self._repeats_s), default=world.time_s)
        known = self.name not in world.drones or world.time_s - since_s >= _KNOWN_S
        self._shows = not known
        return [self._again(old, stamp_ns, known) for old in self._frozen]

    def observable_s(self, fault: Fault) -> float | None:
        """Return when a fault first shows [s], a frozen picture when it repeats a sighting; None if it never did."""
        return self._repeats_s.get(fault) if fault.kind is FaultKind.PICTURE_FROZEN else fault.start_s

    def searched(self, seen: Sequence[RelativeObservation], stamp_ns: int, clock: str) -> SearchedPicture | None:
        """Return the message that the last picture, if there was one, was searched all over."""
        return self.eye.searched(seen, stamp_ns, clock) if self._shows else None

    def _again(self, old: RelativeObservation, stamp_ns: int, known: bool) -> RelativeObservation:
        header = msgspec.structs.replace(old.header, stamp_ns=stamp_ns, seq=next(self._numbers))
        if known:
            return msgspec.structs.replace(old, header=header, picture_ns=old.header.stamp_ns)
        x, y, z = old.position_m
        trembling = (x, y, z * (1.0 + _WOBBLE * (header.seq % 7)))
        return msgspec.structs.replace(old, header=header, position_m=trembling)
