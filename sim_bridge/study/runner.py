"""One flight at message level: world, sensors, delays, tracker and pilots in one thread under a manual clock."""

import time
from collections import defaultdict
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any, Protocol

import msgspec
import numpy as np

from groundstation import plug_ins
from groundstation.bus.messages import EntityEstimate, Estimate, Header, Message, Odometry, VehicleStatus
from groundstation.errors import SettingsError
from groundstation.field.resolved import ResolvedField
from groundstation.time_units import NS_PER_MS, NS_PER_S
from groundstation.tracker import Tracker, tracker_from_field
from sim_bridge.scenario import Scenario
from sim_bridge.site import parse_site
from sim_bridge.study.ardrone_pilot import Pilot
from sim_bridge.study.camera_model import Eye, eyes_of
from sim_bridge.study.capture_model import CaptureEye, captures_of
from sim_bridge.study.delay_queue import DelayQueue
from sim_bridge.study.exposures import Exposures
from sim_bridge.study.mavlink_copter import CopterLink
from sim_bridge.study.odometry_model import OdometryEar, odometry_of
from sim_bridge.study.ranging_model import RangingEye, ranging_of
from sim_bridge.study.score import FlightScore
from sim_bridge.study.telemetry import TelemetryPublisher
from sim_bridge.study.wrong_figures import WrongFigures, misdated
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.mavlink_copter import MavlinkCopter
from sim_bridge.world.noise import generator_of
from sim_bridge.world.world import TICK_NS, World

CLOCK = "study"
_START_NS = 1_000 * NS_PER_S
_ODOMETRY_LATENCY_NS = 4 * NS_PER_MS
_PILOT_TICKS = 6
_STATUS_TICKS = 40
_SCORE_TICKS = 20
_OBEYS = "TRACK"


@dataclass(frozen=True, slots=True)
class StudyOptions:
    """duration_s: tracking after take-off; outliers: share of grossly wrong sightings; plan: False leaves the drones
    hovering; detector_ms: added to the video delay by the camera process; take_off_s: simulated time until the
    drones hover and tracking begins; stand_s: before that; inertia: AR.Drones publish gyroscopes and accelerometers."""

    seed: int = 1
    duration_s: float = 60.0
    outliers: float = 0.0
    plan: bool = True
    detector_ms: tuple[float, float] = (10.0, 50.0)
    take_off_s: float = 6.5
    stand_s: float = 0.0
    inertia: bool = False


class FlownLink(Protocol):
    """A study's interface to the driver of one drone."""

    def obey(self, velocity: tuple[float, float, float], yaw_rate: float, now_s: float) -> None:
        """Take a setpoint [base_stabilized]."""

    def step(self, now_s: float, estimates: tuple[EntityEstimate, ...]) -> None:
        """Do what is due at a tick."""

    def odometry(self, stamp_ns: int) -> Odometry | None:
        """Return the reading of this tick, if one is due."""

    def status(self, stamp_ns: int, mode: str) -> VehicleStatus:
        """Return the vehicle's state, in a driver's mode."""


class Study:
    """A run in progress; `run` flies it to its end and returns the figures; raises SettingsError for a failing plug-in.

    mode: that of all drivers; in HOVER and HOLD drones are only kept at their places. real: drones whose bodies are
    moved from outside (`world.puppets`); `attach` gives each a driver. wrong: wrong figures of the field; None: only
    video delays, if the scenario's differ.
    """

    def __init__(
        self,
        field: ResolvedField,
        scenario: Scenario,
        options: StudyOptions,
        real: Collection[str] = (),
        wrong: WrongFigures | None = None,
    ) -> None:
        self.mode = _OBEYS if options.plan else "HOVER"
        self.options, self._wrong = options, wrong or misdated(field, scenario.cameras.video_delay_ms)
        self.site = parse_site(msgspec.to_builtins(self._wrong.world(field)))
        self.world = World(self.site, scenario, options.seed, real, real)
        self.tracker: Tracker = tracker_from_field(field, CLOCK, epoch=1)
        self._estimates: tuple[EntityEstimate, ...] = ()  # of the tracker's last tick
        self._plug_in = field.planner.plug_in
        if self._plug_in:
            parameters = self.tracker.parameters
            self.tracker.planner = plug_ins.planner(self._plug_in, parameters.planner, parameters.sensors)
        self.score = FlightScore(_SCORE_TICKS * TICK_NS / 1e9, field.estimator.gate_probability)
        self.spent_s: defaultdict[str, float] = defaultdict(float)
        self._rng = generator_of(options.seed, "study")
        self._scenario = scenario
        self._arriving = DelayQueue[tuple[str, Message]]()
        self._tick_every = round(1e9 / field.estimator.rate_hz) // TICK_NS
        self._plan_every = round(1e9 / field.planner.rate_hz) // TICK_NS
        world = self.world
        for onboard in world.onboard.values():
            onboard.trim()  # as the driver does at connect
        lifetime = field.safety.setpoint_lifetime_ms / 1000
        self._links: dict[str, FlownLink] = {
            n: CopterLink(n, c, CLOCK, lifetime) for n, c in world.of(MavlinkCopter).items()
        }
        self._telemetry: dict[str, TelemetryPublisher | FlownLink] = {
            name: TelemetryPublisher(name, drone, world.onboard[name], CLOCK, phase)
            for phase, (name, drone) in enumerate(world.of(Quadrotor).items())
        }
        self._telemetry |= self._links
        self._pilots = {
            name: Pilot(drone, world.onboard[name], field.drones[name].odometry.velocity_scale, lifetime)
            for name, drone in world.of(Quadrotor).items()
        }
        self._eyes: list[Eye | CaptureEye | RangingEye] = [
            *eyes_of(self.site, scenario.cameras, options.outliers, options.seed),
            *captures_of(self.site, scenario.cameras.mounting_errors, options.seed),
            *ranging_of(self.site, scenario.cameras.mounting_errors, options.seed),
        ]
        self._exposures = Exposures(self._eyes)
        # A schedule of its own: reports of the target do not shift when cameras expose.
        self._reports = Exposures(odometry_of(self.site, world, scenario.cameras.mounting_errors, options.seed))
        fence = field.room.fence
        self._fence = np.array([fence.x_m, fence.y_m, fence.z_m])
        self.fence_violation_m = 0.0

    def attach(self, name: str, link: FlownLink) -> None:
        """Give a real drone its driver."""
        self._links[name] = self._telemetry[name] = link

    @property
    def now_ns(self) -> int:
        """Return the manual clock."""
        return _START_NS + self.world.ticks * TICK_NS

    def run(self) -> dict[str, Any]:
        """Fly until the duration is over; returns the figures, with the CPU time of each part."""
        cpu, wall = time.process_time(), time.perf_counter()
        for _ in range(round(self.options.stand_s * 1e9) // TICK_NS):
            self.step()
        for drone in self.world.of(Quadrotor).values():
            drone.autopilot.take_off()
        ticks = round((self.options.take_off_s + self.options.duration_s) * 1e9) // TICK_NS
        for _ in range(ticks):
            self.step()
        report = self.score.report()
        report["max_fence_violation_m"] = round(self.fence_violation_m, 3)
        total_s = time.process_time() - cpu
        # Parts are timed by the wall clock, and scaled by the CPU time of the whole.
        share = total_s / (time.perf_counter() - wall)
        report["cpu_s"] = {name: round(share * value, 2) for name, value in self.spent_s.items()}
        report["cpu_s"]["total"] = round(total_s, 2)
        flown_s = round(self.world.time_s, 3)
        return {"seed": self.options.seed, "duration_s": self.options.duration_s, "flown_s": flown_s, **report}

    def step(self) -> None:
        """Advance the world by one tick, and everything that is due."""
        world = self.world
        mark = time.perf_counter()
        world.step()
        for link in self._links.values():
            link.step(world.time_s, self._estimates)
        self._sense()
        self.spent_s["world"] += time.perf_counter() - mark
        tracking = world.time_s >= self.options.take_off_s + self.options.stand_s
        if world.ticks % self._tick_every == 0:
            self._tick(tracking)
        if world.ticks % _PILOT_TICKS == 0:
            for pilot in self._pilots.values():
                pilot.step(world.time_s)
        if tracking and world.ticks % _SCORE_TICKS == 0:
            self._judge()

    def _sense(self) -> None:
        world, now_ns = self.world, self.now_ns
        for name, telemetry in self._telemetry.items():
            if (odometry := telemetry.odometry(now_ns)) is not None:
                self._send(now_ns + _ODOMETRY_LATENCY_NS, f"odometry/{name}", odometry)
            if self.options.inertia and isinstance(telemetry, TelemetryPublisher):
                self._send(now_ns + _ODOMETRY_LATENCY_NS, f"imu/{name}", telemetry.inertia(now_ns))
            if world.ticks % _STATUS_TICKS == 0:
                self._send(now_ns + _ODOMETRY_LATENCY_NS, f"status/{name}", telemetry.status(now_ns, self.mode))
        for eye in self._exposures.due(world.time_s):
            if isinstance(eye, RangingEye):
                self._tell(eye, now_ns)
                continue
            if isinstance(eye, Eye):
                eye.take(self._estimate())
            delay_ms = eye.lateness_ms
            if delay_ms is None:
                delay_ms = self._scenario.cameras.video_delay_ms + self._rng.uniform(*self.options.detector_ms)
            seen = eye.look(world, now_ns, CLOCK)
            for sighting in seen:
                # A later frame arrives with the delay by which its stamp is off.
                arrival_ns = sighting.header.stamp_ns + round(delay_ms * 1e6)
                self._send(arrival_ns, f"observation/{eye.name}", self._wrong.reported(sighting))
            if (searched := eye.searched(seen, now_ns, CLOCK)) is not None:
                self._send(now_ns + round(delay_ms * 1e6), f"searched_picture/{eye.name}", searched)

        for ear in self._reports.due(world.time_s):
            self._tell(ear, now_ns)

    def _estimate(self) -> Estimate:
        """Return the tracker's estimates for its cameras."""
        tracker = self.tracker
        header = Header(tracker.belief.stamp_ns, CLOCK, "team", "tracker", self.world.ticks)
        searches = tracker.lookout.searches(self.now_ns)
        return Estimate(header=header, entities=self._estimates, epoch=tracker.epoch, searches=searches)

    def _tell(self, sensor: RangingEye | OdometryEar, now_ns: int) -> None:
        for told in sensor.look(self.world, now_ns, CLOCK):
            self._send(now_ns + round(sensor.lateness_ms * 1e6), f"told/{sensor.name}", told)

    def _send(self, arrival_ns: int, key: str, message: Message) -> None:
        self._arriving.send(arrival_ns, (key, message))

    def _arrived(self) -> tuple[tuple[str, Message], ...]:
        """Return the messages that reached the tracker since the last call."""
        return tuple(self._arriving.due(self.now_ns))

    def _tick(self, tracking: bool) -> None:
        now_ns, tracker = self.now_ns, self.tracker
        mark = time.perf_counter()
        for key, message in self._arrived():
            tracker.ingest(key, message, now_ns)
        tracker.advance(now_ns)
        self._estimates = tracker.estimates()
        self.spent_s["filter"] += time.perf_counter() - mark
        for correction in tracker.take_corrections():
            self.score.note(correction)
        tracker.take_notices()
        obeys = tracking and self.mode == _OBEYS
        if self.mode == _OBEYS and not tracking:
            return
        mark = time.perf_counter()
        if obeys and self.world.ticks % self._plan_every == 0:
            self._plan()
        self.spent_s["planner"] += time.perf_counter() - mark
        mark = time.perf_counter()
        for name, limited in tracker.setpoints(now_ns).items():
            setpoint = limited.setpoint
            if not (obeys or limited.holds):
                continue
            pilot = self._links.get(name) or self._pilots[name]
            pilot.obey(setpoint.velocity_m_s, setpoint.yaw_rate_rad_s, self.world.time_s)
        self.spent_s["setpoints"] += time.perf_counter() - mark

    def _plan(self) -> None:
        try:
            self.tracker.plan()
        except (Exception, SystemExit) as error:
            if not self._plug_in:
                raise
            raise SettingsError([f"planner.plug_in {self._plug_in}: {plug_ins.reason(error)}"]) from error

    def _judge(self) -> None:
        states = self.world.states().copy()
        truth = dict(zip(self.world.bodies, states, strict=True))
        belief = self.tracker.belief
        ages_s = {name: self.tracker.filter.age_s(name) for name in belief.layout.robots}
        self.score.take(belief, truth, tuple(self.world.targets), str(self.tracker.topology), ages_s)
        drones = states[: len(self.world.drones), :3]
        outside = np.maximum(self._fence[:, 0] - drones, drones - self._fence[:, 1])
        self.fence_violation_m = max(self.fence_violation_m, float(outside.max()))
