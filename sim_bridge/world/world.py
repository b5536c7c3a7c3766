"""The room with everything that moves in it, advanced in fixed steps of 5 ms; no clock of its own."""

import itertools
import math
from collections.abc import Mapping
from typing import assert_never

import numpy as np
from numpy.typing import NDArray

from sim_bridge.scenario import Scenario
from sim_bridge.site import Site, SiteDrone
from sim_bridge.truth import WIDTH
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.ardrone_sensors import Onboard
from sim_bridge.world.mavlink_copter import ARDUPILOT_RESPONSE, PX4_RESPONSE, MavlinkCopter
from sim_bridge.world.noise import generator_of
from sim_bridge.world.unicycle import Unicycle

TICK_S = 0.005
TICK_NS = 5_000_000
_STILL_AIR = (0.0, 0.0, 0.0)
# How far a drone's ultrasound disturbs another's, and how often that is looked at.
CROSSTALK_M = 2.0
_CROSSTALK_TICKS = 8


class World:
    """Drones, targets, and the onboard sensors of each drone.

    `bodies` names the rows of `states()`: the drones, then the targets.
    """

    def __init__(self, site: Site, scenario: Scenario, seed: int) -> None:
        self.bodies = site.bodies
        self.ticks = 0
        self.drones: dict[str, Quadrotor | MavlinkCopter] = {}
        self.onboard: dict[str, Onboard] = {}
        for name, drone in site.drones.items():
            self.drones[name] = self._drone(name, drone, scenario, seed)
        paths = scenario.of_targets(site.tracked)
        self.targets = {name: Unicycle(path, TICK_S, generator_of(seed, name)) for name, path in paths.items()}
        self._depart_after_s = {name: path.departs_after_team_s or 0.0 for name, path in paths.items()}
        self._together_s = 0.0
        self._downwash = scenario.drones.downwash
        self._crosstalk = scenario.drones.ultrasound_crosstalk
        self._disturbed: frozenset[str] = frozenset()
        self._half_room = (site.room.size_m[0] / 2, site.room.size_m[1] / 2, site.room.size_m[2])
        self._states = np.zeros((len(self.bodies), WIDTH))

    def _drone(self, name: str, drone: SiteDrone, scenario: Scenario, seed: int) -> Quadrotor | MavlinkCopter:
        place, rng = (drone.pad_m, drone.pad_yaw_rad), generator_of(seed, name)
        match drone.kind:
            case "ardrone":
                body = Quadrotor(*place, scenario.drones, TICK_S, rng)
                sensors = generator_of(seed, f"{name}/onboard")
                magnetometer = scenario.drones.firmware_of(name).startswith("ar2")
                self.onboard[name] = Onboard(scenario.drones, TICK_S, body.airframe, sensors, magnetometer)
                return body
            case "mavlink":
                response = PX4_RESPONSE if drone.require_mavlink().flavour == "px4" else ARDUPILOT_RESPONSE
                return MavlinkCopter(*place, scenario.mavlink, response, TICK_S, rng)
            case other:
                assert_never(other)

    @property
    def time_s(self) -> float:
        """Return the simulated time since the start."""
        return self.ticks * TICK_S

    @property
    def airborne(self) -> tuple[str, ...]:
        """Return the names of the drones without contact to the floor."""
        return tuple(name for name, drone in self.drones.items() if drone.airborne)

    def step(self) -> None:
        """Advance everything by one tick."""
        drones = self.drones
        wakes = {name: self._wake(name) for name in drones} if self._downwash and len(drones) > 1 else {}
        if self._crosstalk and self.ticks % _CROSSTALK_TICKS == 0:
            self._disturbed = _disturbed(self.ardrones)
        for name, drone in drones.items():
            drone.step(wakes.get(name, _STILL_AIR))
            drone.airframe.confine(*self._half_room)
            if isinstance(drone, MavlinkCopter):
                drone.estimate.step(drone.airframe, drone.motors_on)
            else:
                self.onboard[name].step(drone, drone.autopilot.motors_on, name in self._disturbed, drone.air)
        self._let_targets_depart()
        for target in self.targets.values():
            target.step()
            target.confine(self._half_room[0], self._half_room[1])
        self.ticks += 1

    def states(self) -> NDArray[np.float64]:
        """Return the true states (n, 13), columns as in `truth.FIELDS`; the array is reused by the next call."""
        rows = self._states
        for index, drone in enumerate(self.drones.values()):
            rows[index] = drone.airframe.row()
        for index, target in enumerate(self.targets.values(), len(self.drones)):
            rows[index] = target.row()
        return rows

    def _let_targets_depart(self) -> None:
        if len(self.airborne) == len(self.drones) and any(target.parked for target in self.targets.values()):
            self._together_s += TICK_S
            for name, target in self.targets.items():
                target.parked = target.parked and self._together_s < self._depart_after_s[name]

    def blow(self, name: str, push_m_s2: float, direction_deg: float) -> None:
        """Let the air push one drone [m/s^2], towards a direction [deg; world], counter-clockwise from x."""
        angle = math.radians(direction_deg)
        wind = (push_m_s2 * math.cos(angle), push_m_s2 * math.sin(angle)) if push_m_s2 else (0.0, 0.0)
        self.drones[name].wind = wind

    @property
    def copters(self) -> dict[str, MavlinkCopter]:
        """Return the MAVLink vehicles."""
        return {name: drone for name, drone in self.drones.items() if isinstance(drone, MavlinkCopter)}

    @property
    def ardrones(self) -> dict[str, Quadrotor]:
        """Return the AR.Drones."""
        return {name: drone for name, drone in self.drones.items() if isinstance(drone, Quadrotor)}

    def _wake(self, name: str) -> tuple[float, float, float]:
        below = self.drones[name].airframe
        if below.on_ground:
            return _STILL_AIR
        strongest = _STILL_AIR
        for other, drone in self.drones.items():
            if other != name and (push := drone.wake_on(below)) and push[2] < strongest[2]:
                strongest = push  # wakes do not add
        return strongest


def _disturbed(drones: Mapping[str, Quadrotor]) -> frozenset[str]:
    """Return the flying drones that have another one of the same ultrasound rate near them."""
    flying = [(name, drone) for name, drone in drones.items() if drone.airborne]
    near = set()
    for (name, drone), (other_name, other) in itertools.combinations(flying, 2):
        a, b = drone.airframe, other.airframe
        if drone.ultrasound_code == other.ultrasound_code and math.hypot(a.x - b.x, a.y - b.y) < CROSSTALK_M:
            near |= {name, other_name}
    return frozenset(near)
