"""One flight of the campaign: world, emulated vehicles, drivers, tracker; in one thread, by a manual clock."""

import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import Any

import msgspec
import numpy as np

from drivers.watchdog_types import Action
from groundstation.arrays import Array
from groundstation.bus import clock
from groundstation.bus.api import Received
from groundstation.bus.keys import Key
from groundstation.bus.messages import Estimate, Message
from groundstation.bus.notice import Notice
from groundstation.bus.topics import ESTIMATE, OBSERVATION, SEARCHED_PICTURE, Topic
from groundstation.field.resolved import field_from_json
from groundstation.planning.planner import Planner
from groundstation.runtime.tracker_loop import TrackerFeed, TrackerSection, Tracking
from groundstation.time_units import NS_PER_S
from sim_bridge.fault_kinds import RULES, Fault, Part
from sim_bridge.faults import FaultSchedule, described
from sim_bridge.scenario import Scenario
from sim_bridge.site import parse_site
from sim_bridge.study.camera_model import eyes_of
from sim_bridge.study.delay_queue import DelayQueue
from sim_bridge.study.exposures import Exposures
from sim_bridge.study.faults.draw import Drawn
from sim_bridge.study.faults.fixed_systems import FixedSystems
from sim_bridge.study.faults.judge import Judge
from sim_bridge.study.faults.local_bus import LocalBus, LocalExchange
from sim_bridge.study.faults.memory_network import MemoryNetwork
from sim_bridge.study.faults.observed import ObservedValues
from sim_bridge.study.faults.orders import TeamOrders
from sim_bridge.study.faults.stand_ins import in_memory, manual_clock, read_all
from sim_bridge.study.faults.tracker_feed import Arrivals, InlineWorker
from sim_bridge.study.faults.vehicles import Drivers, Section, devices_of, placed
from sim_bridge.study.faults.wrong_cameras import WrongEye
from sim_bridge.study.wrong_figures import WrongFigures, misdated
from sim_bridge.world.noise import generator_of
from sim_bridge.world.world import TICK_NS, World

_START_NS = 1_000 * NS_PER_S
_DETECTOR_MS = (10.0, 50.0)
_JUDGE_TICKS = 10
JUDGE_S = _JUDGE_TICKS * TICK_NS / 1e9
_ORDER_TICKS = 20
# Modes of a driver whose drone no longer flies, or comes down: CUT, too, of which it falls.
DOWN = frozenset({"LANDING", "LANDED", "CUT"})
# Deadline for the team to track: AR.Drones take 8 s, MAVLink vehicles longer.
TRACKING_BY_S = 30.0


class FaultFlight:
    """A flight in progress. `run` flies it to its end and returns the verdict, with the time spent on each part.

    wrong: wrong figures of the field; None: only video delays, if the scenario's differ.
    """

    def __init__(
        self,
        drawn: Drawn,
        sections: Sequence[Section],
        seconds: float,
        planner_of: Callable[[Planner], Planner] = lambda planner: planner,
        wrong: WrongFigures | None = None,
    ) -> None:
        field = field_from_json(msgspec.json.encode(drawn.field))
        scenario, seed = drawn.scenario, drawn.seed
        wrong = wrong or misdated(field, scenario.cameras.video_delay_ms)
        self._drawn, self._seconds, self._field, self._wrong = drawn, seconds, field, wrong
        self.site = parse_site(msgspec.to_builtins(wrong.world(field)))
        self.world = World(self.site, scenario, seed)
        self.said: list[tuple[str, str]] = []
        self.events: list[tuple[float, str]] = []
        self.spent_s: defaultdict[str, float] = defaultdict(float)
        self._rng = generator_of(seed, "study")
        self._exchange, self._network = LocalExchange(), MemoryNetwork()
        self._arriving = DelayQueue[tuple[Topic, Message]]()
        faults = scenario.faults
        self._values = {n: ObservedValues(fault for fault in faults if fault.entity == n) for n in self.world.drones}
        addresses = {name: drone.address for name, drone in field.drones.items()}
        with manual_clock(lambda: self.now_ns), in_memory(self._network) as self._readers:
            world = self.world
            self.devices = devices_of(self.site, world, scenario, self._values, addresses, self._network)
            self.drivers = Drivers(placed(sections, drawn.field), self._bus, self.said)
        self.orders = TeamOrders(self._bus("operator"))
        self._tracker_bus = self._bus("tracker")
        section = TrackerSection(field, epoch=1)
        self.planning: InlineWorker

        def worker_of(planner: Planner) -> InlineWorker:
            self.planning = InlineWorker(planner_of(planner), bool(field.planner.plug_in))
            return self.planning

        feed = TrackerFeed(Arrivals(self._tracker_bus, self.heeds), worker_of, clock.clock_id())
        self.tracking = Tracking(self._tracker_bus, section, feed)
        self._tick_every = round(1e9 / field.estimator.rate_hz) // TICK_NS
        eyes = [WrongEye(eye, faults) for eye in eyes_of(self.site, scenario.cameras, 0.0, seed)]
        self._exposures, self._eyes = Exposures(eyes), {eye.name: eye for eye in eyes}
        self._estimates = self._bus("cameras").subscribe([ESTIMATE], newest=True)
        self._systems = FixedSystems(self.site, world, scenario, seed)
        self._schedule = FaultSchedule(scenario.faults, self.world, self.devices)
        limits = {name: drone.limits.max_speed_m_s for name, drone in field.drones.items()}
        self.judge = Judge(drawn.field["room"], limits, JUDGE_S, root=self._only_root())
        self.tracking_since_s: float | None = None
        self._lifted_off = False

    def _bus(self, source: str) -> LocalBus:
        return LocalBus(self._exchange, self._field.site, source)

    @property
    def now_ns(self) -> int:
        """Return the manual clock."""
        return _START_NS + self.world.ticks * TICK_NS

    def run(self) -> dict[str, Any]:
        """Fly to the end."""
        began = time.process_time()
        with manual_clock(lambda: self.now_ns):
            while not self.is_over():
                self.step()
        self.spent_s["cpu"] = time.process_time() - began
        return self._report()

    def is_over(self) -> bool:
        """Return whether the flight ends: after its time of tracking, or if tracking did not begin in time."""
        since_s, now_s = self.tracking_since_s, self.world.time_s
        return now_s >= TRACKING_BY_S if since_s is None else now_s - since_s >= self._seconds

    def step(self) -> None:
        """Advance the world by one tick, and everything that is due."""
        mark = time.perf_counter()
        for device in self.devices.values():
            device.receive()
        self.world.step()
        for device in self.devices.values():
            device.send()
        mark = self._spent("world", mark)
        self._look()
        self._hear()
        mark = self._spent("cameras", mark)
        now_ns, ticks = self.now_ns, self.world.ticks
        read_all(self._readers)
        mark = self._spent("readers", mark)
        self._deliver(now_ns)
        if ticks % self._tick_every == 0:
            self.tracking.tick(now_ns)
            mark = self._spent("tracker", mark)
        if ticks % _ORDER_TICKS == 0 and self.may_start():
            self.orders.step(now_ns, self.drivers.hosts)
        self.drivers.turn(now_ns, ticks)
        self._spent("drivers", mark)
        if ticks % _JUDGE_TICKS == 0:
            self._judge()

    def _spent(self, what: str, mark: float) -> float:
        now = time.perf_counter()
        self.spent_s[what] += now - mark
        return now

    def _look(self) -> None:
        world, now_ns = self.world, self.now_ns
        for received in self._estimates.drain():
            if isinstance(received.message, Estimate):
                for each in self._eyes.values():
                    each.eye.take(received.message)
        for eye in self._exposures.due(world.time_s):
            delay_ms = self._drawn.scenario.cameras.video_delay_ms + self._rng.uniform(*_DETECTOR_MS)
            seen = eye.look(world, now_ns, clock.clock_id())
            for sighting in seen:
                arrival_ns = sighting.header.stamp_ns + round(delay_ms * 1e6)
                self._send(arrival_ns, OBSERVATION, self._wrong.reported(sighting))
            if (searched := eye.searched(seen, now_ns, clock.clock_id())) is not None:
                self._send(searched.header.stamp_ns + round(delay_ms * 1e6), SEARCHED_PICTURE, searched)

    def _hear(self) -> None:
        """Send the measurements of sensors other than cameras."""
        for arrival_ns, topic, told in self._systems.due(self.now_ns, clock.clock_id()):
            self._send(arrival_ns, topic, told)

    def _send(self, arrival_ns: int, topic: Topic, message: Message) -> None:
        self._arriving.send(arrival_ns, (topic, message))

    def _deliver(self, now_ns: int) -> None:
        for topic, message in self._arriving.due(now_ns):
            key = Key(self._field.site, message.header.entity, topic, message.header.source)
            self._exchange.deliver(Received(key, message.header, message, b""))

    def _judge(self) -> None:
        now_s = self.world.time_s
        for _, line in self._schedule.apply(now_s):
            self.events.append((now_s, line))
        for notice in self.tracking.notices:
            self.note(now_s, notice)
        self.tracking.notices.clear()
        self.events += [(now_s, text) for _, text in self.said]
        self.said.clear()
        if self.orders.tracking and self.tracking_since_s is None:
            self.tracking_since_s = now_s
        self._lifted_off = self._lifted_off or bool(self.world.airborne)
        if not self._lifted_off:
            return
        truth = dict(zip(self.world.bodies, self.world.states().copy(), strict=True))
        told = {name: decision.action is Action.FLY for name, decision in self.drivers.decisions.items()}
        believed = {name: self.believed(name) for name in self.world.drones}
        deaf = [name for name, device in self.devices.items() if device.deaf]
        self.judge.see(now_s, truth, told, believed, deaf)
        if self.tracking_since_s is not None:
            self.watch()

    def heeds(self, message: Message) -> bool:
        """Return whether the tracker takes a message; studies of other methods override it."""
        return True

    def may_start(self) -> bool:
        """Return whether the team may be ordered to take off; studies of the time before it override it."""
        return True

    def note(self, now_s: float, notice: Notice) -> None:
        """Take a notice of the tracker to the operator."""
        self.events.append((now_s, notice.text))

    def watch(self) -> None:
        """Do nothing; other studies override it, called each time that the tracking team is judged."""

    @property
    def scenario(self) -> Scenario:
        """Return the scenario with its faults."""
        return self._drawn.scenario

    def modes(self) -> dict[str, str]:
        """Return the mode of each drone's driver."""
        return {name: str(host.watchdog.mode) for name, host in self.drivers.hosts.items()}

    def believed(self, name: str) -> Array | None:
        """Return the believed place of a body [x, y in m]; None if unknown."""
        belief = self.tracking.tracker.belief
        return np.asarray(belief.mean_of(name)[:2]) if name in belief.layout else None

    def _only_root(self) -> str | None:
        roots = self._field.world_sensors
        return roots[0] if len(roots) == 1 else None

    def _observable(self, fault: Fault) -> float | None:
        if RULES[fault.kind].part is Part.CAMERA:
            return self._eyes[fault.entity].observable_s(fault)
        values = self._values.get(fault.entity)
        return fault.start_s if values is None else values.observable_s(fault)

    def _report(self) -> dict[str, Any]:
        faults = self._drawn.scenario.faults
        observable = tuple(self._observable(fault) for fault in faults)
        reasons = {name: host.watchdog.reason for name, host in self.drivers.hosts.items()}
        verdict = self.judge.verdict(faults, observable) if self._lifted_off else {}
        return {
            "seed": self._drawn.seed,
            "kinds": sorted(str(fault.kind) for fault in faults),
            "faults": [
                {
                    "kind": str(fault.kind),
                    "what": described(fault),
                    "start_s": round(fault.start_s, 2),
                    "end_s": fault.end_s,
                    "observable_s": at_s,
                    "stop_judged": self.judge.stop_judged(fault, at_s),
                }
                for fault, at_s in zip(faults, observable, strict=True)
            ],
            "tracking_since_s": self.tracking_since_s,
            "modes": self.modes(),
            "reasons": reasons,
            "planning": self.planning.failed,
            **verdict,
            "spent_s": {name: round(value, 3) for name, value in self.spent_s.items()}
            | {"plan": round(self.planning.median_s, 5)},
        }
