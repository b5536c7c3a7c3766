"""The driver of a vehicle behind a ROS 2 node: its reports, its orders from decisions, and the process entry."""

import math
from collections import Counter

from drivers.base import HostProcess, LinkHealth, read_section
from drivers.datagrams import DatagramLog
from drivers.host import fly_one
from drivers.plausibility.health import SUSPECT_VELOCITY_STD_M_S, Health, Sensor
from drivers.plausibility.limits import PlausibilityLimits
from drivers.plausibility.motion import MotionMonitor, MotionSample
from drivers.rmw_zenoh.publisher_tie import PublisherTie
from drivers.rmw_zenoh.wire import vehicle
from drivers.rmw_zenoh.wire.cdr import WireError
from drivers.ros2 import names
from drivers.ros2.cut_order import CutOrder
from drivers.ros2.flight import FlightWatch, angles_of, fault_of_standing, levelled
from drivers.ros2.link import Ros2Link
from drivers.ros2.names import Order
from drivers.ros2.settings import FASTEST_M_S, Ros2DriverSettings
from drivers.ros2.succession import Succession
from drivers.ros2.twist_axes import TwistAxes
from drivers.watchdog_types import REFUSABLE, Action, VehicleView, WatchdogDecision
from groundstation.bus import clock
from groundstation.bus.api import Bus
from groundstation.bus.messages import Odometry, Vector3
from groundstation.bus.topics import ODOMETRY
from groundstation.time_units import NS_PER_MS, NS_PER_S

RATE_HZ = 20.0
_FRESH_NS = 300 * NS_PER_MS
# Charges come seldom; an older one counts as unknown.
_CHARGE_NS = 30 * NS_PER_S
_STANDING_M = 0.08  # the base of a standing vehicle, as in its kind
# Orders are repeated until they are obeyed; a standing vehicle gets zero velocity once a second.
_PAUSE_NS = {Order.TAKE_OFF: 2 * NS_PER_S, Order.LAND: NS_PER_S // 2, Order.CUT: NS_PER_S // 2, None: NS_PER_S}
# A take-off that is called off may still begin for this long after its order; a landing that seems to be over, go on.
_LASTS_NS = 5 * NS_PER_S
_ORDERS = {Action.TAKE_OFF: Order.TAKE_OFF, Action.LAND: Order.LAND, Action.CUT: Order.CUT}
_HEIR = "another publisher took over in flight, "
_UNTOLD = "without odometry nothing tells whether its motors stopped; stay away"
_ROOM_AXES = "in the axes of the room, not in the vehicle's own"
LIMITS = PlausibilityLimits(speed_m_s=FASTEST_M_S, tilt_rad=math.radians(50.0), jump_m_s=0.6)


class Ros2Vehicle:
    """One vehicle behind its router; `drivers.base.Vehicle`."""

    def __init__(self, settings: Ros2DriverSettings, bus: Bus) -> None:
        self.name, self.address = settings.name, settings.address
        self._settings, self._bus = settings, bus
        self._log = DatagramLog(bus, settings.name, settings.raw_datagrams)
        self._flight = FlightWatch(settings.ros2.take_off_m)
        self._plausibility = MotionMonitor(LIMITS)
        self._rejected: Counter[str] = Counter()
        self._asked = Action.WAIT
        self._said_ns: dict[Order | None, int] = {}
        self._lands_until_ns = 0
        self._cut_order = CutOrder()
        self._heard_ns = self._charge_ns = 0
        self._succession = Succession(settings.limits, settings.ros2.standing_z_m)
        self._battery_tie, self._axes = PublisherTie(_CHARGE_NS), TwistAxes()
        self._charge, self._rate_hz = 0.0, 0.0
        self._refused, self._standing, self._height_m, self._was_ordered = "", "", 0.0, False
        self._velocity: Vector3 = (0.0, 0.0, 0.0)
        self._battery_type = names.battery_key(settings.ros2).rpartition("/")[0]
        self._link = Ros2Link(settings.address, settings.ros2, f"skein_{settings.name}", self._hear)

    # -- the network's thread -----------------------------------------------------------------------------------------

    def _hear(self, key: str, payload: bytes, publisher: bytes) -> None:
        now_ns = clock.now_ns()
        self._log.received(now_ns, recorded(key, payload))
        try:
            if key.rpartition("/")[0] == self._battery_type:
                self._take_charge(now_ns, payload, publisher)
            elif self._succession.is_second(publisher, now_ns):
                self._rejected["second_publisher"] += 1
            else:
                self._hear_odometry(now_ns, payload, publisher)
        except WireError as error:
            self._rejected[error.reason.replace(" ", "_")] += 1
            if key.rpartition("/")[0] != self._battery_type:
                self._refused = error.reason

    def _hear_odometry(self, now_ns: int, payload: bytes, publisher: bytes) -> None:
        message = vehicle.decode_odometry(payload)
        flies = self._flight.airborne or self._asked is Action.TAKE_OFF
        broken = self._succession.break_with(now_ns, publisher, message) if flies else ""
        if broken:
            self._rejected["heir_in_flight"] += 1
            if not self._refused.startswith(_HEIR):
                self._refused = _HEIR + broken
            return
        self._take(now_ns, message)
        if self._succession.take(now_ns, publisher, message):
            self._axes = TwistAxes()
        self._refused = ""

    def _take_charge(self, now_ns: int, payload: bytes, publisher: bytes) -> None:
        charge = vehicle.decode_charge(payload)
        if self._battery_tie.is_second(publisher, now_ns):
            self._rejected["second_battery_publisher"] += 1
            return
        self._charge, self._charge_ns = charge, now_ns
        self._battery_tie.take(publisher, now_ns)

    def _take(self, now_ns: int, message: vehicle.OdometryMessage) -> None:
        roll, pitch, yaw = angles_of(message.quaternion)
        velocity = levelled(message.velocity, roll, pitch)
        standing_z_m = self._settings.ros2.standing_z_m
        self._height_m = height_m = message.position[2] - standing_z_m
        self._standing = fault_of_standing(height_m, velocity, roll, pitch, standing_z_m)
        if self._heard_ns:
            self._rate_hz += 0.1 * (NS_PER_S / max(1, now_ns - self._heard_ns) - self._rate_hz)
        self._heard_ns, self._velocity = now_ns, velocity
        self._flight.see(now_ns, height_m, velocity[2], self._asked)
        state = self._flight.state(self._asked, math.hypot(*velocity))
        stamp_ns = message.stamp_ns or None
        sample = MotionSample(now_ns, velocity[:2], roll, pitch, vehicle_ns=stamp_ns, climb_m_s=velocity[2])
        report = self._plausibility.update(sample, state)
        self._axes.take(stamp_ns or now_ns, message.position, message.velocity, velocity, yaw)
        if self._axes.wrong or report.withheld or report.of(*LIMITS.essential) is Health.BAD:
            return
        doubted = report.of(Sensor.TELEMETRY, Sensor.CLOCK, Sensor.VELOCITY) is Health.SUSPECT
        variance = max(self._settings.velocity_std_m_s, SUSPECT_VELOCITY_STD_M_S if doubted else 0.0) ** 2
        odometry = Odometry(
            header=self._bus.header(self.name, now_ns),
            velocity_m_s=velocity,
            velocity_covariance=(variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance),
            yaw_rad=yaw,
            roll_rad=roll,
            pitch_rad=pitch,
            height_m=max(0.0, height_m + _STANDING_M),
        )
        self._bus.publish(ODOMETRY, odometry)

    # -- sender loop --------------------------------------------------------------------------------------------------

    def view(self, now_ns: int) -> VehicleView:
        """Return the vehicle's last reported state."""
        fresh = self._heard_ns > 0 and now_ns - self._heard_ns < _FRESH_NS
        known = self._charge_ns > 0 and now_ns - self._charge_ns < _CHARGE_NS
        trouble = self._link.trouble
        unsound = self._plausibility.report.reason(Health.BAD, LIMITS.essential)
        if self._axes.wrong:
            unsound = f"{self._odometry} moves as if its twist were {_ROOM_AXES}"
        if not fresh and self._refused:
            unsound = self._refusal
        scale, (x, y, z) = self._settings.velocity_scale, self._velocity
        state = self._flight.state(self._asked, math.hypot(x, y, z))
        charge = self._charge if known else None
        not_ready = trouble or self._standing or self._two_publishers(now_ns)
        return VehicleView(state, fresh, charge, not_ready, not trouble, unsound, (scale * x, scale * y, z))

    @property
    def _odometry(self) -> str:
        """Return words for its odometry: the topic, and the nodes that publish it as far as they are announced."""
        own = self._settings.ros2
        nodes = " and ".join(self._link.odometry_nodes)
        return f"its odometry (/{own.topic(own.odometry)}{nodes and f' of {nodes}'})"

    @property
    def _refusal(self) -> str:
        return f"{self._odometry} is refused: {self._refused}"

    def _two_publishers(self, now_ns: int) -> str:
        if not self._succession.two_speak(now_ns):
            return ""
        return f"{self._odometry} has two publishers, of which the first counts: end the other one"

    def apply(self, now_ns: int, decision: WatchdogDecision) -> None:
        """Send the orders of a decision; the vehicle climbs by itself after a take-off order."""
        if decision.action is not self._asked:
            self._asked = decision.action
            self._said_ns.clear()
            self._cut_order = CutOrder()
            self._was_ordered |= self._asked is Action.TAKE_OFF
        match decision.action:
            case Action.CUT:
                self._cut(now_ns, decision.entered_ns)
            case Action.LAND:
                self._lands_until_ns = now_ns + _LASTS_NS
                self._order(now_ns, Order.LAND)
            case Action.IDLE if now_ns < self._lands_until_ns:
                self._order(now_ns, Order.LAND)
            case Action.TAKE_OFF if not self._flight.airborne:
                self._lands_until_ns = now_ns + _LASTS_NS
                self._order(now_ns, Order.TAKE_OFF)
            case Action.FLY:
                self._fly(now_ns, *self._settings.limits.within(decision.velocity_m_s, decision.yaw_rate_rad_s))
            case Action.HOVER:
                self._fly(now_ns, decision.back_m_s or (0.0, 0.0, 0.0), 0.0)
            case Action.IDLE | Action.CLEAR if self._is_due(now_ns, None):
                self._fly(now_ns, (0.0, 0.0, 0.0), 0.0)

    def _fly(self, now_ns: int, velocity: Vector3, turn_rad_s: float) -> None:
        self._note(now_ns, self._settings.ros2.velocity, self._link.fly(velocity, turn_rad_s))

    def _cut(self, now_ns: int, order_ns: int) -> None:
        link, order, height_m = self._link, self._cut_order, self._height_m
        accepted = Order.CUT in link.accepted
        if order.is_due(now_ns, order_ns, self._heard_ns, height_m, accepted) and self._is_due(now_ns, Order.CUT):
            payload = link.order(Order.CUT)
            self._note(now_ns, self._settings.ros2.cut, payload)
            if payload and link.is_taken(Order.CUT):
                order.sent(now_ns, order_ns, height_m)
        # A node that has no such order must not fly on at its last velocity.
        if self._flight.airborne or self._is_due(now_ns, None):
            self._fly(now_ns, (0.0, 0.0, 0.0), 0.0)

    def _order(self, now_ns: int, order: Order) -> None:
        if self._is_due(now_ns, order):
            self._note(now_ns, str(getattr(self._settings.ros2, order)), self._link.order(order))

    def _is_due(self, now_ns: int, order: Order | None) -> bool:
        if now_ns - self._said_ns.get(order, -_PAUSE_NS[order]) < _PAUSE_NS[order]:
            return False
        self._said_ns[order] = now_ns
        return True

    def _note(self, now_ns: int, name: str, payload: bytes) -> None:
        if payload:
            self._log.sent(now_ns, recorded(self._settings.ros2.topic(name), payload))

    def health(self, now_ns: int) -> LinkHealth:
        """Return rate and refusals of the link, and in flight the reason if it does not receive or obey."""
        silent = now_ns - self._heard_ns > _FRESH_NS
        asked = _ORDERS.get(self._asked)
        refused = "" if asked is None else self._link.refused.get(asked, "")
        detail = f"it refused to {REFUSABLE[self._asked]}: {refused}" if refused else ""
        if asked is Order.CUT and silent and self._cut_order.was_sent:
            detail = detail or f"/{self._settings.ros2.topic(self._settings.ros2.cut)} was sent once: {_UNTOLD}"
        if self._flight.airborne and not detail:
            detail = self._link.trouble or self._unordered or self._two_publishers(now_ns)
        rate_hz = 0.0 if silent else self._rate_hz
        return LinkHealth(None, rate_hz, dict(self._rejected), detail, self._plausibility.clock.figures)

    @property
    def _unordered(self) -> str:
        """Return the remedy if a vehicle reports flight without an order to take off, or ""."""
        if self._was_ordered:
            return ""
        z_m = self._height_m + self._settings.ros2.standing_z_m
        return f"its odometry says z = {z_m:.2f} m: if it stands, set ros2.standing_z_m to that"

    def flush(self) -> None:
        """Publish the waiting raw messages."""
        self._log.flush()

    def close(self) -> None:
        """Leave the router."""
        self._link.close()
        self._log.flush()


def recorded(name: str, payload: bytes) -> bytes:
    """Return a message in the recording's form: its name, a zero, its bytes."""
    return name.encode() + b"\0" + payload


def run(child: HostProcess) -> int:
    """Fly one vehicle until a stop is requested; the process entry."""
    settings = read_section(Ros2DriverSettings, child.section, "ROS 2")
    return fly_one(child, Ros2Vehicle(settings, child.bus), settings.authority, RATE_HZ)
