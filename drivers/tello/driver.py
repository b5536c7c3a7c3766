"""The Tello driver: the vehicle's reports, its orders from decisions, and the process entry `run`."""

import math
from collections import deque
from dataclasses import dataclass, replace

from drivers.base import HostProcess, LinkHealth, read_section
from drivers.datagram_link import DatagramLink, DatagramVehicle
from drivers.datagrams import DatagramLog
from drivers.host import fly_one
from drivers.plausibility.health import SUSPECT_VELOCITY_STD_M_S, Health, Sensor
from drivers.plausibility.limits import PlausibilityLimits
from drivers.plausibility.motion import MotionMonitor, MotionSample
from drivers.tello.height import best_height
from drivers.tello.settings import FASTEST_M_S, TelloDriverSettings
from drivers.tello.wire import text
from drivers.watchdog_types import REFUSABLE, Action, VehicleView, WatchdogDecision
from groundstation.adapters import with_zone
from groundstation.bus.api import Bus
from groundstation.bus.messages import FlightState, Odometry, Vector3
from groundstation.bus.topics import ODOMETRY
from groundstation.time_units import NS_PER_MS, NS_PER_S

RATE_HZ = 20.0
_FRESH_NS = 300 * NS_PER_MS
# A take-off that is called off may still begin for this long after its order.
_BEGINS_NS = 5 * NS_PER_S
# The motors' time is reported in whole seconds.
_MOTORS_NS = 1_300 * NS_PER_MS
# Off the floor and no faster than this upwards or downwards for so long, a take-off is over, answered or not.
_LEVEL_DM_S, _LEVEL_NS = 2, 2 * NS_PER_S
# Answers name no word: `takeoff` waits so long for those to earlier ones.
_ANSWERS_NS = NS_PER_S
_STEP_STD_M_S = 0.03  # of a velocity in steps of 0.1 m/s
_STILL_M_S = 0.25
# Orders are repeated until they are obeyed; `command` keeps a standing vehicle awake.
_PAUSE_NS = {
    text.SDK: NS_PER_S,
    text.TAKE_OFF: 4 * NS_PER_S,
    text.LAND: 500 * NS_PER_MS,
    text.EMERGENCY: 100 * NS_PER_MS,
    text.STREAM_ON: 3 * NS_PER_S,
}
# Whole numbers at 10 Hz: a single standing value means nothing; the accelerations of all three axes never stand.
LIMITS = PlausibilityLimits(
    speed_m_s=FASTEST_M_S, frozen_s=0.6, stuck_s=math.inf, stuck_alone_s=math.inf, jump_m_s=0.8, stirs_on_floor=False
)


@dataclass(frozen=True, slots=True)
class Heard:
    """The newest state of the vehicle; times 0: never.

    motors_ns: when the motors' time last rose; level_ns: since when it has been off the floor without a climb.
    """

    heard_ns: int = 0
    motors_ns: int = 0
    state: text.State | None = None
    velocity_m_s: Vector3 = (0.0, 0.0, 0.0)
    level_ns: int = 0

    def next(self, now_ns: int, state: text.State) -> "Heard":
        """Return what is known after a further state."""
        ran = self.state is not None and state.time > self.state.time
        level = best_height(state).off_floor and abs(state.velocity[2]) <= _LEVEL_DM_S
        level_ns = (self.level_ns or now_ns) if level else 0
        return Heard(now_ns, now_ns if ran else self.motors_ns, state, velocity_from_state(state), level_ns)

    def airborne(self, now_ns: int) -> bool:
        """Return whether it flies, by its height and its motors."""
        return self.off_floor or (self.motors_ns > 0 and now_ns - self.motors_ns < _MOTORS_NS)

    @property
    def off_floor(self) -> bool:
        """Return whether it flies, by its height alone."""
        return self.state is not None and best_height(self.state).off_floor

    def has_climbed(self, now_ns: int, answered: bool) -> bool:
        """Return whether a take-off is over: done by its answer and its height, or without a climb for a while."""
        if self.state is None or not self.off_floor:
            return False
        if answered and best_height(self.state).risen:
            return True
        return self.level_ns > 0 and now_ns - self.level_ns >= _LEVEL_NS


def velocity_from_state(state: text.State) -> Vector3:
    """Return the velocity [m/s; base_stabilized, FLU]."""
    north, east, down = (0.1 * speed for speed in state.velocity)
    c, s = math.cos(math.radians(state.yaw)), math.sin(math.radians(state.yaw))
    return c * north + s * east, s * north - c * east, -down


class Tello(DatagramVehicle):
    """One Tello behind its two ports; `drivers.base.Vehicle`."""

    def __init__(self, settings: TelloDriverSettings, bus: Bus) -> None:
        self.name, self.address = settings.name, with_zone(settings.address, settings.interface)
        self.heard = Heard()
        self._settings, self._bus = settings, bus
        self._ready = False
        self._asked, self._asked_ns = Action.WAIT, 0
        self._refused, self._took_off = "", False
        self._sent_ns: dict[bytes, int] = {}
        self._answers: deque[bytes] = deque(maxlen=16)
        self._owed, self._owed_ns = 0, 0
        self._plausibility = MotionMonitor(LIMITS)
        here = settings.tello.local_address
        self._link = DatagramLink(
            DatagramLog(bus, settings.name, settings.raw_datagrams),
            (settings.address, text.COMMAND_PORT),
            {(here, 0): self._hear_answer, (here, text.STATE_PORT): self._hear_state},
            settings.interface,
        )

    # -- reader thread ------------------------------------------------------------------------------------------------

    def _hear_answer(self, now_ns: int, data: bytes) -> bool:
        answer = data.strip().lower()
        self._ready = self._ready or answer == text.OK
        self._answers.append(answer)
        return False

    def _hear_state(self, now_ns: int, data: bytes) -> bool:
        state = text.parse_state(data)
        self.heard = self.heard.next(now_ns, state)
        self._publish(now_ns, state, self.heard.velocity_m_s)
        return True

    def _publish(self, now_ns: int, state: text.State, velocity: Vector3) -> None:
        roll, pitch, yaw = math.radians(state.roll), -math.radians(state.pitch), -math.radians(state.yaw)
        climb, counted = velocity[2], state.time
        sample = MotionSample(now_ns, velocity[:2], roll, pitch, state.acceleration, climb_m_s=climb, counted_s=counted)
        report = self._plausibility.update(sample, self._flight_state(now_ns))
        believed = report.of(Sensor.TELEMETRY, Sensor.CLOCK, Sensor.VELOCITY)
        if report.withheld or believed is Health.BAD:
            return
        variance = self._settings.velocity_std_m_s**2 + _STEP_STD_M_S**2
        if believed is Health.SUSPECT:
            variance = max(variance, SUSPECT_VELOCITY_STD_M_S**2)
        message = Odometry(
            header=self._bus.header(self.name, now_ns),
            velocity_m_s=velocity,
            velocity_covariance=(variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance),
            yaw_rad=yaw,
            roll_rad=roll,
            pitch_rad=pitch,
        )
        self._bus.publish(ODOMETRY, message)

    # -- sender loop --------------------------------------------------------------------------------------------------

    def _flight_state(self, now_ns: int) -> FlightState:
        if self.heard.state is None:
            return FlightState.UNKNOWN
        if not self.heard.airborne(now_ns):
            return FlightState.LANDED
        if self._asked is Action.LAND:
            return FlightState.LANDING
        if self._asked is Action.TAKE_OFF and not self.heard.has_climbed(now_ns, self._took_off):
            return FlightState.TAKING_OFF
        still = self._asked is Action.HOVER and math.hypot(*self.heard.velocity_m_s) < _STILL_M_S
        return FlightState.HOVERING if still else FlightState.FLYING

    def view(self, now_ns: int) -> VehicleView:
        """Return the vehicle's last reported state."""
        self._heed_answers()
        heard = self.heard
        fresh = heard.heard_ns > 0 and now_ns - heard.heard_ns < _FRESH_NS
        battery = None if heard.state is None else heard.state.battery / 100
        not_ready = "" if self._ready else "it has not answered `command`"
        unsound = self._plausibility.report.reason(Health.BAD, LIMITS.essential)
        scale, (x, y, z) = self._settings.velocity_scale, heard.velocity_m_s
        state = self._flight_state(now_ns)
        refuses = self._refused if self._asked is Action.TAKE_OFF else ""
        velocity = (scale * x, scale * y, z)
        return VehicleView(state, fresh, battery, not_ready, self._ready, unsound, velocity, refuses=refuses)

    def _heed_answers(self) -> None:
        """Take the answers that came; the first after a refusable word was sent is its own."""
        starts = self._asked is Action.TAKE_OFF
        while self._answers:
            answer = self._answers.popleft()
            self._owed = max(0, self._owed - 1)
            if starts and self._sent_ns.get(text.TAKE_OFF, 0) < self._asked_ns:
                continue
            if answer.startswith(text.ERROR) and self._asked in REFUSABLE and not (starts and self.heard.off_floor):
                self._refused = answer.decode("ascii", "replace")
            # `takeoff` is answered when it is done: an `ok` to one that stands is a late one to another word.
            self._took_off = self._took_off or (starts and answer == text.OK and self.heard.off_floor)

    def apply(self, now_ns: int, decision: WatchdogDecision) -> None:
        """Send the orders of a decision; sticks count only while it flies."""
        if decision.action is not self._asked:
            self._heed_answers()
            self._asked, self._asked_ns = decision.action, now_ns
            self._refused, self._took_off = "", False
        flies = self.heard.airborne(now_ns)
        match decision.action:
            case Action.CUT:
                self._repeat(now_ns, text.EMERGENCY)
                if flies:  # it must not fly on at its last velocity
                    self._link.send(now_ns, text.CENTRED)
            case Action.LAND:  # whether it flies or not: its report may be wrong
                self._land(now_ns)
            case Action.TAKE_OFF if not (flies or self._refused):
                self._take_off(now_ns)
            case Action.FLY if flies:
                self._link.send(now_ns, self._sticks(decision.velocity_m_s, decision.yaw_rate_rad_s))
            case Action.HOVER if flies and decision.back_m_s is not None:
                self._link.send(now_ns, self._sticks(decision.back_m_s, 0.0))
            case Action.HOVER | Action.TAKE_OFF if flies:
                self._link.send(now_ns, text.CENTRED)
            case Action.IDLE if now_ns - self._sent_ns.get(text.TAKE_OFF, -_BEGINS_NS) < _BEGINS_NS:
                self._land(now_ns)
            case _:
                self._repeat(now_ns, text.SDK)
        if not self._ready:
            self._repeat(now_ns, text.SDK)
        elif self._settings.tello.video and not (flies or decision.action is Action.TAKE_OFF):
            self._repeat(now_ns, text.STREAM_ON)

    def health(self, now_ns: int) -> LinkHealth:
        """Return the state of the link, and the vehicle's answer to an order that it refused."""
        self._heed_answers()
        word = REFUSABLE.get(self._asked)
        detail = f"it answers {self._refused!r} when told to {word}" if self._refused and word else ""
        return replace(super().health(now_ns), detail=detail)

    def _sticks(self, velocity: Vector3, turn_rad_s: float) -> bytes:
        own = self._settings.tello
        (forward, left, up), turn = self._settings.limits.within(velocity, turn_rad_s)
        right, ahead = -left / own.full_speed_m_s, forward / own.full_speed_m_s
        shares = (right, ahead, up / own.full_climb_m_s, -math.degrees(turn) / own.full_yaw_rate_deg_s)
        return text.rc(*(round(100 * share) for share in shares))

    def _take_off(self, now_ns: int) -> None:
        """Say `takeoff`, once nothing else waits for an answer, and again while it stands and has not answered."""
        if not self._ready:
            self._repeat(now_ns, text.SDK)
        elif self._owed == 0 or now_ns - self._owed_ns >= _ANSWERS_NS:
            self._repeat(now_ns, text.TAKE_OFF)

    def _land(self, now_ns: int) -> None:
        if self._is_due(now_ns, text.LAND):
            # WIRE (docs/reference/tello.md 2): the last sticks stay in force, also while it lands.
            self._link.send(now_ns, text.CENTRED)
            self._repeat(now_ns, text.LAND)

    def _is_due(self, now_ns: int, word: bytes) -> bool:
        return now_ns - self._sent_ns.get(word, -_PAUSE_NS[word]) >= _PAUSE_NS[word]

    def _repeat(self, now_ns: int, word: bytes) -> None:
        if self._is_due(now_ns, word):
            # An answer that has not come by now was lost.
            self._owed = 1 + (self._owed if now_ns - self._owed_ns < _ANSWERS_NS else 0)
            self._sent_ns[word] = self._owed_ns = now_ns
            self._link.send(now_ns, word)


def run(child: HostProcess) -> int:
    """Fly one Tello until a stop is requested; the process entry."""
    settings = read_section(TelloDriverSettings, child.section, "Tello")
    return fly_one(child, Tello(settings, child.bus), settings.authority, RATE_HZ)
