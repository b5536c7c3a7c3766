"""A study flight through the tracker's own loop, recorded as the recorder would: real files in a second, no process."""

from collections import Counter
from pathlib import Path

import msgspec

from groundstation.bus import codec, keys
from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.api import Sample
from groundstation.bus.topics import Topic
from groundstation.field.resolved import ResolvedField
from groundstation.planning.planner import Planner, PlanRequest
from groundstation.recording.capture import Capture
from groundstation.recording.mcap_file import McapFile
from groundstation.recording.preamble import Preamble, preamble_of_run
from groundstation.recording.timeline import Timeline
from groundstation.replay.rerun import JournalBus
from groundstation.runtime.journal import Adoption
from groundstation.runtime.tracker_loop import TrackerFeed, TrackerSection, Tracking
from sim_bridge.scenario import Scenario
from sim_bridge.study.runner import CLOCK, Study, StudyOptions

SITE = "lab"
UNIX_OFFSET_NS = 1_795_000_000_000_000_000
_EVALUATIONS = 40
_PLANNING_TICKS = 2
_FREQUENT = (t.ESTIMATE, t.SETPOINT)
_TOPICS = {
    "odometry": t.ODOMETRY,
    "status": t.VEHICLE_STATUS,
    "observation": t.OBSERVATION,
    "searched_picture": t.SEARCHED_PICTURE,
}


class Arrivals:
    """The study's messages at a tick."""

    def __init__(self) -> None:
        self.refused: Counter[str] = Counter()
        self.overflowed = 0
        self.ready: list[tuple[str, m.Message]] = []

    def pop_ready(self) -> list[tuple[str, m.Message]]:
        ready, self.ready = self.ready, []
        return ready


class Worker:
    """Plans with a fixed number of evaluations; the plan arrives two ticks later, as from a thread that took 40 ms."""

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self._done: tuple[int, Adoption] | None = None
        self._polls = 0

    @property
    def idle(self) -> bool:
        return self._done is None

    def submit(self, tick: int, request: PlanRequest) -> None:
        plan = request.put_to(self._planner, lambda: False, _EVALUATIONS)
        self._done = (self._polls + _PLANNING_TICKS, Adoption(tick, plan))

    def poll(self) -> Adoption | None:
        self._polls += 1
        if self._done is None or self._polls < self._done[0]:
            return None
        (_, done), self._done = self._done, None
        return done

    def close(self) -> None:
        pass


class FlownStudy(Study):
    """Flies and records. small: less odometry, and a tenth of the messages sent 50 times a second."""

    def __init__(self, field: ResolvedField, folder: Path, options: StudyOptions, small: bool = False) -> None:
        super().__init__(field, Scenario(), options)
        self._odometry_every, self._said_every, self._truth_every = (8, 10, 40) if small else (1, 1, 10)
        self._arrivals = Arrivals()
        self._bus = JournalBus(SITE, "tracker", CLOCK)
        self._tracking = Tracking(self._bus, TrackerSection(field, 1), TrackerFeed(self._arrivals, Worker, CLOCK))
        self.tracker = self._tracking.tracker
        timeline = Timeline(CLOCK, UNIX_OFFSET_NS)
        self._capture = Capture(timeline)
        preamble = preamble_of_run(msgspec.json.encode(field), 1, timeline, folder)
        self._file = McapFile(folder / "state.mcap", Preamble(preamble.metadata, preamble.attachments, UNIX_OFFSET_NS))
        self._tracked = False

    def fly(self) -> None:
        """Fly to the end and close the file."""
        self.run()
        order = m.Command(
            header=self._header("team", "operator"), id="2", verb=m.Verb.LAND, scope=(), issuer="operator"
        )
        self.record(t.COMMAND, order)
        self._tracking.close()
        self._file.close()

    def record(self, topic: Topic, message: m.Message) -> None:
        header = message.header
        key = keys.expression(SITE, topic, header.entity, header.source)
        entry = self._capture.entry(Sample(key, codec.encode(message)), self.now_ns)
        assert entry is not None
        self._file.write(entry)

    def _header(self, entity: str, source: str) -> m.Header:
        return m.Header(self.now_ns, CLOCK, entity, source, self.world.ticks)

    def _send(self, arrival_ns: int, key: str, message: m.Message) -> None:
        kind = key.split("/")[0]
        if kind != "odometry" or message.header.seq % self._odometry_every == 0:
            super()._send(arrival_ns, kind, message)

    def _tick(self, tracking: bool) -> None:
        if tracking and not self._tracked:
            self._begin_tracking()
        for kind, message in self._arrived():
            header = message.header
            key = keys.expression(SITE, _TOPICS[kind], header.entity, header.source)
            self._arrivals.ready.append((key, message))
            self.record(_TOPICS[kind], message)
        self._bus.now_ns = self.now_ns
        self._tracking.tick(self.now_ns)
        for topic, message in self._bus.said:
            if topic not in _FREQUENT or self.world.ticks // self._tick_every % self._said_every == 0:
                self.record(topic, message)
            if tracking and isinstance(message, m.VelocitySetpoint):
                pilot = self._pilots[message.header.entity]
                pilot.obey(message.velocity_m_s, message.yaw_rate_rad_s, self.world.time_s)
        self._bus.said.clear()
        if self.world.ticks % self._truth_every == 0:
            self._tell_truth()

    def _begin_tracking(self) -> None:
        self._tracked = True
        for name in self._pilots:
            ack = m.CommandAck(
                header=self._header(name, name), command_id="1", verb=m.Verb.TRACK, stage=m.AckStage.EFFECTIVE
            )
            self.record(t.COMMAND_ACK, ack)

    def _tell_truth(self) -> None:
        for name, row in zip(self.world.bodies, self.world.states().tolist(), strict=True):
            truth = m.TruthState(
                header=self._header(name, "sim_bridge"),
                position_m=tuple(row[:3]),
                velocity_m_s=tuple(row[3:6]),
                attitude_rad=tuple(row[6:9]),
                on_ground=row[2] < 0.05,
            )
            self.record(t.TRUTH, truth)
