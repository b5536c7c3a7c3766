"""Odometry of a Kobuki base from its wheels: encoders of a finite step, and a wrong radius.

Slip is in the motion, not here: the wheels turn, and the base does not follow (world/unicycle.py).
"""

import numpy as np

from sim_bridge.world.unicycle import Unicycle

PERIOD_S = 0.05
# Length of an encoder tick [m]; the base reports their number every 20 ms (kobuki_driver,
# "Kobuki Parameters": 11 724.4 ticks a metre).
_TICK_M, _PACKET_S = 1.0 / 11724.4, 0.02
# Of the radius of 35 mm: a worn or otherwise filled wheel is off by 0.35 mm.
_RADIUS_STD = 0.01


class WheelOdometry:
    """The odometry of one base; errors: whether the radius is off."""

    def __init__(self, base: Unicycle, errors: bool, rng: np.random.Generator) -> None:
        self._base = base
        self._scale = 1.0 + (_RADIUS_STD * float(rng.standard_normal()) if errors else 0.0)

    def read(self) -> tuple[float, float]:
        """Return forward speed [m/s] and turn rate [rad/s] as the base reports them."""
        speed, turn_rate = self._base.wheels
        ticks = round(self._scale * speed * _PACKET_S / _TICK_M)
        return ticks * _TICK_M / _PACKET_S, turn_rate
