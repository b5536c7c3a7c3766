"""Turns watchdog decisions into requests to PX4 and ArduPilot: modes, arming, take-off, setpoints, landing. Pure.

Each setpoint of the tracker goes out once, at most setpoint_hz times a second. A hovering vehicle is commanded to hold
the place where it comes to rest, or to which the tracker brings it, if the tracker knows that place; else zero
velocity. Our own loop sends: when it stands still, nothing is sent and the vehicle's own time-out acts.
"""

from collections import deque

from drivers.failsafe_table import Condition
from drivers.mavlink.convert import setpoint_from_velocity
from drivers.mavlink.drift import DriftFeedback
from drivers.mavlink.lift_off import LiftOff
from drivers.mavlink.mode_watch import KEY, STREAM_FIRST_NS, ModeWatch
from drivers.mavlink.motors import FELL, Motors
from drivers.mavlink.pilot import LandingPilot
from drivers.mavlink.requests import Requests
from drivers.mavlink.settings import VehicleSettings
from drivers.mavlink.texts import Explanations
from drivers.mavlink.wire.flight import SetPositionTargetLocalNed
from drivers.mavlink.wire.names import (
    ARMED,
    FORCE,
    Flavour,
    Landed,
    MavCmd,
    MavSeverity,
    guided_mode,
    land_mode,
    mode_name,
)
from drivers.thinning import Decimator
from drivers.watchdog_types import Action, DriverMode, WatchdogDecision
from groundstation.bus.messages import EntityEstimate, Vector3
from groundstation.time_units import NS_PER_MS, NS_PER_S

_CLIMB_LIMIT_NS = 8 * NS_PER_S
_STILL: Vector3 = (0.0, 0.0, 0.0)
# The end of a climb is slower, so that it stops at the requested height.
_CLIMBED, _CLIMB_GAIN, _LEAST_CLIMB_M_S = 0.95, 1.2, 0.12
# Below this speed a climb that HOLD ended is over; one that has just begun speeds up until the vehicle obeys.
_STOPPED_M_S, _OBEYS_NS = 0.1, 500 * NS_PER_MS
_OWN_START_NS = 3 * NS_PER_S  # a start of our own that was broken off is told by then


def _sideways(back_m_s: Vector3 | None) -> tuple[float, float] | None:
    """Return the horizontal part of a way back, if it has one: these vehicles hold their height by themselves."""
    return back_m_s[:2] if back_m_s is not None and any(back_m_s[:2]) else None


class Orders:
    """Makes the requests to one vehicle. events: (severity, text) for the operator; said: its texts."""

    def __init__(self, vehicle: VehicleSettings, flavour: Flavour, requests: Requests) -> None:
        self.events: deque[tuple[int, str]] = deque(maxlen=32)
        self.said = Explanations()
        self.starting = False
        self.pilot = LandingPilot(flavour)
        self.lift = LiftOff()
        self.drift = DriftFeedback()
        self.motors = Motors()
        self._vehicle, self._flavour, self._requests = vehicle, flavour, requests
        self._guided, self._landing = guided_mode(flavour), land_mode(flavour)
        self._pace = Decimator(vehicle.setpoint_hz)
        self._action = Action.WAIT
        self._since_ns = 0
        self._climb_until_ns = 0
        self._rises_to_take_off = self._stops_climbing = False
        self._told_ns = -1
        self._mode = ModeWatch(flavour, requests)
        self._started = False
        self._why = ""
        self._ordered_ns = self._landing_ns = -1

    def are_heeded(self, now_ns: int, custom_mode: int) -> bool:
        """Return whether the vehicle obeys our setpoints, not a pilot's or its own."""
        return custom_mode == self._guided and not self._mode.taken_over and not self.climbs_by_itself(now_ns)

    @property
    def yields(self) -> str:
        """Return why it is not ours to fly, "" while it is."""
        return self._why if self._mode.taken_over and self._action in (Action.FLY, Action.HOVER) else ""

    def climbs_by_itself(self, now_ns: int) -> bool:
        """Return whether the vehicle ends its take-off by itself, without setpoints."""
        return self._flavour is Flavour.ARDUPILOT and self.rises(now_ns)

    def rises(self, now_ns: int) -> bool:
        """Return whether it continues to its take-off height, by itself or by our setpoints."""
        return self._action is Action.HOVER and self._rises_to_take_off and now_ns < self._climb_until_ns

    def see(self, now_ns: int, good: EntityEstimate, reported_m_s: Vector3 | None) -> bool:
        """Take a good estimate and the velocity [base_stabilized] reported at that time; return whether both count.

        They count as soon as its motors turn on the floor: if it leaned against a false velocity it would slide off.
        """
        lifted = self.lift.lifted
        if not lifted:
            self.lift.see(now_ns, (good.mean[0], good.mean[1], good.mean[2]), good.age_s)
        if reported_m_s is None or not (lifted or self.starting):
            return False
        self.drift.take(now_ns, good, reported_m_s)
        return True

    def step(
        self, now_ns: int, decision: WatchdogDecision, base_mode: int, custom_mode: int, landed: int, height_m: float,
        climb_m_s: float = 0.0,
    ) -> SetPositionTargetLocalNed | None:  # fmt: skip
        """Return the setpoint to send now, if any; commands go through the requests."""
        armed, guided = bool(base_mode & ARMED), custom_mode == self._guided
        self._watch_motors(now_ns, decision.action, armed)
        climbed_m = self._climbed(now_ns, landed, height_m, climb_m_s)
        action = decision.action
        if action is not self._action:
            self._enter(now_ns, action)
        if action is Action.FLY and decision.entered_ns != self._ordered_ns:
            self._ordered_ns = decision.entered_ns  # TRACK or RESUME; returning setpoints are no order
            self._mode.take_back(now_ns)
            self._end_pause(now_ns, guided)
        if self._mode.is_lost(now_ns, guided, armed and action in (Action.FLY, Action.HOVER)):
            self._yield(now_ns, f"is in {mode_name(self._flavour, custom_mode)}")
        own_climb = action is Action.TAKE_OFF and self._flavour is Flavour.ARDUPILOT
        strays = decision.failsafe in (Condition.STRAYS, Condition.STRAYS_AGAIN)
        if own_climb or strays or not self.are_heeded(now_ns, custom_mode):
            self.drift.forget_undershoot()
        match action:
            case Action.TAKE_OFF:
                self._watch_start(now_ns, armed, guided, custom_mode)
                return None if self._mode.taken_over else self._take_off(now_ns, armed, guided, landed, climbed_m)
            case Action.FLY:
                return self._fly(now_ns, decision, guided)
            case Action.HOVER:
                self._end_climb(now_ns, decision.mode, climb_m_s)
                return self._hover(now_ns, guided, climbed_m, _sideways(decision.back_m_s))
            case Action.LAND:
                return self._land(now_ns, decision, armed, guided, custom_mode)
            case Action.CUT:
                if armed:
                    self._ask(now_ns, "motor cut", MavCmd.COMPONENT_ARM_DISARM, 0.0, FORCE)
                return self._stand(now_ns) if armed and guided else None
            case Action.IDLE:
                if armed and landed == Landed.ON_GROUND:
                    self._ask(now_ns, "disarming", MavCmd.COMPONENT_ARM_DISARM, 0.0, 0.0)
                if self.motors.started and now_ns - self._since_ns > _OWN_START_NS:
                    self.events.append((MavSeverity.INFO, "its motors were started, not by us: it will be disarmed"))
            case Action.WAIT:
                pass
        return None

    def _climbed(self, now_ns: int, landed: int, reported_m: float, climb_m_s: float) -> float:
        """Return the height above the floor [m]: from the tracker, else the vehicle's own since lift-off."""
        risen_m = self.lift.take(now_ns, self.starting, landed, reported_m, climb_m_s)
        if self.lift.lifted:
            self.drift.lift()
        elif self.starting:
            self.drift.stand(now_ns)
        else:
            self.drift.reset()
        believed = self.drift.place(now_ns)
        return risen_m if believed is None else believed[2] - self._floor_m

    @property
    def _floor_m(self) -> float:
        """Return the height [m; world] at which the tracker had it standing.

        Its own origin is some centimetres higher.
        """
        return self.lift.stood[2] if self.lift.stood is not None else 0.0

    def _enter(self, now_ns: int, action: Action) -> None:
        self.drift.let_go()
        # The first hover after a take-off continues to the requested height.
        starts = action is Action.TAKE_OFF or (self._rises_to_take_off and action is Action.HOVER)
        self._rises_to_take_off, self._stops_climbing = starts, False
        if action is Action.TAKE_OFF:
            self.starting, self._climb_until_ns = True, now_ns + 2 * _CLIMB_LIMIT_NS
            self._started = self._mode.taken_over = self.motors.fell = False
            self._requests.accepted -= {"arming", "take-off"}  # once per start: a second request restarts its spool-up
            self._requests.drop("motor cut", "disarming", "landing")
        elif action is not Action.HOVER or self._action is not Action.TAKE_OFF:
            self.starting, self._climb_until_ns = False, 0
        else:
            self.starting, self._climb_until_ns = False, now_ns + _CLIMB_LIMIT_NS
        if action in (Action.LAND, Action.CUT, Action.IDLE):
            self._requests.drop("arming", KEY, "take-off", "going on")
        if action is Action.LAND:
            self._requests.accepted.discard("landing")
        self._action, self._since_ns = action, now_ns

    def _yield(self, now_ns: int, why: str) -> None:
        self._mode.taken_over, self._why = True, f"it {why}: not ours to fly until RESUME"
        self.events.append((MavSeverity.WARNING, self._why + self.said.of(self._mode.guided_ns, now_ns)))

    def _end_pause(self, now_ns: int, guided: bool) -> None:
        # WIRE (ArduCopter 4.7, DO_PAUSE_CONTINUE): paused by another station it stays GUIDED, deaf to velocities.
        if guided and self._flavour is Flavour.ARDUPILOT:
            self._ask(now_ns, "going on", MavCmd.DO_PAUSE_CONTINUE, 1.0)

    def _land(
        self, now_ns: int, decision: WatchdogDecision, armed: bool, guided: bool, custom_mode: int
    ) -> SetPositionTargetLocalNed | None:
        if decision.mode is DriverMode.LANDING and decision.entered_ns != self._landing_ns:
            self._landing_ns = decision.entered_ns
            self._requests.accepted.discard("landing")
            self.pilot.start_over()
        # A commanded landing is enforced until accepted once; after that, or in a failsafe, a pilot may take over.
        begun = bool(decision.failsafe) or "landing" in self._requests.accepted
        if armed and begun and self.pilot.lands(now_ns, custom_mode):
            self._requests.drop("landing")
            if self.pilot.is_news(now_ns):
                name = mode_name(self._flavour, custom_mode)
                self.events.append((MavSeverity.WARNING, f"it is in {name}: its pilot lands it, nobody else does"))
            return None
        # A report that it lands already or has disarmed may be wrong: it is commanded until it has once accepted.
        if "landing" not in self._requests.accepted or (armed and custom_mode != self._landing):
            self._ask(now_ns, "landing", MavCmd.NAV_LAND)
        # Until it obeys it must not fly on at the last velocity.
        return self._stand(now_ns) if armed and guided else None

    def _watch_motors(self, now_ns: int, action: Action, armed: bool) -> None:
        place = self.drift.place(now_ns) if self.lift.lifted else None
        height_m = 0.0 if place is None else place[2] - self._floor_m
        if self.motors.stop_aloft(now_ns, armed, height_m, cut=action is Action.CUT):
            self.events.append((MavSeverity.ERROR, FELL))

    def start_failed(self, now_ns: int) -> None:
        """Give up a take-off of a vehicle that was started anew meanwhile: its estimator has to settle first."""
        if self._action is Action.TAKE_OFF and not self._mode.taken_over:
            self._requests.drop("arming", KEY, "take-off")
            self._yield(now_ns, "was started anew while it takes off")

    def _watch_start(self, now_ns: int, armed: bool, guided: bool, custom_mode: int) -> None:
        # Only a pilot, a second ground station or the autopilot itself ends a begun take-off: a second request would
        # make it climb against their stop.
        if armed and (guided or "arming" in self._requests.accepted):
            self._started = True
        if self._started and not (armed and guided) and not self._mode.taken_over:
            mode = f"is in {mode_name(self._flavour, custom_mode)}" if armed else "was disarmed"
            self._requests.drop("arming", KEY, "take-off")
            self._yield(now_ns, f"{mode} while it takes off")

    def _take_off(
        self, now_ns: int, armed: bool, guided: bool, landed: int, climbed_m: float
    ) -> SetPositionTargetLocalNed | None:
        px4 = self._flavour is Flavour.PX4
        # WIRE (docs/reference/mavlink.md 5.2): PX4 needs a second of setpoints before OFFBOARD, and arms in it.
        if px4 and now_ns - self._since_ns < STREAM_FIRST_NS:
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
        return self._climb(now_ns, climbed_m) if armed and guided else self._send(now_ns, _STILL, 0.0)

    def _climb(self, now_ns: int, climbed_m: float) -> SetPositionTargetLocalNed | None:
        left_m = self._vehicle.take_off_m - climbed_m
        up = min(self._vehicle.limits.max_climb_m_s, max(_LEAST_CLIMB_M_S, _CLIMB_GAIN * left_m))
        if self.lift.stood is not None:
            self.drift.hold_at(self.lift.stood)
        forward, left, _ = self.drift.hold(now_ns)
        return self._send(now_ns, (forward, left, up), 0.0)

    def _stand(
        self, now_ns: int, height_m: float | None = None, back: tuple[float, float] | None = None
    ) -> SetPositionTargetLocalNed | None:
        return self._send(now_ns, self.drift.hold(now_ns, height_m, back), 0.0)

    def _end_climb(self, now_ns: int, mode: DriverMode, climb_m_s: float) -> None:
        """Have a climb end at HOLD: no higher than its momentum takes it, and not back to the floor either."""
        if mode is not DriverMode.HOVER and self._rises_to_take_off:
            self._rises_to_take_off, self._stops_climbing = False, True
            self._requests.drop("arming", KEY, "take-off")
        if self._stops_climbing:
            self.drift.let_go()
            self._stops_climbing = climb_m_s > _STOPPED_M_S or now_ns - self._since_ns < _OBEYS_NS

    def _hover(
        self, now_ns: int, guided: bool, climbed_m: float, back: tuple[float, float] | None
    ) -> SetPositionTargetLocalNed | None:
        if not self._rises_to_take_off or climbed_m >= _CLIMBED * self._vehicle.take_off_m:
            self._climb_until_ns = 0
        if self.climbs_by_itself(now_ns):
            return None
        if now_ns < self._climb_until_ns:  # the vehicle has left the ground, and continues to its take-off height
            return self._climb(now_ns, climbed_m)
        if not guided and not self._mode.is_promised(now_ns):
            return None
        height_m = self._floor_m + self._vehicle.take_off_m if self._rises_to_take_off else None
        return self._stand(now_ns, height_m, back)

    def _fly(self, now_ns: int, decision: WatchdogDecision, guided: bool) -> SetPositionTargetLocalNed | None:
        if not guided and self._mode.asks(now_ns):
            self._ask_guided(now_ns)
        if self._mode.taken_over or decision.setpoint_ns == self._told_ns:
            return None
        message = self._send(now_ns, decision.velocity_m_s, decision.yaw_rate_rad_s)
        if message is not None:
            self._told_ns = decision.setpoint_ns
        return message

    def _ask_guided(self, now_ns: int) -> None:
        main = float(self._guided >> 16 if self._flavour is Flavour.PX4 else self._guided)
        self._ask(now_ns, KEY, MavCmd.DO_SET_MODE, 1.0, main)

    def _ask(self, now_ns: int, key: str, command: MavCmd, *params: float) -> None:
        self._requests.ask(now_ns, key, command, *params)

    def _send(self, now_ns: int, velocity_m_s: Vector3, yaw_rate: float) -> SetPositionTargetLocalNed | None:
        if not self._pace.is_due(now_ns):  # the tracker's 50 Hz must become an even 20
            return None
        vehicle = self._vehicle
        allowed, _ = vehicle.limits.within(velocity_m_s, yaw_rate)
        correction = self.drift.correction(now_ns)
        self.drift.note_command(now_ns, allowed)
        return setpoint_from_velocity(vehicle.system_id, now_ns, velocity_m_s, yaw_rate, vehicle.limits, correction)
