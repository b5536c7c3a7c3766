"""A ranging system without a wire: true distances in, rounds of ranges as its driver publishes them out."""

import math
from collections.abc import Callable, Iterable, Mapping

import numpy as np

from groundstation.bus.messages import Header, RangeObservation
from groundstation.geometry.multilateration import fix_from_ranges, likely_in
from sim_bridge.fault_kinds import Fault
from sim_bridge.mounting import generator_of_eye
from sim_bridge.ranges import Radios
from sim_bridge.site import Site
from sim_bridge.world.world import World

# (robot, all its ranges) -> the ranges that the driver passes on
Sound = Callable[[str, Mapping[str, float]], dict[str, float]]


def _all(_robot: str, ranges_m: Mapping[str, float]) -> dict[str, float]:
    return dict(ranges_m)


class RangingEye:
    """Measures every robot in turn against all anchors; sound: the driver's watch over anchors."""

    def __init__(
        self, name: str, site: Site, errors: bool, rng: np.random.Generator, faults: Iterable[Fault] = (),
        sound: Sound = _all,
    ) -> None:  # fmt: skip
        system = site.ranging[name]
        self.name, self.period_s, self.lateness_ms = name, 1.0 / system.rate_hz, system.delay_ms
        self._system, self._robots, self._seq = system, tuple(site.drones), 0
        self._radios = Radios(system, errors, rng, [fault for fault in faults if fault.entity == name])
        self._sound = sound
        box = system.volume_m
        self._likely = likely_in((box.x_m, box.y_m, box.z_m))

    def look(self, world: World, stamp_ns: int, clock: str) -> list[RangeObservation]:
        """Return one round with each robot."""
        states, told = dict(zip(world.bodies, world.states(), strict=True)), []
        for robot in self._robots:
            ranges_m = self._sound(robot, self._radios.ranges_m(robot, states[robot], world.time_s))
            if ranges_m:
                self._seq += 1
                told.append(self._message(robot, ranges_m, Header(stamp_ns, clock, self.name, self.name, self._seq)))
        return told

    def _message(self, robot: str, ranges_m: dict[str, float], header: Header) -> RangeObservation:
        system = self._system
        std_m = math.hypot(system.range_std_m, system.bias_std_m)
        fix = fix_from_ranges([system.anchors[one] for one in ranges_m], [*ranges_m.values()], std_m, *self._likely)
        return RangeObservation(
            header=header,
            observer=self.name,
            subject=robot,
            ranges_m=ranges_m,
            std_m=system.range_std_m,
            position_m=None if fix is None else fix.position_m,
            covariance=(0.0,) * 9 if fix is None else tuple(fix.covariance.ravel().tolist()),
        )


def ranging_of(
    site: Site, errors: bool, seed: int, faults: Iterable[Fault] = (), watch: Callable[[], Sound] = lambda: _all
) -> list[RangingEye]:
    """Return the ranging systems of a site; watch: makes the watch of one system over its anchors."""
    names = tuple(site.ranging)
    return [RangingEye(name, site, errors, generator_of_eye(seed, name), faults, watch()) for name in names]
