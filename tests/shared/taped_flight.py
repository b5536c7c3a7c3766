"""A synthetic flight of two drones with known results, written as a recording."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.api import Sample
from groundstation.bus.codec import encode
from groundstation.bus.keys import expression
from groundstation.recording.capture import Capture
from groundstation.recording.mcap_file import McapFile
from groundstation.recording.preamble import Preamble
from groundstation.recording.timeline import Timeline
from groundstation.settings.load import load_field

S = 1_000_000_000
UNIX = 1_700_000_000 * S
FLAT, STRING = "drone_1,drone_2", "drone_1/drone_2"
FIELD = load_field(Path(__file__).parents[1] / "fixtures/field/lab.yaml").model_dump_json().encode()


@dataclass
class Flight:
    """A flight: 2 s on the ground, take-off, TRACK at 10 s, LAND at 10 s + tracking_s, on the ground 3 s later."""

    tracking_s: float = 20.0
    target_bias_m: float = 0.1
    target_missing: tuple[float, float] = (0.0, 0.0)
    offset_2_m: tuple[float, float, float] = (-1.0, 0.0, 0.0)
    land_at_all: bool = True
    estimator_stops_s: float = 1e9
    topology: Callable[[float], str] = field(default=lambda time_s: FLAT if time_s < 20.0 else STRING)
    missed_per_s: int = 0
    sim_late_per_s: int = 0
    unrecorded_s: tuple[float, float] = (0.0, 0.0)

    @property
    def end_s(self) -> float:
        return 10.0 + self.tracking_s

    def target(self, time_s: float) -> tuple[float, float]:
        phase = 2 * math.pi * time_s / 62.0
        return 3.1 * math.sin(phase), 0.8 * math.sin(2 * phase)

    def drone(self, name: str, time_s: float) -> tuple[float, float, float]:
        x, y = self.target(time_s)
        height = 1.3 * min(1.0, max(0.0, (time_s - 2.0) / 4.0))
        offset = self.offset_2_m if name == "drone_2" else (0.0, 0.0, 0.0)
        string = self.topology(time_s) == STRING and name == "drone_1"
        return 0.8 * x + offset[0], 0.8 * y + offset[1], height + offset[2] + (0.9 if string else 0.0)

    def on_ground(self, time_s: float) -> bool:
        return time_s < 2.0 or (self.land_at_all and time_s > self.end_s + 3.0)


class Tape:
    """Writes messages with chosen stamps into a recording."""

    def __init__(self, folder: Path) -> None:
        attachments = {"field.json": ("application/json", FIELD)}
        self._file = McapFile(folder / "state.mcap", Preamble({}, attachments, UNIX))
        self._capture = Capture(Timeline("here", UNIX))
        self._seq = 0

    def header(self, time_s: float, entity: str, source: str) -> m.Header:
        self._seq += 1
        return m.Header(round(time_s * S), "here", entity, source, self._seq)

    def put(self, topic: t.Topic, message: m.Message) -> None:
        header = message.header
        key = expression("lab", topic, header.entity, header.source)
        entry = self._capture.entry(Sample(key, encode(message)), header.stamp_ns)
        assert entry is not None
        self._file.write(entry)

    def close(self) -> None:
        self._file.close()


def fly(folder: Path, flight: Flight) -> Path:
    """Record a flight; returns the run folder."""
    tape = Tape(folder)
    for tick in range(round((flight.end_s + 4.0) * 50)):
        time_s = tick / 50
        if flight.unrecorded_s[0] <= time_s < flight.unrecorded_s[1]:
            continue
        _truth(tape, flight, time_s)
        if time_s < flight.estimator_stops_s:
            _estimate(tape, flight, time_s)
        if tick % 5 == 0 and time_s > 5.0:
            _plan(tape, flight, time_s)
        if tick % 50 == 0:
            statuses(tape, flight, time_s)
        if tick == 500:
            _command(tape, time_s, m.Verb.TRACK)
        if tick == round(flight.end_s * 50):
            _command(tape, time_s, m.Verb.LAND)
    header = tape.header(12.0, "drone_1", "drone_1")
    tape.put(t.EVENT, m.Event(header=header, severity=m.Severity.WARNING, text="battery low"))
    tape.close()
    return folder


def _truth(tape: Tape, flight: Flight, time_s: float) -> None:
    bodies = {name: flight.drone(name, time_s) for name in ("drone_1", "drone_2")}
    bodies["turtlebot"] = (*flight.target(time_s), 0.0)
    for name, position in bodies.items():
        ground = name == "turtlebot" or flight.on_ground(time_s)
        zero = (0.0, 0.0, 0.0)
        header = tape.header(time_s, name, "sim_bridge")
        state = m.TruthState(
            header=header, position_m=position, velocity_m_s=zero, attitude_rad=(0.0, 0.0, 3.1), on_ground=ground
        )
        tape.put(t.TRUTH, state)


def _estimate(tape: Tape, flight: Flight, time_s: float) -> None:
    def entity(name: str, kind: str, mean: tuple[float, ...], variance: float) -> m.EntityEstimate:
        size = len(mean)
        covariance = tuple(variance if row == column else 0.0 for row in range(size) for column in range(size))
        return m.EntityEstimate(name, kind, mean, covariance, (0.0,) * 3, True, 0.1)

    entities = [
        entity(name, "robot", (*flight.drone(name, time_s)[:2], flight.drone(name, time_s)[2] + 0.05, -3.1), 0.0025)
        for name in ("drone_1", "drone_2")
    ]
    x, y = flight.target(time_s)
    if not flight.target_missing[0] <= time_s < flight.target_missing[1]:
        entities.append(entity("turtlebot", "target", (x + flight.target_bias_m, y), 0.005))
    tape.put(t.ESTIMATE, m.Estimate(header=tape.header(time_s, "team", "tracker"), entities=tuple(entities), epoch=1))


def _plan(tape: Tape, flight: Flight, time_s: float) -> None:
    solver = m.SolverReport("ok", 40, 0.010 if round(time_s * 10) % 50 else 0.030, 3, 1)
    header = tape.header(time_s, "team", "tracker")
    text = flight.topology(time_s)
    plan = m.Plan(
        header=header, topology=text, cost=0.01, controls=(), edges=(), alternatives=(), solver=solver, mode="x"
    )
    tape.put(t.PLAN, plan)


def statuses(tape: Tape, flight: Flight, time_s: float) -> None:
    second = round(time_s)
    for name, cpu in (("tracker", 0.4), ("sim_bridge", 0.5)):
        header = tape.header(time_s, name, name)
        status = m.ProcessStatus(
            header=header,
            state=m.Lifecycle.READY,
            pid=1,
            cpu=cpu,
            ticks=50 * second,
            overruns=flight.missed_per_s * second,
        )
        tape.put(t.PROCESS_STATUS, status)
    header = tape.header(time_s, "sim_bridge", "sim_bridge")
    late = flight.sim_late_per_s * second
    tape.put(t.SIM_STATUS, m.SimStatus(header=header, ticks=500 * second, overruns=late))


def _command(tape: Tape, time_s: float, verb: m.Verb) -> None:
    header = tape.header(time_s, "team", "operator")
    tape.put(t.COMMAND, m.Command(header=header, id="c", verb=verb, scope=(), issuer="operator"))
    for drone in ("drone_1", "drone_2"):
        header = tape.header(time_s, drone, drone)
        tape.put(t.COMMAND_ACK, m.CommandAck(header=header, command_id="c", verb=verb, stage=m.AckStage.ACCEPTED))
