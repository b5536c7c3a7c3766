"""The airframe of an AR.Drone: its response to tilt, climb and turn references.

Figures of real flights (docs/reference/ardrone.md 7): 10 / 63 / 90 % of the tilt peak 90 / 180 / 270 ms after a
command, 8 % overshoot; 12 degrees of tilt bring 2.7 m/s after 2 s.
"""

import math

GRAVITY_M_S2 = 9.81
STANDING_HEIGHT_M = 0.06  # of the base above the floor, on its feet

# Fitted to those pulses together with the autopilot's command delay of 50 ms.
_TILT_RATE = 12.5
_TILT_DAMPING = 0.627
_DRAG_LINEAR = 0.08
_DRAG_QUADRATIC = 0.17
# First-order rate 10 /s (tum_ardrone's identified model, docs/reference/ardrone.md 7).
_YAW_RATE = 10.0


class Airframe:
    """State of one quadrotor: position and velocity [world], Euler angles [rad; FLU] and their rates.

    Pitch is positive nose down and roll positive right side down, so pitch accelerates forward, roll to the right.
    """

    __slots__ = (
        "ax", "ay", "az", "on_ground", "pitch", "pitch_rate", "roll", "roll_rate",
        "vx", "vy", "vz", "x", "y", "yaw", "yaw_rate", "z",
    )  # fmt: skip

    def __init__(self, x_m: float, y_m: float, yaw_rad: float) -> None:
        self.x, self.y, self.z, self.yaw = x_m, y_m, STANDING_HEIGHT_M, yaw_rad
        self.vx = self.vy = self.vz = 0.0
        self.ax = self.ay = self.az = 0.0
        self.roll = self.pitch = 0.0
        self.roll_rate = self.pitch_rate = self.yaw_rate = 0.0
        self.on_ground = True

    def velocity_stabilized(self) -> tuple[float, float]:
        """Return (forward, left) velocity [m/s; base_stabilized]."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return c * self.vx + s * self.vy, c * self.vy - s * self.vx

    def body_rates(self) -> tuple[float, float, float]:
        """Return the angular velocity [rad/s; base]."""
        sr, cr, sp, cp = math.sin(self.roll), math.cos(self.roll), math.sin(self.pitch), math.cos(self.pitch)
        turn = self.yaw_rate
        return (
            self.roll_rate - turn * sp,
            self.pitch_rate * cr + turn * cp * sr,
            turn * cp * cr - self.pitch_rate * sr,
        )

    def specific_force(self) -> tuple[float, float, float]:
        """Return the reading of ideal accelerometers [m/s^2; base]."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        forward, left, up = c * self.ax + s * self.ay, c * self.ay - s * self.ax, self.az + GRAVITY_M_S2
        sr, cr, sp, cp = math.sin(self.roll), math.cos(self.roll), math.sin(self.pitch), math.cos(self.pitch)
        bent = sp * forward + cp * up
        return cp * forward - sp * up, cr * left + sr * bent, cr * bent - sr * left

    def row(self) -> tuple[float, ...]:
        """Return the 13 numbers of the truth board."""
        return (
            self.x, self.y, self.z, self.vx, self.vy, self.vz, self.roll, self.pitch, self.yaw,
            *self.body_rates(), float(self.on_ground),
        )  # fmt: skip

    def step(
        self,
        tick_s: float,
        tilt: tuple[float, float],
        climb_acceleration: float,
        yaw_rate: float,
        push: tuple[float, float, float],
    ) -> None:
        """Advance by one tick.

        tilt: (roll, pitch) references [rad]; climb_acceleration [m/s^2]; yaw_rate reference [rad/s];
        push: acceleration by the air [m/s^2; world].
        """
        self._turn(tick_s, tilt, yaw_rate)
        forward, left = GRAVITY_M_S2 * math.tan(self.pitch), -GRAVITY_M_S2 * math.tan(self.roll)
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        drag = _DRAG_LINEAR + _DRAG_QUADRATIC * math.hypot(self.vx, self.vy)
        self.ax = c * forward - s * left - drag * self.vx + push[0]
        self.ay = s * forward + c * left - drag * self.vy + push[1]
        self.az = climb_acceleration + push[2]
        self.advance(tick_s)

    def advance(self, tick_s: float) -> bool:
        """Move by the present accelerations for one tick; return whether that ends on the floor, where it stands."""
        self.vx += self.ax * tick_s
        self.vy += self.ay * tick_s
        self.vz += self.az * tick_s
        self.x += self.vx * tick_s
        self.y += self.vy * tick_s
        self.z += self.vz * tick_s
        self.on_ground = False
        if self.z <= STANDING_HEIGHT_M:
            self.stand()
        return self.on_ground

    def _turn(self, tick_s: float, tilt: tuple[float, float], yaw_rate: float) -> None:
        stiffness, damping = _TILT_RATE**2, 2.0 * _TILT_DAMPING * _TILT_RATE
        self.roll_rate += (stiffness * (tilt[0] - self.roll) - damping * self.roll_rate) * tick_s
        self.pitch_rate += (stiffness * (tilt[1] - self.pitch) - damping * self.pitch_rate) * tick_s
        self.yaw_rate += _YAW_RATE * (yaw_rate - self.yaw_rate) * tick_s
        self.roll += self.roll_rate * tick_s
        self.pitch += self.pitch_rate * tick_s
        self.yaw = math.remainder(self.yaw + self.yaw_rate * tick_s, math.tau)

    def tumble(self, tick_s: float, roll_rate: float, pitch_rate: float) -> None:
        """Turn over in free fall for one tick [rad/s]; a drone that reaches the floor stands on it again."""
        self.roll_rate, self.pitch_rate, self.yaw_rate = roll_rate, pitch_rate, 0.0
        self.roll = math.remainder(self.roll + roll_rate * tick_s, math.tau)
        self.pitch = math.remainder(self.pitch + pitch_rate * tick_s, math.tau)
        self.ax, self.ay, self.az = 0.0, 0.0, -GRAVITY_M_S2
        self.advance(tick_s)

    def level(self) -> None:
        """End a tumble upright."""
        self.roll = self.pitch = self.roll_rate = self.pitch_rate = 0.0

    def stand(self) -> None:
        """Come to rest on the floor, level."""
        self.z = STANDING_HEIGHT_M
        self.vx = self.vy = self.vz = self.ax = self.ay = self.az = 0.0
        self.roll = self.pitch = self.roll_rate = self.pitch_rate = self.yaw_rate = 0.0
        self.on_ground = True

    def confine(self, half_x_m: float, half_y_m: float, top_m: float) -> None:
        """Stop at the walls and the ceiling of the room."""
        if abs(self.x) > half_x_m:
            self.x, self.vx = math.copysign(half_x_m, self.x), 0.0
        if abs(self.y) > half_y_m:
            self.y, self.vy = math.copysign(half_y_m, self.y), 0.0
        if self.z > top_m:
            self.z, self.vz = top_m, min(self.vz, 0.0)
