"""What a decision of the watchdog means to PX4 and ArduPilot: modes, arming, take-off, set-points, landing. Pure.

Each setpoint of the tracker goes out once, at most setpoint_hz times a second, and zero velocity while hovering. What
sends is our own loop: when it stands still, nothing is sent and the vehicle's own time-out acts.
"""

from collections import deque

from drivers.mavlink.convert import setpoint_from_velocity
from drivers.mavlink.requests import Requests
from drivers.mavlink.settings import VehicleSettings, VisionFeedback
from drivers.mavlink.wire.flight import SetPositionTargetLocalNed
from drivers.mavlink.wire.names import ARMED, FORCE, Flavour, Landed, MavCmd, guided_mode, land_mode, mode_name
from drivers.watchdog_types import Action, DriverMode, WatchdogDecision
from groundstation.bus.messages import Vector3

_STREAM_FIRST_NS = 1_200_000_000
_CLIMB_LIMIT_NS = 8_000_000_000
_TAKEN_OVER_NS = 1_500_000_000
_REGAIN_NS = 1_400_000_000
_STILL: Vector3 = (0.0, 0.0, 0.0)
_WARNING = 4
_CLIMBED = 0.9


class Orders:
    """Keeps what was asked of one vehicle. events: (severity, text) for the operator; said: its own STATUSTEXT."""

    def __init__(self, vehicle: VehicleSettings, flavour: Flavour, vision: VisionFeedback, requests: Requests) -> None:
        self.events: deque[tuple[int, str]] = deque(maxlen=32)
        self.said: deque[tuple[int, str]] = deque(maxlen=8)
        self.detail = ""
        self.starting = False
        self._vehicle, self._flavour, self._vision, self._requests = vehicle, flavour, vision, requests
        self._guided, self._landing = guided_mode(flavour), land_mode(flavour)
        self._period_ns = round(1e9 / vehicle.setpoint_hz)
        self._action = Action.WAIT
        self._since_ns = 0
        self._climb_until_ns = 0
        self._due_ns = 0
        self._told_ns = -1
        self._guided_ns = self._regain_until_ns = 0
        self._taken_over = False
        self._blind_landing = False

    def are_heeded(self, custom_mode: int) -> bool:
        """Return whether the vehicle flies by our set-points, and not for a pilot or by itself."""
        return custom_mode == self._guided and not self._taken_over

    def failsafe_datagrams(self) -> str:
        """Return what the vehicle said of late, to go with a refusal."""
        return f" ({self.said[-1][1]})" if self.said else ""

    def step(
        self, now_ns: int, decision: WatchdogDecision, base_mode: int, custom_mode: int, landed: int, height_m: float,
        lost_s: float,
    ) -> SetPositionTargetLocalNed | None:  # fmt: skip
        """Return the set-point to send now, if any; commands are asked through the requests."""
        armed, guided = bool(base_mode & ARMED), custom_mode == self._guided
        action = self._without_position(decision.action, lost_s)
        if action is not self._action:
            self._enter(now_ns, action)
        self._watch_mode(now_ns, action, armed, guided, custom_mode)
        match action:
            case Action.TAKE_OFF:
                return self._take_off(now_ns, armed, guided, landed)
            case Action.FLY:
                return self._fly(now_ns, decision, guided)
            case Action.HOVER:
                return self._hover(now_ns, decision.mode, guided, height_m)
            case Action.LAND:
                if armed and custom_mode != self._landing:
                    self._ask(now_ns, "landing", MavCmd.NAV_LAND)
                    # Until it obeys it must not fly on with the last velocity.
                    return self._send(now_ns, _STILL, 0.0) if guided else None
            case Action.CUT:
                if armed:
                    self._ask(now_ns, "motor cut", MavCmd.COMPONENT_ARM_DISARM, 0.0, FORCE)
            case Action.IDLE:
                if armed and landed == Landed.ON_GROUND:
                    self._ask(now_ns, "disarming", MavCmd.COMPONENT_ARM_DISARM, 0.0, 0.0)
            case Action.WAIT:
                pass
        return None

    def _without_position(self, action: Action, lost_s: float) -> Action:
        flying = action in (Action.FLY, Action.HOVER)
        if not flying or lost_s < self._vision.hover_after_s:
            self.detail = ""
            self._blind_landing = self._blind_landing and flying
        elif lost_s >= self._vision.land_after_s:
            if not self._blind_landing:
                self.events.append((3, f"no position from the cameras for {lost_s:.1f} s: landing"))
            self._blind_landing = True
        else:
            self.detail = f"no position from the cameras for {lost_s:.1f} s"
            action = Action.HOVER
        return Action.LAND if self._blind_landing else action

    def _enter(self, now_ns: int, action: Action) -> None:
        if action is Action.TAKE_OFF:
            self.starting, self._climb_until_ns = True, now_ns + 2 * _CLIMB_LIMIT_NS
            self._requests.accepted.discard("take-off")  # once per start: a second one would begin its spool-up anew
        elif action is not Action.HOVER or self._action is not Action.TAKE_OFF:
            self.starting, self._climb_until_ns = False, 0
        else:
            self.starting, self._climb_until_ns = False, now_ns + _CLIMB_LIMIT_NS
        if action in (Action.LAND, Action.CUT, Action.IDLE):
            self._requests.drop("arming", "guided mode", "take-off")
        if action is Action.FLY:
            self._taken_over = False  # an operator's TRACK or RESUME: ask for the mode once more
            self._guided_ns, self._regain_until_ns = now_ns, now_ns + _REGAIN_NS
        self._action, self._since_ns = action, now_ns

    def _watch_mode(self, now_ns: int, action: Action, armed: bool, guided: bool, custom_mode: int) -> None:
        # A mode that we did not ask for is a pilot's or the autopilot's own: it is not fought over.
        if guided or not armed or action not in (Action.FLY, Action.HOVER):
            self._guided_ns = now_ns
            self._regain_until_ns = 0 if guided else self._regain_until_ns
        elif not self._taken_over and now_ns - self._guided_ns > _TAKEN_OVER_NS:
            self._taken_over = True
            text = f"{self._vehicle.name} is in {mode_name(self._flavour, custom_mode)}: not ours to fly until RESUME"
            self.events.append((_WARNING, text + self.failsafe_datagrams()))

    def _take_off(self, now_ns: int, armed: bool, guided: bool, landed: int) -> SetPositionTargetLocalNed | None:
        px4 = self._flavour is Flavour.PX4
        # WIRE (docs/reference/mavlink.md 5.2): PX4 needs a second of set-points before OFFBOARD, and arms in it.
        if px4 and now_ns - self._since_ns < _STREAM_FIRST_NS:
            return self._send(now_ns, _STILL, 0.0)
        if not guided:
            self._ask_guided(now_ns)
        elif not armed:
            self._ask(now_ns, "arming", MavCmd.COMPONENT_ARM_DISARM, 1.0)
        elif not px4 and landed == Landed.ON_GROUND and "take-off" not in self._requests.accepted:
            height = self._vehicle.take_off_m
            self._ask(now_ns, "take-off", MavCmd.NAV_TAKEOFF, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, height)
        if not px4:
            return None
        return self._send(now_ns, (0.0, 0.0, self._vehicle.limits.max_climb_m_s) if armed and guided else _STILL, 0.0)

    def _hover(self, now_ns: int, mode: DriverMode, guided: bool, height_m: float) -> SetPositionTargetLocalNed | None:
        if mode is not DriverMode.HOVER or height_m >= _CLIMBED * self._vehicle.take_off_m:
            self._climb_until_ns = 0
        if now_ns < self._climb_until_ns:
            # It has left the ground; it goes on to its take-off height (ArduPilot does so by itself).
            if self._flavour is Flavour.ARDUPILOT:
                return None
            return self._send(now_ns, (0.0, 0.0, self._vehicle.limits.max_climb_m_s), 0.0)
        return self._send(now_ns, _STILL, 0.0) if guided else None

    def _fly(self, now_ns: int, decision: WatchdogDecision, guided: bool) -> SetPositionTargetLocalNed | None:
        if not guided and now_ns < self._regain_until_ns:
            self._ask_guided(now_ns)
        if self._taken_over or decision.setpoint_ns == self._told_ns:
            return None
        message = self._send(now_ns, decision.velocity_m_s, decision.yaw_rate_rad_s)
        if message is not None:
            self._told_ns = decision.setpoint_ns
        return message

    def _ask_guided(self, now_ns: int) -> None:
        main = float(self._guided >> 16 if self._flavour is Flavour.PX4 else self._guided)
        self._ask(now_ns, "guided mode", MavCmd.DO_SET_MODE, 1.0, main)

    def _ask(self, now_ns: int, key: str, command: MavCmd, *params: float) -> None:
        self._requests.ask(now_ns, key, command, *params)

    def _send(self, now_ns: int, velocity_m_s: Vector3, yaw_rate: float) -> SetPositionTargetLocalNed | None:
        # A quarter of a period early is on time: the tracker's 50 Hz must come out as an even 20.
        if now_ns + self._period_ns // 4 < self._due_ns:
            return None
        self._due_ns = max(self._due_ns + self._period_ns, now_ns)
        vehicle = self._vehicle
        return setpoint_from_velocity(vehicle.system_id, now_ns, velocity_m_s, yaw_rate, vehicle.limits)
