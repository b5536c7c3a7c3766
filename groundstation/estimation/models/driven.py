"""What all driven vehicles share: turning a step's condensed odometry into inputs held during that step."""

import math

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array
from groundstation.estimation.kernel import kernel
from groundstation.estimation.linear import wrap

# Nothing is known of the speed of a vehicle that is silent: 0.3 m/s, constant over some 0.5 s [m^2/s].
SILENT_DENSITY = 0.09
# Velocity is smoothed over this for all that is learnt from it [s].
SLOW_S = 1.0


@kernel("void(float64[::1], float64[::1], float64, float64)")
def hold_velocity(condensed: Array, aux: Array, hold_s: float, step: float) -> None:
    """Hold the mean velocity and commanded turn rate of one step; zero after `hold_s` of silence."""
    aux[s.ODOMETRY_AGE] += step
    count = condensed[s.VELOCITY_COUNT]
    if count > 0.0:
        aux[s.HELD_VX] = condensed[s.SUM_VX] / count
        aux[s.HELD_VY] = condensed[s.SUM_VY] / count
        aux[s.HELD_VZ] = condensed[s.SUM_VZ] / count
        aux[s.YAW_RATE] = condensed[s.SUM_RATE] / count
        aux[s.ODOMETRY_AGE] = 0.0
        share = step / (SLOW_S + step)
        aux[s.SLOW_VX] += share * (aux[s.HELD_VX] - aux[s.SLOW_VX])
        aux[s.SLOW_VY] += share * (aux[s.HELD_VY] - aux[s.SLOW_VY])
    elif aux[s.ODOMETRY_AGE] > hold_s:
        aux[s.HELD_VX] = aux[s.HELD_VY] = aux[s.HELD_VZ] = aux[s.YAW_RATE] = 0.0


@kernel("void(float64[::1], float64[::1], float64)")
def take_heading(condensed: Array, aux: Array, step: float) -> None:
    """Turn the vehicle's own heading into the yaw rate of this step (and hold how it leans); an increment across a
    reset is void.

    The heading jumped then, the vehicle did not.
    """
    aux[s.YAW_RATE] = 0.0
    if condensed[s.NEWEST_AT] < 0.0:
        return
    if aux[s.HAS_YAW] != 0.0 and aux[s.LAST_RESET] == condensed[s.NEWEST_RESET]:
        aux[s.YAW_RATE] = wrap(condensed[s.NEWEST_YAW] - aux[s.LAST_YAW]) / step
    aux[s.HELD_ROLL], aux[s.HELD_PITCH] = condensed[s.NEWEST_ROLL], condensed[s.NEWEST_PITCH]
    aux[s.LAST_YAW], aux[s.LAST_RESET], aux[s.HAS_YAW] = condensed[s.NEWEST_YAW], condensed[s.NEWEST_RESET], 1.0


@kernel("float64(float64, float64, float64)", inlined=True)
def position_density(density: float, age_s: float, hold_s: float) -> float:
    """Return the density of the position's noise [m^2/s], larger while the odometry is silent."""
    return density + (SILENT_DENSITY if age_s > hold_s else 0.0)


def world_velocity(yaw: float, forward: float, left: float, up: float) -> tuple[float, float, float]:
    """Return a velocity [base_stabilized] in the world's axes."""
    c, n = math.cos(yaw), math.sin(yaw)
    return float(c * forward - n * left), float(n * forward + c * left), float(up)
