"""Gathers the files of a run into arrays, in one pass over the relevant topics."""

import math
from array import array
from collections import defaultdict
from pathlib import Path

import msgspec
import numpy as np

from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.recording.chunks import among
from groundstation.recording.copies import damage_before
from groundstation.recording.file_topics import STATE
from groundstation.recording.reader import Recording, RecordingError, open_parts, parts, recorded_offset_ns
from groundstation.recording.rerun import rerun_of
from groundstation.recording.stretch import stretch_of
from groundstation.report import run_facts
from groundstation.report.captured_truth import captured_tracks
from groundstation.report.recorded_field import recorded_field
from groundstation.report.tracks import (
    UNKNOWN_FIELD,
    CertaintyTrack,
    EstimateTrack,
    ProcessTrack,
    RunData,
    TimedMessage,
    TruthTrack,
)
from groundstation.time_units import NS_PER_S

_WANTED = (
    *(t.BELIEF, t.BODY_POSES, t.COMMAND, t.COMMAND_ACK, t.ESTIMATE, t.EVENT, t.INNOVATION, t.PLAN),
    *(t.PROCESS_STATUS, t.SEARCH_MAP, t.SIM_STATUS, t.SUSPICION, t.TRUTH, t.VEHICLE_STATUS),
)

_TENTH_NS = 100_000_000
# No run lasts longer: what is dated farther from its first message has a damaged time.
_LONGEST_RUN_NS = 30 * 86_400 * NS_PER_S


def gather(run_dir: Path) -> RunData:
    """Return the data of a run folder; raises RecordingError when it holds no recording."""
    paths = parts(run_dir, STATE)
    if not paths:
        raise RecordingError(f"{run_dir}: no {STATE}.mcap in this folder; is it a run folder?")
    data = RunData(UNKNOWN_FIELD, _facts(run_dir))
    rows = _Rows(data)
    readable, unread = open_parts(paths)
    data.damage.extend(f"{path.name}: {why}" for path, why in unread.items())
    data.resolved = recorded_field(readable, run_dir, data.damage)
    for recording in readable:
        data.rerun = data.rerun or rerun_of(recording.metadata)
        data.stretch = data.stretch or stretch_of(recording.metadata)
        rows.take(recording)
        damage = [*(f"recovered, before: {text}" for text in damage_before(recording.metadata)), *recording.damage]
        data.damage.extend(f"{recording.path.name}: {text}" for text in damage)
    rows.finish()
    return data


def _facts(run_dir: Path) -> run_facts.RunFacts:
    """Return the run's facts, its command dated as the recording dates messages: UNIX time may be set meanwhile."""
    facts = run_facts.read(run_dir)
    offset_ns = recorded_offset_ns(run_dir, facts.clock) if facts.command_ns else None
    if offset_ns is None:
        return facts
    return msgspec.structs.replace(facts, command_unix_ns=facts.command_ns + offset_ns)


class _Rows:
    """Collects plain rows, then makes arrays of them."""

    def __init__(self, data: RunData) -> None:
        self._data = data
        self._truth: defaultdict[str, list[tuple[float, ...]]] = defaultdict(list)
        self._estimates: dict[str, _EstimateRows] = {}
        self._certainties: defaultdict[str, array[float]] = defaultdict(lambda: array("d"))
        # By sender: the supervisor reports for a process that is absent, or never reports itself.
        self._processes: defaultdict[str, defaultdict[str, list[tuple[float, ...]]]]
        self._processes = defaultdict(lambda: defaultdict(list))
        self._heard: defaultdict[str, list[int]] = defaultdict(list)
        self._first_ns = 0
        self._recorded: set[int] = set()  # tenths of a second, UNIX
        self._sim: list[tuple[float, ...]] = []
        self._captured: list[TimedMessage[m.BodyPoses]] = []

    def take(self, recording: Recording) -> None:
        """Sort a recording's records into rows. Of telemetry only the time counts, which needs no decoding."""
        data, misdated = self._data, 0
        for raw in recording.raw_records(among((*_WANTED, t.ODOMETRY))):
            self._first_ns = self._first_ns or raw.log_time_ns
            if abs(raw.log_time_ns - self._first_ns) > _LONGEST_RUN_NS:
                misdated += 1
                continue
            self._recorded.add(raw.log_time_ns // _TENTH_NS)
            if raw.key.topic is t.ODOMETRY:
                self._heard[raw.key.entity].append(raw.log_time_ns)
                continue
            if (record := recording.decoded(raw)) is None:
                continue
            if data.start_unix_ns == 0:
                data.start_unix_ns = record.log_time_ns
            time_s = (record.log_time_ns - data.start_unix_ns) / 1e9
            data.end_s = max(data.end_s, time_s)
            self._sort(time_s, record.message)
        if misdated:
            recording.damage.append(f"{misdated} messages are dated far from the first")

    def _sort(self, time_s: float, message: m.Message) -> None:
        data = self._data
        match message:
            case m.TruthState():
                self._truth[message.header.entity].append(
                    (time_s, *message.position_m, message.attitude_rad[2], float(message.on_ground))
                )
            case m.BodyPoses() if message.header.entity == data.resolved.truth.get("from"):
                self._captured.append(TimedMessage(time_s, message))
            case m.Estimate():
                searched = {search.target for search in message.searches}
                for entity in message.entities:
                    rows = self._estimates.setdefault(entity.name, _EstimateRows(entity.kind, len(entity.mean)))
                    rows.append(time_s, entity)
                    doubted = entity.contradicted or entity.name in searched
                    known = (time_s, entity.age_s, entity.unlocalised_s, float(doubted))
                    self._certainties[entity.name].extend(known)
            case m.ProcessStatus():
                counters = (message.pid, message.ticks, message.overruns, message.overflowed)
                said = self._processes[message.header.entity][message.header.source]
                others = math.nan if message.others_cpu is None else message.others_cpu
                said.append((time_s, message.cpu, *map(float, counters), message.waited, others))
            case m.SimStatus():
                counts = (message.ticks, message.overruns, message.pictures, message.late_pictures)
                self._sim.append((time_s, *map(float, counts)))
            case m.Command():
                data.commands.append(TimedMessage(time_s, message))
            case m.CommandAck():
                data.acks.append(TimedMessage(time_s, message))
            case m.Belief():
                data.belief = message
            case m.Plan():
                data.plans.append(TimedMessage(time_s, message))
            case m.Innovation():
                data.innovations.append(TimedMessage(time_s, message))
            case m.VehicleStatus():
                data.vehicles.setdefault(message.header.entity, []).append(TimedMessage(time_s, message))
            case m.Suspicion():
                data.suspicions.append(TimedMessage(time_s, message))
            case m.SearchMap():
                data.search_maps.setdefault(message.header.entity, []).append(TimedMessage(time_s, message))
            case m.Event():
                data.events.append(TimedMessage(time_s, message))

    def finish(self) -> None:
        """Make the arrays; rows are sorted by time, since senders reach the recorder in no fixed order."""
        data = self._data
        self._finish_truth()
        self._finish_estimates()
        self._finish_processes()
        for name, times_ns in self._heard.items():
            data.heard_s[name] = (np.sort(np.array(times_ns, dtype=np.int64)) - data.start_unix_ns) / 1e9
        tenths = np.array(sorted(self._recorded), dtype=np.int64)
        data.recorded_s = (tenths * _TENTH_NS - data.start_unix_ns) / 1e9
        for timed in (data.commands, data.acks, data.plans, data.innovations, data.events):
            timed.sort(key=lambda item: item.time_s)
        for maps in data.search_maps.values():
            maps.sort(key=lambda item: item.time_s)

    def _finish_truth(self) -> None:
        data = self._data
        for name, rows in self._truth.items():
            table = np.array(sorted(rows))
            data.truth[name] = TruthTrack(table[:, 0], table[:, 1:4], table[:, 4], table[:, 5] > 0.5)
        if self._captured:
            system = data.resolved.motion_capture.get(data.resolved.truth["from"])
            data.truth = captured_tracks(self._captured, data.vehicles, system.rate_hz if system else 30.0)

    def _finish_estimates(self) -> None:
        data = self._data
        for name, estimates in self._estimates.items():
            data.estimates[name] = estimates.track()
        for name, numbers in self._certainties.items():
            table = np.array(numbers).reshape(-1, 4)
            table = table[np.argsort(table[:, 0], kind="stable")]
            data.certainties[name] = CertaintyTrack(table[:, 0], table[:, 1], table[:, 2], table[:, 3] > 0.5)

    def _finish_processes(self) -> None:
        data = self._data
        for name, said in self._processes.items():
            # Never both: the supervisor's status of an absent process (no pid, ticks or CPU) is no figure of it.
            table = np.array(sorted(said.get(name) or (row for rows in said.values() for row in rows)))
            data.processes[name] = ProcessTrack(table[:, 0], table[:, 1], table[:, 2:6], table[:, 6], table[:, 7])
        if self._sim:
            data.sim_counters = np.array(sorted(self._sim))[:, 1:]


class _EstimateRows:
    """The estimates of one entity as plain numbers: as messages an hour of three takes 0.7 GB more."""

    def __init__(self, kind: str, size: int) -> None:
        self._kind, self._size = kind, size
        self._numbers = array("d")

    def append(self, time_s: float, entity: m.EntityEstimate) -> None:
        """Take an estimate, unless its mean or covariance has another size than the first one's."""
        if len(entity.mean) == self._size and len(entity.covariance) == self._size**2:
            self._numbers.extend((time_s, *entity.mean, *entity.covariance))

    def track(self) -> EstimateTrack:
        """Return the arrays, in order of time."""
        size = self._size
        table = np.array(self._numbers).reshape(-1, 1 + size + size**2)
        table = table[np.argsort(table[:, 0], kind="stable")]
        covariance = table[:, 1 + size :].reshape(-1, size, size)
        return EstimateTrack(self._kind, table[:, 0], table[:, 1 : 1 + size], covariance)
