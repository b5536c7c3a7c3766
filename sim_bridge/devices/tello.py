"""An emulated Tello: its motion, and its text protocol over UDP 8889 and 8890.

WIRE (docs/reference/tello.md 2): sticks are kept until others come, during a landing too; 15 s without a command land
it; answers go to the sender, the state to port 8890 of the one that said `command`, ten times a second.
"""

import math
from contextlib import suppress

import numpy as np

from drivers.tello.wire.text import (
    COMMAND_PORT,
    EMERGENCY,
    LAND,
    NO_ECHO_CM,
    OK,
    SDK,
    STATE_PORT,
    STREAM_ON,
    TAKE_OFF,
    State,
)
from groundstation.vectors import Vector3
from sim_bridge.devices.tello_text import STOP, STREAM_OFF, parse_rc, state_text
from sim_bridge.launch_spec import LaunchSpec
from sim_bridge.listening import open_udp
from sim_bridge.own_video import OwnVideo
from sim_bridge.scenario import Scenario
from sim_bridge.site import SiteDrone
from sim_bridge.world.airframe import GRAVITY_M_S2, STANDING_HEIGHT_M, Airframe
from sim_bridge.world.downwash import wake_between
from sim_bridge.world.flow_sensors import FlowSensors
from sim_bridge.world.noise import GaussMarkov, standard_normals
from sim_bridge.wrong_values import WrongValues, wrong_values_of

_STATE_TICKS = 20
_TICK_S = 0.005
_QUIET_S = 15.0
_TAKE_OFF_M, _DESCENT_M_S = 0.8, 0.4
_RESPONSE_S, _CLIMB_S, _TURN_S, _TILT_S, _MOST_M_S2 = 0.35, 0.25, 0.15, 0.12, 2.5
# Constant disturbances (wind, a tilt that it takes for level) are trimmed away in a second or so.
_TRIM_PER_S2, _MOST_TRIM_M_S2 = 2.0, 2.0
# WIRE (docs/reference/tello.md 3): `h` comes in steps of 10 cm and is up to 35 cm low; here it always is by 25 to 35.
_H_LOW_CM, _H_STEP_CM = 25, 10
_DATAGRAMS_PER_TICK = 64
_STILL: Vector3 = (0.0, 0.0, 0.0)
_CENTRED = (_STILL, 0.0)
_FULL_M_S, _FULL_TURN_RAD_S = 1.0, math.radians(100.0)

_WORDS = (TAKE_OFF, LAND, EMERGENCY, STOP, STREAM_ON, STREAM_OFF)


class TelloBody:
    """A quadrotor that follows commanded velocities by its own, wrong, optical flow and tilt."""

    def __init__(self, drone: SiteDrone, scenario: Scenario, tick_s: float, rng: np.random.Generator) -> None:
        draw = standard_normals(rng)
        self.airframe = Airframe(*drone.pad_m, drone.pad_yaw_rad)
        self.battery = float(rng.uniform(*scenario.drones.battery))
        self._drain_per_s = scenario.drones.battery_drain_per_min / 60.0
        self.wind = (0.0, 0.0)
        self.motors_on = False
        self.wanted: tuple[Vector3, float] = (_STILL, 0.0)
        self._tick_s = tick_s
        self._unrest = tuple(GaussMarkov(scenario.drones.air_unrest_m_s2, 0.8, tick_s, draw) for _ in range(2))
        self._expected, self._trim = [0.0, 0.0], [0.0, 0.0]
        self.senses = FlowSensors(scenario.drones, tick_s, self.airframe, rng)

    @property
    def autopilot(self) -> "TelloBody":
        """Return itself."""
        return self

    @property
    def airborne(self) -> bool:
        """Return whether it has no contact with the floor."""
        return not self.airframe.on_ground

    def step(self, wake: Vector3) -> None:
        """Advance by one tick under the wake of the others [m/s^2; world]."""
        body, dt = self.airframe, self._tick_s
        if not self.motors_on:
            if body.on_ground:
                return
            acceleration = (0.0, 0.0, -GRAVITY_M_S2)
        else:
            if body.on_ground and self.wanted[0][2] <= 0.0:
                return
            self.battery = max(0.0, self.battery - self._drain_per_s * dt)
            acceleration = self._pursue(wake)
        body.ax, body.ay, body.az = acceleration
        body.yaw_rate += (self.wanted[1] - body.yaw_rate) * dt / _TURN_S
        body.yaw = math.remainder(body.yaw + body.yaw_rate * dt, math.tau)
        if body.advance(dt):
            self._expected, self._trim = [0.0, 0.0], [0.0, 0.0]

    def _pursue(self, wake: Vector3) -> Vector3:
        body, (forward, left, up) = self.airframe, self.wanted[0]
        senses = self.senses
        ahead, aside, _ = senses.velocity
        pull = [self._pull(0, forward, ahead), self._pull(1, left, aside)]
        for name, tilt in (("pitch", math.atan(pull[0] / GRAVITY_M_S2)), ("roll", math.atan(-pull[1] / GRAVITY_M_S2))):
            rate = (tilt - getattr(senses, name)) / _TILT_S
            setattr(body, f"{name}_rate", rate)
            setattr(body, name, getattr(body, name) + rate * self._tick_s)
        a, b = GRAVITY_M_S2 * math.tan(body.pitch), -GRAVITY_M_S2 * math.tan(body.roll)
        c, s = math.cos(body.yaw), math.sin(body.yaw)
        push = [self._unrest[i].step() + wake[i] + self.wind[i] for i in range(2)]
        return c * a - s * b + push[0], s * a + c * b + push[1], (up - body.vz) / _CLIMB_S + wake[2]

    def _pull(self, axis: int, wanted_m_s: float, felt_m_s: float) -> float:
        """Return the acceleration towards a velocity, including the trim by the velocity expected by now."""
        expected, trim = self._expected, self._trim
        expected[axis] += (wanted_m_s - expected[axis]) * self._tick_s / _RESPONSE_S
        trim[axis] += _TRIM_PER_S2 * (expected[axis] - felt_m_s) * self._tick_s
        trim[axis] = max(-_MOST_TRIM_M_S2, min(_MOST_TRIM_M_S2, trim[axis]))
        pull = (wanted_m_s - felt_m_s) / _RESPONSE_S + trim[axis]
        return max(-_MOST_M_S2, min(_MOST_M_S2, pull))

    def sense(self) -> None:
        """Let its sensors measure the motion of this tick."""
        self.senses.step(self.airframe, self.motors_on)

    def wake_on(self, other: Airframe) -> Vector3 | None:
        """Return the acceleration of a body below by its downwash, None out of its reach."""
        return wake_between(self.airframe, other)


class TelloEmulator:
    """Socket and orders of one body; `sim_bridge.world.emulation.Emulator`."""

    def __init__(self, name: str, address: str, body: TelloBody, wrong: WrongValues | None = None) -> None:
        self.silent = self.deaf = False
        self._body, self._wrong = body, wrong
        self._socket = open_udp(f"emulated {name}", address, COMMAND_PORT)
        self._partner: tuple[str, int] | None = None
        self._streams = False
        self._order, self._sticks = b"", _CENTRED
        self._ticks = self._quiet_ticks = self._motor_ticks = 0

    @property
    def video_settings(self) -> tuple[str, ...]:
        """Return the receiver of its video: the address that sent `command`, once `streamon` was sent."""
        return (self._partner[0],) if self._streams and self._partner is not None else ()

    def fileno(self) -> int:
        """Return the descriptor of its port."""
        return self._socket.fileno()

    def receive(self) -> None:
        """Take all waiting commands."""
        for _ in range(_DATAGRAMS_PER_TICK):
            try:
                data, source = self._socket.recvfrom(2048)
            except OSError:
                return
            if not self.deaf:
                self._take(data.strip(), source)

    def _take(self, data: bytes, source: tuple[str, int]) -> None:
        sticks = parse_rc(data)
        if data == SDK:
            self._partner = source
        elif self._partner is None or (sticks is None and data not in _WORDS):
            self._answer(source, b"unknown command: " + data[:32])
            return
        self._quiet_ticks = 0
        if sticks is not None:
            self._fly(sticks)
            return
        if data in (STREAM_ON, STREAM_OFF):
            self._streams = data == STREAM_ON
        elif data == EMERGENCY:
            self._body.motors_on, self._order = False, b""
        elif data == LAND and self._body.motors_on:
            self._order = LAND
        elif data == TAKE_OFF and not self._body.motors_on:
            self._order, self._body.motors_on = TAKE_OFF, True
        elif data == STOP and not self._order:
            self._fly((0, 0, 0, 0))
        if data not in (TAKE_OFF, LAND):
            self._answer(source, OK)

    def _fly(self, sticks: tuple[int, int, int, int]) -> None:
        if self._order == TAKE_OFF or not self._body.motors_on:
            return
        right, forward, up, clockwise = (stick / 100 for stick in sticks)
        turn = -clockwise * _FULL_TURN_RAD_S
        self._sticks = ((forward * _FULL_M_S, -right * _FULL_M_S, up * _FULL_M_S), turn)
        if not self._order:
            self._body.wanted = self._sticks

    def send(self) -> None:
        """End a tick: continue the present order, and send the state when it is due."""
        self._ticks += 1
        self._quiet_ticks += 1
        body = self._body
        if body.motors_on:
            self._motor_ticks += 1
            if self._quiet_ticks * _TICK_S > _QUIET_S:
                self._order = LAND
            self._obey()
        if self._ticks % _STATE_TICKS == 0 and self._partner is not None and not self.silent:
            with suppress(OSError):
                self._socket.sendto(state_text(self._state()), (self._partner[0], STATE_PORT))

    def _obey(self) -> None:
        body = self._body
        if self._order == TAKE_OFF:
            body.wanted = ((0.0, 0.0, 0.5), 0.0)
            if body.airframe.z >= _TAKE_OFF_M:
                self._done()
        elif self._order == LAND:
            (forward, left, _), turn = self._sticks
            body.wanted = ((forward, left, -_DESCENT_M_S), turn)
            if not body.airborne:
                body.motors_on = False
                self._done()

    def _done(self) -> None:
        self._order, self._sticks, self._body.wanted = b"", _CENTRED, _CENTRED
        if self._partner is not None:
            self._answer(self._partner, OK)

    def _answer(self, source: tuple[str, int], words: bytes) -> None:
        if not self.silent:
            with suppress(OSError):
                self._socket.sendto(words, source)

    def _state(self) -> State:
        told = self._body.senses.readings(self._ticks, self._body.battery)
        if self._wrong:
            told = self._wrong.report(self._ticks * _TICK_S, told)
        c, s = math.cos(told.yaw), math.sin(told.yaw)
        north, west = c * told.vx - s * told.vy, s * told.vx + c * told.vy
        ax, ay, az = (1000.0 * one / GRAVITY_M_S2 for one in told.accelerometers)
        height = round(100 * (told.height - STANDING_HEIGHT_M)) - _H_LOW_CM
        return State(
            pitch=round(-math.degrees(told.pitch)),
            roll=round(math.degrees(told.roll)),
            yaw=round(-math.degrees(math.remainder(told.yaw, math.tau))),
            velocity=(round(10 * north), round(-10 * west), round(-10 * told.vz)),
            tof=max(10, round(100 * told.height)) if self._motor_ticks else NO_ECHO_CM,
            height=max(0, height // _H_STEP_CM * _H_STEP_CM),
            battery=round(100 * told.battery),
            time=round(self._motor_ticks * _TICK_S),
            acceleration=(ax, -ay, -az),
        )

    def close(self) -> None:
        """Close the port."""
        self._socket.close()


class TelloEmulation:
    """Tellos; `sim_bridge.world.emulation.Emulation`."""

    def body(self, drone: SiteDrone, scenario: Scenario, tick_s: float, rng: np.random.Generator) -> TelloBody:
        """Return a Tello on its pad."""
        return TelloBody(drone, scenario, tick_s, rng)

    def video(self, name: str, scenario: Scenario) -> OwnVideo:
        """Return its video."""
        return OwnVideo("sim_bridge.render.tello_output:TelloOutput", repeats=False, listens=False)

    def open(self, name: str, body: TelloBody, onboard: None, order: LaunchSpec) -> TelloEmulator:
        """Return the listening emulator of a Tello."""
        return TelloEmulator(name, order.addresses[name], body, wrong_values_of(order.scenario.faults, name))


EMULATION = TelloEmulation()
