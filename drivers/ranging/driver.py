"""The ranging process: rounds of ranges in; checked rounds with the anchors' places, and status out."""

import math
from collections import Counter
from collections.abc import Iterable

from drivers.base import HostProcess, read_section
from drivers.plausibility.clock_watch import ClockWatch
from drivers.ranging.anchor_watch import AnchorWatch
from drivers.ranging.gateway import Gateway
from drivers.ranging.settings import RangingSection, parse_source
from drivers.ranging.wire.ranges import Round
from drivers.stream_health import StreamHealth, StreamNames
from groundstation.bus.messages import RangeObservation, Severity
from groundstation.bus.topics import RANGE
from groundstation.geometry.multilateration import fix_from_ranges, likely_in
from groundstation.time_units import NS_PER_MS, NS_PER_S

_POLL_S = 0.02
# Noise of centimetres in several ranges does not repeat: a gateway that keeps sending its last round is stuck.
_MOST_REPEATS = 3
# As for poses of motion capture: a round this much later than the freshest ones has waited somewhere.
_LATE_S = 0.3
_REMEDY = "restart the gateway"
_RESTART = "restart that anchor, or the gateway; the other anchors' ranges count meanwhile"


def run(child: HostProcess) -> int:
    """Serve one system until a stop is requested; returns the exit code."""
    settings = read_section(RangingSection, child.section, "ranging")
    gateway = Gateway(*parse_source(settings.source))
    try:
        driver = RangingDriver(child, settings, gateway)
        while not child.stop_requested and child.supervisor_alive:
            driver.turn()
    finally:
        gateway.close()
    return 0


class RangingDriver:
    """Turns rounds of one system into messages; `turn` is one pass of its loop (at most 20 ms of waiting)."""

    def __init__(self, child: HostProcess, settings: RangingSection, gateway: Gateway) -> None:
        self._child, self._settings, self._gateway = child, settings, gateway
        self._robots = {one.name: one.entity for one in settings.transponders}
        self._likely = likely_in(settings.volume_m)
        self._newest_ns: dict[str, int] = {}
        self._last: dict[str, tuple[dict[str, float], int]] = {}
        self._anchors, self._held, self._stuck = AnchorWatch(), set[str](), set[str]()
        self._clock, self._late = ClockWatch(), False
        remedy = f"check the gateway, whether its radios run, and its address {settings.source}"
        names = StreamNames("ranging", settings.name, "range", settings.source, remedy)
        self._health = StreamHealth(child, names, settings.start_within_s, settings.silent_after_s)
        self.counts: Counter[str] = Counter()

    def turn(self) -> None:
        """Wait briefly for rounds, process them, and keep up heartbeat, status and the watch over silence."""
        rounds = self._gateway.poll(_POLL_S)
        for number, (arrival_ns, told) in enumerate(rounds):
            if _is_covered(told, (later for _, later in rounds[number + 1 :])):
                self._health.skipped += 1  # came at once with a newer one, after a stall
            else:
                self._handle(arrival_ns, told)
        self._tell_held()
        self._tell_stuck({robot for robot, (_, repeats) in self._last.items() if repeats > _MOST_REPEATS})
        why = f"the ranges of {', '.join(sorted(self._stuck))} repeat themselves: {_REMEDY}" if self._stuck else ""
        wrong = why or "".join(f"anchor {anchor} holds its last range; " for anchor in sorted(self._held)).strip("; ")
        late = "its last rounds came late" if self._late else ""
        self._health.end_turn(why or late or self._gateway.failed, wrong, self.counts + self._gateway.rejected)

    def _tell_held(self) -> None:
        """Report each anchor that holds its last range to a robot, once, and its return."""
        name, held = self._settings.name, {anchor for anchors in self._anchors.stuck.values() for anchor in anchors}
        for anchor in sorted(held - self._held):
            robots = " and ".join(robot for robot, anchors in self._anchors.stuck.items() if anchor in anchors)
            text = f"ranging {name}: anchor {anchor} holds its last range to {robots}, which is not used"
            self._child.event(Severity.WARNING, text, _RESTART, name)
        for anchor in sorted(self._held - held):
            self._child.event(Severity.INFO, f"ranging {name}: anchor {anchor} measures again", entity=name)
        self._held = held

    def _tell_stuck(self, stuck: set[str]) -> None:
        """Report each robot whose rounds repeat themselves, once, and their return."""
        name = self._settings.name
        for robot in sorted(stuck - self._stuck):
            text = f"ranging {name}: the ranges of {robot} repeat themselves and are not used"
            self._child.event(Severity.WARNING, text, _REMEDY, name)
        for robot in sorted(self._stuck - stuck):
            self._child.event(Severity.INFO, f"ranging {name}: the ranges of {robot} change again", entity=name)
        self._stuck = stuck

    def _handle(self, arrival_ns: int, told: Round) -> None:
        robot = self._robots.get(told.transponder)
        if robot is not None and self._repeats(robot, told.m):
            self.counts["repeated"] += 1
            return
        late_s = self._late_s(arrival_ns, told)
        self._late = late_s > _LATE_S
        if self._late:
            self.counts["late"] += 1
            return
        self._health.came(arrival_ns)
        if robot is None:
            self.counts["unknown transponder"] += 1
            return
        stamp_ns = arrival_ns - round((self._settings.delay_ms + told.age_ms) * NS_PER_MS + late_s * NS_PER_S)
        if stamp_ns <= self._newest_ns.get(robot, 0):
            self._health.skipped += 1  # overtaken by a newer one on the way
            return
        self._newest_ns[robot] = stamp_ns
        self._health.used(stamp_ns)
        ranges_m = self._anchors.sound(robot, self._known(told.m))
        self.counts["held"] += len(self._anchors.stuck[robot])
        if ranges_m:
            self._health.reported += 1
            self._child.bus.publish(RANGE, self._message(robot, ranges_m, stamp_ns))

    def _late_s(self, arrival_ns: int, told: Round) -> float:
        """Return by how much a round came later than the freshest ones, 0 where the gateway tells no times."""
        if told.sent_ms is None:
            return 0.0
        return self._clock.update(arrival_ns, round(told.sent_ms * NS_PER_MS))[1]

    def _repeats(self, robot: str, ranges_m: dict[str, float]) -> bool:
        """Return whether a robot's rounds have repeated too often."""
        last, repeats = self._last.get(robot, ({}, 0))
        repeats = repeats + 1 if ranges_m == last else 0
        self._last[robot] = ranges_m, repeats
        return repeats > _MOST_REPEATS

    def _known(self, told: dict[str, float]) -> dict[str, float]:
        """Return the ranges to anchors of the field that are within reach; the others are counted."""
        kept = {anchor: m for anchor, m in told.items() if anchor in self._settings.anchors}
        self.counts["unknown anchor"] += len(told) - len(kept)
        near = {anchor: m for anchor, m in kept.items() if m <= self._settings.reach_m}
        self.counts["beyond reach"] += len(kept) - len(near)
        return near

    def _message(self, robot: str, ranges_m: dict[str, float], stamp_ns: int) -> RangeObservation:
        settings = self._settings
        std_m = math.hypot(settings.range_std_m, settings.bias_std_m)
        places = [settings.anchors[anchor] for anchor in ranges_m]
        fix = fix_from_ranges(places, [*ranges_m.values()], std_m, *self._likely)
        return RangeObservation(
            header=self._child.bus.header(settings.name, stamp_ns),
            observer=settings.name,
            subject=robot,
            ranges_m=ranges_m,
            std_m=settings.range_std_m,
            position_m=None if fix is None else fix.position_m,
            covariance=(0.0,) * 9 if fix is None else tuple(fix.covariance.ravel().tolist()),
        )


def _is_covered(told: Round, later: Iterable[Round]) -> bool:
    """Return whether a later round of the same transponder has a newer range of any of the same anchors."""
    return any(other.transponder == told.transponder and not told.m.keys().isdisjoint(other.m) for other in later)
