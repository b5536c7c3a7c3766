"""The output edge of an emulated AR.Drone: correct navdata, and navdata under a fault."""

import math

from sim_bridge.devices.ardrone_control import FlightControl
from sim_bridge.devices.ardrone_navdata import NavdataState, Readable
from sim_bridge.devices.ardrone_state import control_state, state_word
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.ardrone_autopilot import Phase
from sim_bridge.world.ardrone_motors import flight_pwm, ramp_pwm
from sim_bridge.world.ardrone_sensors import Onboard
from sim_bridge.world.readings import Readings
from sim_bridge.world.world import TICK_NS
from sim_bridge.wrong_values import WrongValues


def pwm_of(drone: Quadrotor) -> tuple[int, int, int, int]:
    """Return the commands of the four motors."""
    autopilot, body = drone.autopilot, drone.airframe
    if not autopilot.motors_on:
        return 0, 0, 0, 0
    if autopilot.phase is Phase.TAKING_OFF and body.on_ground:
        pwm = ramp_pwm(autopilot.since_s)
    else:
        pwm = flight_pwm(body.az, math.hypot(body.roll, body.pitch))
    return pwm, pwm, pwm, pwm


def readings_of(onboard: Onboard, ticks: int, state: NavdataState) -> Readings:
    """Return the present sensor readings and state, as a value."""
    status = (state.word, state.control_state, state.pwm, state.pcmd_sequence, state.at_sequence, state.at_gap_ms)
    return Readings(
        ticks, (onboard.vx, onboard.vy, onboard.vz), onboard.roll, onboard.pitch, onboard.yaw, onboard.gyros,
        onboard.accelerometers, onboard.battery, onboard.height, onboard.echo, onboard.rejected, status=status,
    )  # fmt: skip


class ArDroneEdge:
    """Call `step` once per tick, then `reported` for each packet."""

    def __init__(
        self, drone: Quadrotor, onboard: Onboard, control: FlightControl, wrong: WrongValues | None = None
    ) -> None:
        self._drone, self._onboard, self._control = drone, onboard, control
        self._wrong = wrong or None
        self._reported: Readings | None = None
        self._now_ns = 0

    def step(self, now_ns: int) -> None:
        """Pass the readings of one tick through the faults; now_ns: the vehicle's time since power-on."""
        self._now_ns = now_ns
        if self._wrong is not None:
            honest = readings_of(self._onboard, now_ns // TICK_NS, self._state())
            self._reported = self._wrong.report(now_ns / 1e9, honest)

    def reported(self, ticks: int) -> tuple[NavdataState, Readable, int]:
        """Return state, readings and clock as they are reported; ticks: the honest clock."""
        if self._reported is None:
            return self._state(), self._onboard, ticks
        return NavdataState(*self._reported.status), self._reported, self._reported.ticks

    def _state(self) -> NavdataState:
        control, session = self._control, self._control.session
        return NavdataState(
            state_word(self._drone, control, self._now_ns, bootstrap=False),
            control_state(self._drone, control, self._now_ns),
            pwm_of(self._drone),
            control.pcmd_sequence,
            session.at_sequence,
            session.mean_gap_ms,
        )
