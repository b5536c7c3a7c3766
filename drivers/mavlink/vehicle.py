"""One MAVLink vehicle behind the interface `drivers.base.Vehicle`: its messages in, decisions of the watchdog out."""

from collections import Counter, deque
from dataclasses import replace

from drivers.base import LinkHealth
from drivers.datagrams import DatagramLog
from drivers.mavlink import convert, identity
from drivers.mavlink.commands import Orders
from drivers.mavlink.convert import LIMITS
from drivers.mavlink.heading_watch import HeadingWatch
from drivers.mavlink.latest_telemetry import LatestTelemetry
from drivers.mavlink.links.seam import Heard, MavlinkLink
from drivers.mavlink.motors import FELL
from drivers.mavlink.other_stations import GivenOrders, is_answer_to
from drivers.mavlink.publisher import TelemetryPublisher
from drivers.mavlink.readiness import Readiness
from drivers.mavlink.reported_flight import ReportedFlight
from drivers.mavlink.requests import Requests
from drivers.mavlink.session import MavlinkSession
from drivers.mavlink.settings import MavlinkDriverSettings, VehicleSettings
from drivers.mavlink.stream_rates import streams
from drivers.mavlink.texts import BootClock, Refusals, Texts
from drivers.mavlink.traffic import Traffic
from drivers.mavlink.vision import FIRST_SIGHT_NS, VisionFeed
from drivers.mavlink.wire import flight, service, telemetry
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.names import ARMED, AUTOPILOT_COMPONENT, Flavour, MavSeverity, SensorBits
from drivers.plausibility.health import Finding, Health, HealthReport, Sensor
from drivers.plausibility.motion import MotionMonitor
from drivers.watchdog_types import Action, DriverMode, VehicleView, WatchdogDecision
from groundstation.bus import clock
from groundstation.bus.api import Bus
from groundstation.bus.messages import EntityEstimate, Estimate, Vector3
from groundstation.time_units import NEVER_NS, NS_PER_S

_BELOW_FENCE_M = 0.15  # a height to hold is in the fence, by the output limiter's margin
_ASKS_NS = 3 * NS_PER_S
_Value = service.ParamValue | telemetry.GpsGlobalOrigin | telemetry.AutopilotVersion


class MavlinkVehicle:
    """One MAVLink vehicle. The reader thread calls `hear` and replaces `telemetry` as a whole.

    The sender loop does the rest.
    """

    def __init__(self, settings: MavlinkDriverSettings, vehicle: VehicleSettings, link: MavlinkLink, bus: Bus) -> None:
        self.name, self.address = vehicle.name, settings.link.target
        self.system = vehicle.system_id
        self.telemetry = LatestTelemetry()
        self.flavour = Flavour[vehicle.flavour.upper()]
        self.texts: deque[tuple[int, telemetry.Statustext]] = deque(maxlen=64)
        self.log = DatagramLog(bus, vehicle.name, settings.raw_datagrams)
        self._settings, self._link = settings, link
        self._publisher = TelemetryPublisher(vehicle, bus)
        self._requests = Requests(self.system)
        self._acks: deque[flight.CommandAckMessage] = deque(maxlen=64)
        self._values: deque[_Value] = deque(maxlen=256)
        rates = streams(self.flavour, vehicle.odometry_hz, vehicle.imu_hz)
        self._ours, known = (settings.link.system_id, settings.link.component_id), dict(vehicle.parameters)
        ids, pinned = (self.system, self.flavour, rates, self._ours[0]), vehicle.serial_number
        self._session = MavlinkSession(*ids, settings.origin, known, pinned, self.address.startswith("udpout"))
        self._given = GivenOrders(forwards=bool(vehicle.forward))
        pad, first_ns = (vehicle.pad_m, vehicle.pad_yaw_rad), FIRST_SIGHT_NS[self.flavour]
        self.vision = VisionFeed(vehicle.name, clock.clock_id(), settings.vision, *pad, first_ns)
        self.orders = Orders(vehicle, self.flavour, self._requests)
        if settings.safety.fence_m is not None:
            self.orders.drift.top_m = settings.safety.fence_m[2][1] - _BELOW_FENCE_M
        self._vision_period_ns = round(1e9 / settings.vision.rate_hz)
        self._next_vision_ns = 0
        self.misfit, self._namesakes = identity.Misfit(self.flavour, self.system), identity.Namesakes(self.system)
        self._flight = ReportedFlight(self.flavour, self.orders, self.misfit)
        self._traffic = Traffic()
        self._plausibility, self._heading = MotionMonitor(LIMITS), HeadingWatch()
        self._refused: Counter[str] = Counter()
        self._said, self._boot_clock = Texts(), BootClock()
        self._readiness = Readiness(self.flavour, self._session, self._requests, self._said)
        self._jumps: deque[tuple[int, str]] = deque(maxlen=8)
        self._refusals = Refusals(self._said)

    def use(self, link: MavlinkLink) -> None:
        """Send through another link from now on."""
        self._link = link

    # -- reader thread ------------------------------------------------------------------------------------------------

    def take(self, heard: Heard) -> None:
        """Take a frame of this vehicle; unusable frames are counted."""
        if heard.frame.component != AUTOPILOT_COMPONENT:
            return
        self._traffic.count(heard.stamp_ns, heard.frame.sequence)
        if heard.frame.message is None:
            return
        try:
            self._take(heard.stamp_ns, heard.frame.message)
        except WireError as error:
            self._refused[error.reason] += 1

    def _take(self, now_ns: int, message: tuple[object, ...]) -> None:
        known = replace(self.telemetry, heard_ns=now_ns)
        self._session.take(now_ns, type(message))
        match message:
            case telemetry.LocalPositionNed():
                known = self._moved(now_ns, message, known)
            case telemetry.AttitudeQuaternion():
                attitude = convert.attitude_from_quaternion(message)
                self._publisher.attitude(now_ns, attitude)
                known = replace(known, attitude=attitude, attitude_ns=now_ns)
            case telemetry.HighresImu():
                known = self._felt(now_ns, *convert.imu_from_highres(message), known)
            case telemetry.RawImu():
                known = self._felt(now_ns, *convert.imu_from_raw(message), known)
            case telemetry.Heartbeat():
                if words := self.misfit.take(now_ns, message.autopilot):
                    raise WireError("wrong_flavour", words)
                known = known.after_heartbeat(now_ns, message)
            case _:
                known = self._take_rare(now_ns, message, known)
        self.telemetry = known

    def _moved(self, now_ns: int, message: telemetry.LocalPositionNed, known: LatestTelemetry) -> LatestTelemetry:
        if (jump_ms := self._boot_clock.take(now_ns, message.time_boot_ms)) != 0:
            self._refused["clock_jump"] += 1
            self._jumps.append((jump_ms, self._boot_clock.why))
        attitude = known.attitude_at(now_ns)
        if known.attitude is None or attitude is None:
            return known
        velocity = convert.velocity_from_local(message, attitude)
        position = convert.position_from_local(message)
        # As received: an attitude extrapolated by its age no longer shows that it is stuck.
        sample = convert.sample_from_local(now_ns, message, known.attitude, known.inertial)
        report = self._plausibility.update(sample, self._flight.state(now_ns, known))
        if why := self._heading.reason:  # what its velocity was turned by
            report = HealthReport((Finding(Sensor.VELOCITY, Health.BAD, why), *report.findings), report.withheld)
        self._publisher.velocity(now_ns, velocity, attitude, report)
        return replace(known, moved_ns=now_ns, velocity_m_s=velocity, position_m=position)

    def _felt(self, now_ns: int, rates: Vector3, force: Vector3, known: LatestTelemetry) -> LatestTelemetry:
        self._publisher.imu(now_ns, rates, force, known.attitude_at(now_ns))
        return replace(known, inertial=(*rates, *force))

    def _take_rare(self, now_ns: int, message: tuple[object, ...], known: LatestTelemetry) -> LatestTelemetry:
        match message:
            case telemetry.ExtendedSysState():
                return replace(known, landed=message.landed_state, landed_ns=now_ns)
            case telemetry.SysStatus():
                healthy = message.onboard_control_sensors_health
                # WIRE (PX4): a sensor that is not there is reported as healthy too.
                heard = message.onboard_control_sensors_present & healthy & SensorBits.RC_RECEIVER
                batteries = known.batteries.with_lowest(now_ns, message.battery_remaining)
                return replace(known, healthy=healthy, transmitter=bool(heard), batteries=batteries)
            case telemetry.BatteryStatus(id=0):  # the others may feed a payload
                if news := known.batteries.news(message):
                    self._session.notes.append(news)
                return replace(known, batteries=known.batteries.with_first(now_ns, message))
            case telemetry.EkfStatusReport() | telemetry.EstimatorStatus():
                self._publisher.stated.take(now_ns, message)
                if self.orders.lift.lifted and (doubts := self._publisher.stated.doubts(now_ns)):
                    self.orders.events.append((MavSeverity.WARNING, doubts))
                return replace(known, ekf=message.flags)
            case flight.OdometryMessage():
                self._publisher.stated.take(now_ns, message)
            case telemetry.Statustext():
                self.texts.append((now_ns, message))
            case flight.CommandAckMessage() if is_answer_to(self._ours, message):
                self._acks.append(message)
            case service.ParamValue() | telemetry.GpsGlobalOrigin() | telemetry.AutopilotVersion():
                self._values.append(message)
            case service.Timesync() if message.tc1 == 0:
                # WIRE (docs/reference/mavlink.md 5.6): without answers PX4 does not accept the times of our poses.
                self._link.send(self.system, service.Timesync(clock.now_ns(), message.ts1))
                return replace(known, asked_ns=now_ns)
        return known

    # -- sender loop --------------------------------------------------------------------------------------------------

    def see(self, now_ns: int, estimate: Estimate) -> None:
        """Take the tracker's estimate."""
        good, known = self.vision.take(now_ns, estimate), self.telemetry
        if self.orders.starting and not self.orders.lift.lifted and known.base_mode & ARMED:
            self._publisher.stated.leave_floor(now_ns)
        self._compare_heading(now_ns, good, known)
        reported = known.velocity_m_s if known.tells_motion(now_ns) and not self._heading.reason else None
        if good is not None and self.orders.see(now_ns, good, reported):
            self._publisher.stated.see_drift(now_ns, self.orders.drift.size_m_s)
        if (seen := self.vision.sighted) is not None and self.orders.lift.lifted:
            self.orders.drift.see_place(now_ns, seen.position_m, seen.yaw_rad)

    def _compare_heading(self, now_ns: int, good: EntityEstimate | None, known: LatestTelemetry) -> None:
        if not self.orders.lift.lifted:
            self._heading.reset()
        elif good is not None and known.tells_attitude(now_ns) and (attitude := known.attitude_at(now_ns)) is not None:
            self._heading.take(now_ns, good, attitude.yaw_rad)
        else:
            self._heading.lose()

    def view(self, now_ns: int) -> VehicleView:
        """Return the vehicle's last reported state."""
        known = self.telemetry
        wrong = self._plausibility.report.reason(Health.BAD, LIMITS.essential)
        unsound, mute = self._flight.unsound(now_ns, known, wrong, self._session.slow)
        unsound = unsound or self._heading.reason
        heeded = self.orders.are_heeded(now_ns, known.custom_mode)
        piloted = self._flight.is_piloted(now_ns, known)
        limited = heeded or self._flight.must_keep_limits(now_ns)
        doubled = self._namesakes.words(now_ns, self._link.rejected.doubled(self.system))
        not_ready = doubled or self._readiness.why_not(now_ns, known)
        battery = known.batteries.charge(now_ns)
        velocity = self._true_velocity(now_ns, known) if limited else None
        fresh = self._flight.is_heard(now_ns, known) and bool(unsound or not wrong)
        return VehicleView(
            self._flight.told(now_ns, known), fresh, battery, not_ready,
            unsound=unsound, velocity_m_s=velocity, lost_s=self.vision.lost_s(now_ns),
            unlocated=self.vision.missed, mute=mute, homeward=self._flight.homeward(now_ns, known), foreign=not heeded,
            settles=not limited, piloted=piloted, rises=self.orders.rises(now_ns),
            fell=FELL if self.orders.motors.fell else "", unarmed=self._readiness.refusal(known),
        )  # fmt: skip

    def _true_velocity(self, now_ns: int, known: LatestTelemetry) -> Vector3:
        # Its commands include its drift: that is no control error.
        (x, y, z), (drift_x, drift_y, drift_z) = known.velocity_m_s, self.orders.drift.drift(now_ns)
        return x - drift_x, y - drift_y, z - drift_z

    def apply(self, now_ns: int, decision: WatchdogDecision) -> None:
        """Send the vehicle its commands for the decision, poses for its estimator, and pending requests."""
        known = self.telemetry
        self._take_answers(now_ns)
        if failsafe := self._flight.failsafe(known):
            self.orders.events.append((MavSeverity.WARNING, failsafe))
        silence_ns = now_ns - known.heard_ns if known.heartbeat_ns else NEVER_NS
        if self._boot_clock.restarted and not known.base_mode & ARMED:
            self._boot_clock.restarted = False
            self._session.start_over(self._requests)  # origin and parameters were lost, though it was hardly silent
            self.orders.start_failed(now_ns)
        # Others on its line get heartbeats of their own: theirs reach it too, and keep it up.
        lands = decision.mode is DriverMode.LANDING and decision.action is Action.LAND
        deaf = lands and not self.orders.pilot.moves(known.custom_mode)
        deaf_ns = min(silence_ns, now_ns - decision.entered_ns) if deaf else 0
        messages = self._session.step(now_ns, silence_ns, self._requests, deaf_ns)
        messages += self._feed(now_ns, known)
        up = (known.position_m[2] if known.position_m else 0.0, known.velocity_m_s[2])
        landed = self._flight.landed(now_ns, known)
        self._readiness.note_start(now_ns, decision.action is Action.TAKE_OFF)
        if known.transmitter and self.flavour is Flavour.ARDUPILOT:
            self._session.hear_transmitter()
        # One that may have died unnoticed is no pilot's.
        self.orders.pilot.transmitter = known.transmitter and self._session.tells_lost_transmitter
        setpoint = self.orders.step(now_ns, decision, known.base_mode, known.custom_mode, landed, *up)
        messages += self._requests.due(now_ns)
        if setpoint is not None:
            messages.append(setpoint)
        for message in messages:
            self._given.note(now_ns, message)
            self._link.send(self.system, message)

    def _take_answers(self, now_ns: int) -> None:
        while self._acks:
            ack = self._acks.popleft()
            self._requests.answer(now_ns, ack)
            if self._given.is_foreign(now_ns, ack.command):
                text = f"it answers an order that is not ours, by our ids {self._ours}: another ground station has them"
                self.orders.events.append((MavSeverity.WARNING, text))
        while self._values:
            value = self._values.popleft()
            if isinstance(value, service.ParamValue):
                self._session.hear_parameter(value)
            elif isinstance(value, telemetry.AutopilotVersion):
                self._session.hear_version(value.flight_sw_version, identity.serial_number_of(value))
            else:
                self._session.hear_origin()
        self._take_texts(now_ns)

    def _take_texts(self, now_ns: int) -> None:
        events = self.orders.events
        while self._session.notes:
            events.append((MavSeverity.WARNING, self._session.notes.popleft()))
        for at_ns, severity, text in self._said.whole(now_ns, self.texts):
            self.orders.said.take(at_ns, text)
            events.append((severity, text))
        while self._jumps:
            jump_ms, why = self._jumps.popleft()
            events.append((MavSeverity.WARNING, f"its clock jumped by {jump_ms / 1000:.0f} s: {why}"))
        events.extend((MavSeverity.WARNING, text) for text in self._refusals.told(now_ns, self._requests.failures))

    def _feed(self, now_ns: int, known: LatestTelemetry) -> list[tuple[object, ...]]:
        if now_ns < self._next_vision_ns or (attitude := known.attitude_at(now_ns)) is None:
            return []
        self._next_vision_ns = max(self._next_vision_ns + self._vision_period_ns, now_ns)
        if (pose := self.vision.pose(now_ns, bool(known.base_mode & ARMED) and self.orders.lift.lifted)) is None:
            return []
        if self.flavour is Flavour.PX4:
            return [convert.odometry_from_pose(pose, attitude, self.vision.resets)]
        return [convert.vision_from_pose(pose, attitude, self.vision.resets)]

    def health(self, now_ns: int) -> LinkHealth:
        """Return rates, losses and refusals; of the whole link, but for frames of others."""
        rate_hz, quality = self._traffic.rates(now_ns)
        lost_s, limit_s = self.vision.lost_s(now_ns), self._settings.vision.hover_after_s
        lost = f"no position {self.vision.missed} for {lost_s:.1f} s" if lost_s >= limit_s else ""
        detail = self.misfit.words(now_ns) or lost or self.orders.yields or self._session.detail(self._requests)
        rejected = dict(self._link.rejected.seen_by(self.system) + self._refused)
        clocks, firmware = self._plausibility.clock.figures, self._session.firmware
        return LinkHealth(quality, rate_hz, rejected, detail, clocks, firmware, self._asks_time(now_ns))

    def _asks_time(self, now_ns: int) -> bool | None:
        """Return whether a PX4 requests our time, ten times a second as it should; ArduPilot need not (None)."""
        return None if self.flavour is not Flavour.PX4 else now_ns - self.telemetry.asked_ns < _ASKS_NS

    def flush(self) -> None:
        """Publish the waiting raw datagrams."""
        self.log.flush()

    def close(self) -> None:
        """Do nothing: the link is the driver's."""
