"""The error to be expected of each robot's odometry, from its recent errors. Pure."""

import math

from groundstation.control.view import known_velocity_error_m_s, velocity_error_m_s
from groundstation.estimation.belief import JointBelief
from groundstation.time_units import NS_PER_S

# An autopilot's velocity error comes from its tilt error, which sways over 10 s: after a zero it comes back.
_FORGOTTEN_S = 10.0


class OdometryErrors:
    """Call `advance` with each belief."""

    def __init__(self) -> None:
        self._known_m_s: dict[str, float] = {}
        self._at_ns = 0

    def advance(self, belief: JointBelief) -> dict[str, float]:
        """Return the rms error to be expected of each robot's odometry while it flies on [m/s]."""
        kept = math.exp((self._at_ns - belief.stamp_ns) / NS_PER_S / _FORGOTTEN_S)
        self._at_ns = belief.stamp_ns
        robots = belief.layout.robots
        self._known_m_s = {
            name: max(known_velocity_error_m_s(belief, name), kept * self._known_m_s.get(name, 0.0)) for name in robots
        }
        return {name: max(velocity_error_m_s(belief, name), known) for name, known in self._known_m_s.items()}
