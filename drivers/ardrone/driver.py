"""The AR.Drone driver: reader thread, sender, and the process entry `run`."""

import logging
import math
import threading
from collections import Counter
from functools import partial

from drivers.ardrone import convert
from drivers.ardrone.attitude_control import AttitudeControl, MotionReport
from drivers.ardrone.averages import MotionMean
from drivers.ardrone.commands import STALE_NS, orders_from_decision
from drivers.ardrone.desired_config import ids_of, scale_from_settings, wishes
from drivers.ardrone.flow_watch import FlowWatch
from drivers.ardrone.identity import Model, model_from_navdata
from drivers.ardrone.latest import FRESH_NS, LatestNavdata
from drivers.ardrone.link import ArDroneLink, Arrival
from drivers.ardrone.packet_times import WRAP_S
from drivers.ardrone.publisher import NavdataPublisher
from drivers.ardrone.queries import TcpInquirer
from drivers.ardrone.rate_watch import RateWatch
from drivers.ardrone.session import DISCONNECTED_NS, ArdroneSession, SessionPhase
from drivers.ardrone.settings import FASTEST_M_S, ArDroneDriverSettings
from drivers.ardrone.stillness import Stillness
from drivers.ardrone.uplink_watch import ANOTHER, UplinkWatch
from drivers.ardrone.velocity_doubt import NO_FLOOR
from drivers.ardrone.wire.errors import WireError
from drivers.ardrone.wire.navdata import Navdata
from drivers.ardrone.wire.options import DEMO, SPEED_REFERENCES
from drivers.ardrone.wire.state import StateBit, bit_names
from drivers.base import HostProcess, LinkHealth, read_section
from drivers.datagrams import DatagramLog
from drivers.host import fly_one
from drivers.plausibility.health import Finding, Health, HealthReport, Sensor
from drivers.plausibility.limits import PlausibilityLimits
from drivers.plausibility.motion import MotionMonitor
from drivers.watchdog_types import Action, DriverMode, VehicleView, WatchdogDecision
from groundstation.adapters import with_zone
from groundstation.bus.api import Bus
from groundstation.bus.messages import AIRBORNE, UP, Severity, Vector3
from groundstation.bus.notice import Notice
from groundstation.time_units import NS_PER_MS

# WIRE: at least every 30 ms (guide), 20-25 ms (SDK); on a busy machine a turn comes late.
RATE_HZ = 40.0
# A velocity that repeats below this is that of a drone that sees no floor: its firmware's own braking fails as well.
_NO_FLOW_M_S = 0.02
_RATE_PERIOD_NS = 200 * NS_PER_MS
# A packet of which nothing is to be published waits unread for the next one, 5 ms later: two at once take two thirds of
# the time, since most of it is spent on bringing the code back into the processor's caches.
_AT_ONCE = 2
_FAULTS = int(StateBit.MOTORS | StateBit.SOFTWARE_FAULT | StateBit.VBAT_LOW)
_NO_VELOCITY = Finding(Sensor.VELOCITY, Health.BAD, NO_FLOOR)
_NO_MOTION = "its navdata hold its state alone, no motion: it was restarted, or another program configures it"
_NO_AR1_VIDEO = Notice(
    Severity.WARNING,
    "this is an AR.Drone 1.0: its video (UVLC and P264 over UDP 5555) is out of scope and is left alone",
    "take the video section out of the field file and give the drone a camera of its own",
)
# Firmware limits tilt to 30 degrees and flies 5 m/s at most.
# 30 degrees are 6 m/s^2. Between two packets of a recorded flight its velocity changed by 0.024 m/s at most.
# Our velocity loop is closed over the link: with a velocity older than this it oscillates.
LIMITS = PlausibilityLimits(
    speed_m_s=FASTEST_M_S, clock_wrap_s=WRAP_S, jump_m_s=0.2, acceleration_m_s2=6.0, clock_late_s=0.5
)
_log = logging.getLogger(__name__)


class ArDrone:
    """One AR.Drone behind its link; `drivers.base.Vehicle`.

    The reader thread replaces `telemetry` as a whole; the sender loop only reads it.
    """

    def __init__(self, settings: ArDroneDriverSettings, bus: Bus) -> None:
        self.name = settings.name
        self.address = with_zone(settings.address, settings.interface)
        self.telemetry = LatestNavdata()
        self._settings = settings
        self._log = DatagramLog(bus, settings.name, settings.raw_datagrams)
        self._link = ArDroneLink(settings, self._log)
        self._publisher = NavdataPublisher(settings, bus)
        inquirer = TcpInquirer(self.address, settings.ftp_port, settings.control_port)
        self._session = ArdroneSession(
            partial(wishes, settings),
            ids_of(settings.name),
            inquirer,
            flat_trim=settings.flight.flat_trim,
            serial_needed=bool(settings.serial_number),
        )
        self._rate_watch, self._uplink = RateWatch(), UplinkWatch()
        self._next_rate_ns = 0
        self._scale = scale_from_settings(settings)
        self._motion, self._attitude = MotionMean(), AttitudeControl(settings.limits)
        self._flow, self._still = FlowWatch(), Stillness()
        self._plausibility = MotionMonitor(LIMITS)
        self._video_refused = False
        self._refused: Counter[str] = Counter()
        self._unread: list[Arrival] = []
        self._closing = threading.Event()
        self._reader = threading.Thread(target=self._read, name="navdata", daemon=True)
        self._reader.start()

    # -- reader thread ------------------------------------------------------------------------------------------------

    def _read(self) -> None:
        while not self._closing.is_set():
            arrival = self._link.receive()
            if arrival is not None:
                self._unread.append(arrival)
                if len(self._unread) < _AT_ONCE and not self._publisher.would_be_due(arrival.stamp_ns):
                    continue
            for one in self._unread:
                self._take(one)
            self._unread.clear()

    def _take(self, arrival: Arrival) -> None:
        packet = self._link.packet_of(arrival)
        if packet is None:
            return
        try:
            self._hear(arrival.stamp_ns, packet)
        except WireError as error:
            self._refused[error.reason] += 1
        except Exception:  # noqa: BLE001 - the reader must outlive whatever a drone sends: count, log, go on
            self._refused["internal"] += 1
            _log.exception("%s: a packet could not be used", self.name)

    def _hear(self, now_ns: int, packet: Navdata) -> None:
        heard, demo = self.telemetry, packet.read(DEMO)
        # A restarted drone reports its state before its phase.
        known = heard.control_state if now_ns - heard.heard_ns < STALE_NS else None
        control_state = known if demo is None else demo.control_state
        flight_state = convert.flight_state_from_navdata(packet.state, control_state)
        if demo is None:
            self.telemetry = heard._replace(
                heard_ns=now_ns, state=packet.state, control_state=control_state, flight_state=flight_state
            )
            return
        motion = convert.motion_from_demo(packet, demo)
        self.telemetry = LatestNavdata(
            heard_ns=now_ns,
            moved_ns=now_ns,
            state=packet.state,
            control_state=control_state,
            flight_state=flight_state,
            battery=convert.charge_from_demo(demo),
            model=model_from_navdata(packet) if heard.model is Model.UNKNOWN else heard.model,
            velocity_m_s=motion.velocity_m_s,
            height_m=motion.height_m,
        )
        references = packet.read(SPEED_REFERENCES)
        if references is not None:
            self._uplink.hear(now_ns, references.sequence, self._link.sent)
        self._still.update(now_ns, motion)
        if now_ns - heard.moved_ns > DISCONNECTED_NS and flight_state not in AIRBORNE:
            self._plausibility.reset()  # it may have been restarted: its clock would seem late by the pause
        sample = convert.sample_from_motion(now_ns, packet, motion)
        report = self._plausibility.update(sample, flight_state)
        if not report.withheld:
            self._motion.add(motion)
        if flight_state in UP:
            self._flow.update(now_ns, motion.velocity_m_s[:2], convert.says_no_vision(demo.control_state))
        elif flight_state not in AIRBORNE:
            self._flow.reset()
            self._attitude.trust()  # else its landing would not be believed either
        if self._flow.lost or self._attitude.blind:
            report = HealthReport((_NO_VELOCITY, *report.findings), report.withheld)
        self._publisher.publish(now_ns, motion, report, sample.vehicle_ns)

    # -- sender loop --------------------------------------------------------------------------------------------------

    def view(self, now_ns: int) -> VehicleView:
        """Return the drone's last report."""
        heard = self.telemetry
        fresh = heard.is_fresh(now_ns)
        mute = _NO_MOTION if not fresh and now_ns - heard.heard_ns < FRESH_NS else ""
        configured = self._session.phase is SessionPhase.READY
        unsound = self._plausibility.report.reason(Health.BAD, LIMITS.essential)
        unsound = unsound or (NO_FLOOR if self._flow.lost else self._attitude.doubted)
        not_ready = self._not_ready(heard)
        velocity = self._true(heard.velocity_m_s)
        return VehicleView(
            heard.flight_state, fresh, heard.battery, not_ready, configured, unsound, velocity, clears=True, mute=mute
        )

    def _true(self, velocity_m_s: Vector3) -> Vector3:
        scale = self._settings.velocity_scale
        return velocity_m_s[0] * scale, velocity_m_s[1] * scale, velocity_m_s[2]

    def _not_ready(self, heard: LatestNavdata) -> str:
        if self._uplink.foreign:
            return ANOTHER
        if self._session.phase is not SessionPhase.READY:
            return self._session.detail
        pinned, serial = self._settings.serial_number, self._session.identity.serial
        if pinned and serial != pinned:
            return f"it is another drone: its serial number is {serial}, the field says {pinned}"
        faults = heard.state & _FAULTS
        return f"the drone reports {', '.join(bit_names(faults))}" if faults else ""

    def apply(self, now_ns: int, decision: WatchdogDecision) -> None:
        """Send one datagram with the commands for the decision, and those of the session."""
        heard = self.telemetry
        silence_ns = now_ns - heard.heard_ns
        if self._session.request_due(now_ns, silence_ns):
            self._link.request_navdata()
        attitude = self._attitude.step(now_ns, decision, self._report(now_ns, heard))
        action = Action.HOVER if self._attitude.sinks else decision.action
        if action is Action.TAKE_OFF and self._session.phase is not SessionPhase.READY:
            action = Action.HOVER  # restarted since the order: if it flies it stays up, if it stands it stays there
        stale = silence_ns > STALE_NS
        commands = orders_from_decision(action, attitude, heard.state, heard.flight_state, self._scale, stale)
        commands += self._session.step(now_ns, heard.state, silence_ns, heard.model, self._still.stands)
        self._link.send(commands, self._insists(decision))
        self._watch_link(now_ns)

    def _insists(self, decision: WatchdogDecision) -> bool:
        """Return whether the drone must obey even if it has heard higher numbers, of ours or of another program."""
        stops = decision.mode in (DriverMode.LANDING, DriverMode.CUT) or decision.action in (Action.LAND, Action.CUT)
        return stops or not self._session.obeyed or self._uplink.cut or self._uplink.foreign

    def _watch_link(self, now_ns: int) -> None:
        heard, phase, notices = self.telemetry, self._session.phase, []
        if phase is SessionPhase.SEARCHING:
            self._uplink.reset()
        elif now_ns - heard.moved_ns < FRESH_NS:
            notices.append(self._uplink.step(now_ns, heard.flight_state in UP))
        if phase is not SessionPhase.READY:
            self._rate_watch.reset()
        elif now_ns >= self._next_rate_ns:
            self._next_rate_ns = now_ns + _RATE_PERIOD_NS
            notices.append(self._rate_watch.step(now_ns, self._link.rates(now_ns)[0]))
        self._session.news.extend(notice for notice in notices if notice is not None)

    def news(self) -> list[Notice]:
        """Return the events for the operator, once."""
        news = self._session.news
        told = [news.popleft() for _ in range(len(news))]
        if self._settings.video is not None and self._session.identity.model is Model.AR1 and not self._video_refused:
            self._video_refused = True
            told.append(_NO_AR1_VIDEO)
        return told

    def _report(self, now_ns: int, heard: LatestNavdata) -> MotionReport:
        velocity, force = self._motion.drain()
        fresh = now_ns - heard.moved_ns <= FRESH_NS
        repeats, lost = self._motion.repeats, self._flow.lost
        able = fresh and self._is_able()
        stands = math.hypot(*heard.velocity_m_s[:2]) < _NO_FLOW_M_S
        return MotionReport(
            fresh=fresh,
            told=fresh and not self._motion.frozen,
            repeats=repeats or self._flow.suspected,
            able=able,
            blind=able and (repeats or lost),
            flowless=able and (stands if repeats else lost),
            velocity_m_s=self._true(velocity),
            force_m_s2=force,
            height_m=heard.height_m,
            obeys=not self._uplink.cut,
        )

    def _is_able(self) -> bool:
        """Return whether the driver could brake the drone; one that only wind pushes holds its place better itself.

        True even before a velocity that repeats is BAD: the firmware's hover would end the loop, and with it the last
        correct speed.
        """
        others = self._plausibility.report.of(Sensor.TELEMETRY, Sensor.CLOCK, Sensor.ATTITUDE, Sensor.IMU)
        return others is not Health.BAD and self.telemetry.flight_state in UP

    def health(self, now_ns: int) -> LinkHealth:
        """Return rates, losses and refusals of the link."""
        rate_hz, quality = self._link.rates(now_ns)
        heights = Counter({"height_jump": self._publisher.heights.refused})
        rejected = dict(self._link.rejected.copy() + self._refused + heights)
        detail = ANOTHER if self._uplink.foreign else self._session.detail
        detail = "its commands do not arrive" if self._uplink.cut else detail
        clock, firmware = self._plausibility.clock.figures, self._session.identity.firmware
        return LinkHealth(quality, rate_hz, rejected, detail, clock, firmware)

    def flush(self) -> None:
        """Publish the waiting raw datagrams."""
        self._log.flush()

    def close(self) -> None:
        """Stop the reader and close the sockets."""
        self._closing.set()
        self._reader.join(timeout=1.0)
        self._link.close()
        self._log.flush()


def run(child: HostProcess) -> int:
    """Fly one AR.Drone until a stop is requested; the process entry."""
    settings = read_section(ArDroneDriverSettings, child.section, "AR.Drone")
    drone = ArDrone(settings, child.bus)

    def tell(_now_ns: int) -> None:
        for notice in drone.news():
            child.event(notice.severity, f"{drone.name}: {notice.text}", notice.remedy, drone.name)

    return fly_one(child, drone, settings.authority, RATE_HZ, tell)
