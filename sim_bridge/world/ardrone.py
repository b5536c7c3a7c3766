"""One AR.Drone in the room: airframe, autopilot, battery, and the air that pushes it."""

import math
from collections.abc import Sequence

import numpy as np

from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.scenario import DroneScenario
from sim_bridge.world.airframe import GRAVITY_M_S2, Airframe
from sim_bridge.world.ardrone_autopilot import Autopilot
from sim_bridge.world.downwash import wake_between
from sim_bridge.world.noise import GaussMarkov, standard_normals

_UNREST_CORRELATION_S = 0.8


class Quadrotor:
    """A drone standing on its pad. `autopilot` takes the requests, `airframe` holds the true state.

    ultrasound_code: rate of its ultrasound as configured (7: 22.22 Hz, 8: 25 Hz); those of one rate disturb each other.
    wind: acceleration by a fault's wind [m/s^2; world]; air: that and the room's moving air.
    """

    def __init__(
        self,
        pad_m: tuple[float, float],
        yaw_rad: float,
        scenario: DroneScenario,
        tick_s: float,
        rng: np.random.Generator,
    ) -> None:
        draw = standard_normals(rng)
        self.airframe = Airframe(*pad_m, yaw_rad)
        self.autopilot = Autopilot(self.airframe, tick_s, draw)
        self.ultrasound_code = 8
        self.battery = float(rng.uniform(*scenario.battery))
        self._drain = scenario.battery_drain_per_min / 60.0 * tick_s
        self._unrest = tuple(
            GaussMarkov(scenario.air_unrest_m_s2 * share, _UNREST_CORRELATION_S, tick_s, draw)
            for share in (1.0, 1.0, 0.5)
        )
        self.wind = self.air = (0.0, 0.0)
        self._most_air = GRAVITY_M_S2 * math.tan(math.radians(scenario.moving_air_lean_deg))
        self._moving: tuple[GaussMarkov, ...] = ()
        if self._most_air > 0.0:  # a generator of its own: still air changes no other draw
            blow = standard_normals(rng.spawn(1)[0])
            correlation_s = scenario.moving_air_correlation_s
            self._moving = tuple(GaussMarkov(0.5 * self._most_air, correlation_s, tick_s, blow) for _ in range(2))

    @property
    def airborne(self) -> bool:
        """Return whether it has no contact with the floor."""
        return not self.airframe.on_ground

    def step(self, wake: tuple[float, float, float]) -> None:
        """Advance by one tick under the wake of the others [m/s^2; world]."""
        if self.autopilot.motors_on:
            self.battery = max(0.0, self.battery - self._drain)
            a, b, c = self._unrest
            wake = (wake[0] + a.step(), wake[1] + b.step(), wake[2] + c.step())
            self.air = self._air()
            if self.air != (0.0, 0.0) or self.autopilot.braced != (0.0, 0.0):
                self.autopilot.brace(self.air)
                wake = (wake[0] + self.air[0], wake[1] + self.air[1], wake[2])
        self.autopilot.step(wake)

    def _air(self) -> tuple[float, float]:
        if not self._moving:
            return self.wind
        x, y = (air.step() for air in self._moving)
        strength = math.hypot(x, y)
        share = min(1.0, self._most_air / strength) if strength > 0.0 else 1.0
        return self.wind[0] + share * x, self.wind[1] + share * y

    def suffer(self, kind: FaultKind, lasting: Sequence[Fault]) -> None:
        """Take the faults of the sensors that look at the floor; obstacles stand on each other."""
        if kind is FaultKind.UNIFORM_FLOOR:
            self.autopilot.blind = bool(lasting)
        elif kind is FaultKind.OBSTACLE_BELOW:
            self.autopilot.floor_m = sum(fault.amount for fault in lasting)

    def wake_on(self, other: Airframe) -> tuple[float, float, float] | None:
        """Return the acceleration of a body below by this drone's downwash, None out of its reach."""
        return wake_between(self.airframe, other)
