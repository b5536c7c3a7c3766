"""The room with all its moving bodies, advanced in fixed steps of 5 ms; no clock of its own."""

import itertools
import math
from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from groundstation.time_units import NS_PER_MS
from groundstation.vectors import Vector3
from sim_bridge.scenario import Scenario
from sim_bridge.site import Site, SiteDrone
from sim_bridge.truth import WIDTH
from sim_bridge.world.emulation import Around, Body, KeepsSensors, emulation_of, senses_of
from sim_bridge.world.noise import generator_of
from sim_bridge.world.obstacles import all_obstacles, boxes_of, floor_below
from sim_bridge.world.places import Footprint, settled
from sim_bridge.world.puppet import Puppet
from sim_bridge.world.unicycle import Unicycle

TICK_S = 0.005
TICK_NS = 5 * NS_PER_MS
_TARGET_RADIUS_M = 0.18
_STILL_AIR = (0.0, 0.0, 0.0)
# Range at which a drone's ultrasound disturbs another's, and how often that is computed.
CROSSTALK_M = 2.0
_CROSSTALK_TICKS = 8
_NOWHERE = (math.nan,) * WIDTH
_UNTROUBLED, _TROUBLED = Around(), Around(crosstalk=True)
_Body = TypeVar("_Body")


class World:
    """Drones, targets, and the onboard sensors of each drone.

    `bodies` names the rows of `states()`: the drones, then the targets. real: the real ones among them, which are only
    followed (drones: `puppets`) or unknown (targets); waiting: real drones that stand on their pads until their first
    pose.
    """

    def __init__(
        self, site: Site, scenario: Scenario, seed: int, real: Collection[str] = (), waiting: Collection[str] = ()
    ) -> None:
        self.bodies = site.bodies
        self.ticks = 0
        self.drones: dict[str, Body] = {}
        self.puppets: dict[str, Puppet] = {}
        self.onboard: dict[str, Any] = {}
        self._keeps: dict[str, KeepsSensors] = {}
        self._senses: dict[str, Callable[[], None]] = {}
        room = self._half_room = (site.room.size_m[0] / 2, site.room.size_m[1] / 2, site.room.size_m[2])
        for name, drone in site.drones.items():
            if name in real:
                pad = (drone.pad_m, drone.pad_yaw_rad) if name in waiting else None
                self.puppets[name] = Puppet(room, TICK_S, pad)
            else:
                self.drones[name] = self._drone(name, drone, scenario, seed)
        paths = {name: path for name, path in scenario.of_targets(site.tracked).items() if name not in real}
        half_floor = (site.room.size_m[0] / 2, site.room.size_m[1] / 2)
        about = all_obstacles(scenario.obstacles, site.room.obstacles.values())
        self.obstacles = boxes_of(about, TICK_S, seed, half_floor)
        standing = [box.footprint for box in self.obstacles if box.stands]
        standing += [Footprint(*drone.pad_m) for drone in site.drones.values()]
        self.targets = {}
        for name, path in paths.items():
            place = settled(path.path, half_floor, standing, generator_of(seed, f"{name}/place"))
            there = path.model_copy(update={"path": place})
            self.targets[name] = Unicycle(there, TICK_S, generator_of(seed, name), half_floor)
        self._zones = scenario.floor_zones
        self._echoes = scenario.drones.echoes_of_bodies
        self._target_tops = {name: one.marker.height_m for name, one in site.tracked.items()}
        self._depart_after_s = {name: path.departs_after_team_s or 0.0 for name, path in paths.items()}
        self._together_s = 0.0
        self._downwash = scenario.drones.downwash
        self._crosstalk = scenario.drones.ultrasound_crosstalk
        self._disturbed: frozenset[str] = frozenset()
        self._states = np.zeros((len(self.bodies), WIDTH))

    def _drone(self, name: str, drone: SiteDrone, scenario: Scenario, seed: int) -> Body:
        emulation = emulation_of(drone.kind)
        body = emulation.body(drone, scenario, TICK_S, generator_of(seed, name))
        if isinstance(emulation, KeepsSensors):
            self._keeps[name] = emulation
            rng = generator_of(seed, f"{name}/onboard")
            self.onboard[name] = emulation.sensors(name, body, scenario, TICK_S, rng)
        elif (sense := senses_of(body)) is not None:
            self._senses[name] = sense
        return body

    @property
    def time_s(self) -> float:
        """Return the simulated time since the start."""
        return self.ticks * TICK_S

    @property
    def airborne(self) -> tuple[str, ...]:
        """Return the names of the drones without contact to the floor."""
        bodies: list[tuple[str, Body | Puppet]] = [*self.drones.items(), *self.puppets.items()]
        return tuple(name for name, drone in bodies if drone.airborne)

    def step(self) -> None:
        """Advance everything by one tick."""
        drones = self.drones
        for puppet in self.puppets.values():
            puppet.step()
        others: list[tuple[str, Body | Puppet]] = [*drones.items(), *self.puppets.items()]
        together = self._downwash and len(others) > 1
        wakes = {name: _wake(name, drone, others) for name, drone in drones.items()} if together else {}
        if self._crosstalk and self.ticks % _CROSSTALK_TICKS == 0:
            self._disturbed = _disturbed(drones)
        for name, drone in drones.items():
            drone.step(wakes.get(name, _STILL_AIR))
            drone.airframe.confine(*self._half_room)
            if (sense := self._senses.get(name)) is not None:
                sense()
            elif (emulation := self._keeps.get(name)) is not None:
                emulation.sense(drone, self.onboard[name], self._around(name, drone))
        self._let_targets_depart()
        for target in self.targets.values():
            target.step()
            target.confine(self._half_room[0], self._half_room[1])
        for box in self.obstacles:
            box.step()
        self.ticks += 1

    def _around(self, name: str, drone: Body) -> Around:
        """Return the disturbances of a drone's optical flow and ultrasound by floor, bodies below and neighbours."""
        crosstalk, body = name in self._disturbed, drone.airframe
        if not self._zones and not self._echoes:
            return _TROUBLED if crosstalk else _UNTROUBLED
        bias = next((z.flow_bias_m_s for z in self._zones if _in(body.x, z.x_m) and _in(body.y, z.y_m)), (0.0, 0.0))
        if not self._echoes:
            return Around(crosstalk, bias)
        tops = [(one.x, one.y, _TARGET_RADIUS_M, self._target_tops[n]) for n, one in self.targets.items()]
        tops += [(one.body.x, one.body.y, min(one.size_m[:2]) / 2, one.size_m[2]) for one in self.obstacles]
        return Around(crosstalk, bias, floor_below(body.x, body.y, body.z, tops))

    def states(self) -> NDArray[np.float64]:
        """Return the true states (n, 13), columns as in `truth.FIELDS`, NaN where they are not known.

        The array is reused by the next call.
        """
        self._states[:] = self.rows()
        return self._states

    def rows(self) -> list[tuple[float, ...]]:
        """Return the rows of `states`."""
        return [self._row(name) for name in self.bodies]

    def _row(self, name: str) -> tuple[float, ...]:
        if name in self.drones:
            return self.drones[name].airframe.row()
        if name in self.puppets:
            return self.puppets[name].row()
        return self.targets[name].row() if name in self.targets else _NOWHERE

    def _let_targets_depart(self) -> None:
        parked = [target for target in self.targets.values() if target.parked]
        if parked and len(self.airborne) == len(self.drones) + len(self.puppets):
            self._together_s += TICK_S
            for name, target in self.targets.items():
                target.parked = target.parked and self._together_s < self._depart_after_s[name]

    def blow(self, name: str, winds: Iterable[tuple[float, float]]) -> None:
        """Push one drone by winds: each [m/s^2] towards a direction [deg; world], counter-clockwise from x."""
        towards = [(push, math.radians(direction_deg)) for push, direction_deg in winds]
        x, y = (sum(push * turn(angle) for push, angle in towards) for turn in (math.cos, math.sin))
        self.drones[name].wind = (x, y)

    def of(self, body: type[_Body]) -> dict[str, _Body]:
        """Return the drones whose body is of a class."""
        return {name: drone for name, drone in self.drones.items() if isinstance(drone, body)}


def _wake(name: str, drone: Body, bodies: Iterable[tuple[str, Body | Puppet]]) -> Vector3:
    """Return the acceleration of one drone by the strongest downwash of the others."""
    below, strongest = drone.airframe, _STILL_AIR
    if below.on_ground:
        return _STILL_AIR
    for other, body in bodies:
        if other != name and (push := body.wake_on(below)) and push[2] < strongest[2]:
            strongest = push  # wakes do not add up
    return strongest


def _in(value: float, side: tuple[float, float]) -> bool:
    return side[0] <= value <= side[1]


def _disturbed(drones: Mapping[str, Body]) -> frozenset[str]:
    """Return the flying drones that have another one of the same ultrasound rate near them."""
    codes = {name: getattr(drone, "ultrasound_code", None) for name, drone in drones.items()}
    flying = [(name, drone) for name, drone in drones.items() if codes[name] is not None and drone.airborne]
    near = set()
    for (name, drone), (other_name, other) in itertools.combinations(flying, 2):
        a, b = drone.airframe, other.airframe
        if codes[name] == codes[other_name] and math.hypot(a.x - b.x, a.y - b.y) < CROSSTALK_M:
            near |= {name, other_name}
    return frozenset(near)
