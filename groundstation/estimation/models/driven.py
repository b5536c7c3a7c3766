"""Turns a step's condensed odometry into inputs held during that step, for all driven vehicles."""

import math

from groundstation.estimation.linear import wrap
from groundstation.estimation.records import CondensedOdometry, EntityMemory
from groundstation.kernel import kernel

# The speed of a silent vehicle is unknown: 0.3 m/s, constant over some 0.5 s [m^2/s].
SILENT_DENSITY = 0.09
# So is its turn: 0.15 rad/s, likewise [rad^2/s]. It is ordered to hover, but may have been turning at its last message.
SILENT_TURN_DENSITY = 0.0225
_TURNS_ON_S = 0.1  # without a heading
# No vehicle turns faster [rad/s]: beyond, its heading jumped. The time between two headings is this uncertain [s].
_FASTEST_TURN, _APART_S = 4.0, 0.05
SILENT_S = 0.3  # after a longer pause between headings the vehicle was silent
# Velocity is smoothed over this time for the estimates of its errors [s].
SLOW_S = 1.0


@kernel()
def hold_velocity(odometry: CondensedOdometry, memory: EntityMemory, hold_s: float, step: float) -> None:
    """Hold the mean velocity and commanded turn rate of one step; zero after `hold_s` of silence."""
    memory.odometry_age_s += step
    count = odometry.velocity_count
    if count > 0.0:
        memory.held_vx = odometry.sum_vx / count
        memory.held_vy = odometry.sum_vy / count
        memory.held_vz = odometry.sum_vz / count
        memory.yaw_rate = odometry.sum_rate / count
        memory.odometry_age_s = 0.0
        share = step / (SLOW_S + step)
        memory.slow_vx += share * (memory.held_vx - memory.slow_vx)
        memory.slow_vy += share * (memory.held_vy - memory.slow_vy)
    elif memory.odometry_age_s > hold_s:
        memory.held_vx = memory.held_vy = memory.held_vz = memory.yaw_rate = 0.0
        memory.slow_vx = memory.slow_vy = 0.0


@kernel()
def take_heading(odometry: CondensedOdometry, memory: EntityMemory, step: float) -> None:
    """Turn the vehicle's own heading into the yaw rate of this step, and hold roll and pitch.

    Between two headings it turns on as before, and the next one corrects that. An increment across a reset, or one too
    large for a turn, is void: the heading jumped, not the vehicle. Of an increment across a silence only the part after
    the last sighting of the vehicle counts, which included the rest; the turn is assumed to be even.
    """
    memory.yaw_age_s += step
    if odometry.newest_at < 0.0:
        memory.yaw_rate = memory.turn_rate if memory.yaw_age_s <= _TURNS_ON_S else 0.0
        memory.turned += memory.yaw_rate * step
        return
    memory.yaw_rate = memory.turn_rate = 0.0
    kept = memory.has_yaw != 0 and memory.last_reset == odometry.newest_reset
    if kept:
        increment = wrap(odometry.newest_yaw - memory.last_yaw)
        if memory.yaw_age_s > SILENT_S:
            kept = False
            memory.yaw_rate = (increment - memory.turned) / step * min(1.0, memory.unseen_s / memory.yaw_age_s)
        elif abs(increment) <= _FASTEST_TURN * (memory.yaw_age_s + _APART_S):
            memory.yaw_rate = (increment - memory.turned) / step
            mean_rate = increment / memory.yaw_age_s
            memory.turn_rate = mean_rate if abs(mean_rate) <= _FASTEST_TURN else 0.0
        else:
            kept = False
    if not kept:
        memory.keeps_heading = 0
    memory.yaw_age_s = memory.turned = 0.0
    memory.held_roll, memory.held_pitch = odometry.newest_roll, odometry.newest_pitch
    memory.attitude_std, memory.yaw_std = odometry.newest_attitude_std, odometry.newest_yaw_std
    memory.last_yaw, memory.last_reset, memory.has_yaw = odometry.newest_yaw, odometry.newest_reset, 1


@kernel(inlined=True)
def position_density(density: float, age_s: float, hold_s: float) -> float:
    """Return the density of the position's noise [m^2/s], larger while the odometry is silent."""
    return density + (SILENT_DENSITY if age_s > hold_s else 0.0)


def world_velocity(yaw: float, forward: float, left: float, up: float) -> tuple[float, float, float]:
    """Return a velocity [base_stabilized] in the world's axes."""
    c, n = math.cos(yaw), math.sin(yaw)
    return float(c * forward - n * left), float(n * forward + c * left), float(up)
