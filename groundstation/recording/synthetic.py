"""A made-up run of two drones with the topics, rates and sizes of the demo's: for benches and tests of recordings.

It uses no simulator: bodies move in circles, and estimates are those circles with full-precision noise.
"""

import heapq
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random

from groundstation.bus import codec, keys
from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.api import Sample
from groundstation.bus.topics import Topic
from groundstation.recording.rotating_file import NO_ROTATION, Rotation
from groundstation.recording.timeline import Timeline
from groundstation.recording.writing import RunWriter
from groundstation.time_units import NS_PER_MS, NS_PER_S

SITE = "lab"
CLOCK = "synthetic"
UNIX_OFFSET_NS = 1_700_000_000 * NS_PER_S
DRONES = ("drone_1", "drone_2")
_TARGET = "turtlebot"
_TURN_NS = 66 * NS_PER_MS
# Several different ones, because compression would recognise repetitions.
_JPEGS = [b"\xff\xd8" + Random(number).randbytes(28_000) + b"\xff\xd9" for number in range(16)]
_DATAGRAMS = [Random(number).randbytes(6000) for number in range(16)]

Build = Callable[[m.Header, float], m.Message]


@dataclass(frozen=True, slots=True)
class _Stream:
    topic: Topic
    entity: str
    source: str
    rate_hz: float
    build: Build | list[bytes]


class SyntheticRun:
    """Samples of a run in order of time; deterministic in its seed."""

    def __init__(self, seed: int = 1) -> None:
        self._random = Random(seed)
        self._streams = list(self._all_streams())

    def samples(self, begin_s: float, end_s: float) -> Iterator[tuple[int, Sample]]:
        """Yield (arrival [ns, boot clock], sample) with begin <= time < end; a run begins at 0 s."""
        due = [
            (number / stream.rate_hz, index, number)
            for index, stream in enumerate(self._streams)
            for number in (math.ceil(begin_s * stream.rate_hz),)
        ]
        heapq.heapify(due)
        while due[0][0] < end_s:
            time_s, index, number = due[0]
            stream = self._streams[index]
            heapq.heapreplace(due, ((number + 1) / stream.rate_hz, index, number + 1))
            stamp_ns = round(time_s * NS_PER_S) + NS_PER_S
            header = m.Header(stamp_ns, CLOCK, stream.entity, stream.source, number)
            key = keys.expression(SITE, stream.topic, stream.entity, stream.source)
            if isinstance(stream.build, list):
                yield stamp_ns, Sample(key, stream.build[number % len(stream.build)], codec.encode(header))
            else:
                yield stamp_ns, Sample(key, codec.encode(stream.build(header, time_s)))

    def _all_streams(self) -> Iterator[_Stream]:
        for number, name in enumerate(DRONES):
            camera = f"{name}_camera"
            yield _Stream(t.IMU, name, name, 97, self._imu)
            yield _Stream(t.ODOMETRY, name, name, 97, self._odometry)
            yield _Stream(t.VEHICLE_STATUS, name, name, 5, _vehicle_status)
            yield _Stream(t.SETPOINT, name, "tracker", 44, self._setpoint)
            yield _Stream(t.OBSERVATION, name, camera, 12, self._observation)
            yield _Stream(t.INNOVATION, name, "tracker", 12, self._innovation)
            yield _Stream(t.CAMERA_STATUS, camera, camera, 2, _camera_status)
            yield _Stream(t.IMAGE, camera, camera, 5, _JPEGS)
            yield _Stream(t.RAW_RX, name, name, 8, _DATAGRAMS)
            yield _Stream(t.RAW_TX, name, name, 8, [data[:400] for data in _DATAGRAMS])
            yield _Stream(t.TRUTH, name, "sim_bridge", 50, self._truth(number))
        yield _Stream(t.TRUTH, _TARGET, "sim_bridge", 50, self._truth(2))
        yield _Stream(t.OBSERVATION, "ceiling", "ceiling", 22, self._observation)
        yield _Stream(t.INNOVATION, "ceiling", "tracker", 22, self._innovation)
        yield _Stream(t.IMAGE, "ceiling", "ceiling", 5, _JPEGS)
        yield _Stream(t.ESTIMATE, "team", "tracker", 50, self._estimate)
        yield _Stream(t.BELIEF, "team", "tracker", 5, self._belief)
        yield _Stream(t.JOURNAL, "team", "tracker", 50, _journal)
        yield _Stream(t.PLAN, "team", "tracker", 10, self._plan)
        yield _Stream(t.LEASE, "team", "supervisor", 2, _lease)
        for name in ("tracker", "recorder", "console", "router", "sim_bridge", "supervisor", "ceiling", *DRONES):
            yield _Stream(t.PROCESS_STATUS, name, name, 1, _process_status)
        yield _Stream(t.EVENT, "drone_1", "drone_1", 0.1, _event)

    def _noise(self, count: int, scale: float = 1e-3) -> tuple[float, ...]:
        return tuple(self._random.uniform(-scale, scale) for _ in range(count))

    def _place(self, number: int, time_s: float) -> m.Vector3:
        angle = 0.2 * time_s + 2.1 * number
        x, y, z = self._noise(3)
        return 2 * math.cos(angle) + x, 1.5 * math.sin(angle) + y, (0.0 if number == 2 else 1.5) + z

    def _vector(self) -> m.Vector3:
        x, y, z = self._noise(3, 0.5)
        return x, y, z

    def _imu(self, header: m.Header, _: float) -> m.Message:
        w, x, y, z = self._noise(4, 1.0)
        return m.ImuSample(
            header=header,
            angular_velocity_rad_s=self._vector(),
            specific_force_m_s2=self._vector(),
            attitude=(w, x, y, z),
        )

    def _odometry(self, header: m.Header, time_s: float) -> m.Message:
        roll, pitch = self._noise(2)
        return m.Odometry(
            header=header,
            velocity_m_s=self._vector(),
            velocity_covariance=self._noise(9),
            yaw_rad=math.remainder(time_s, math.tau),
            roll_rad=roll,
            pitch_rad=pitch,
            height_m=1.5,
        )

    def _setpoint(self, header: m.Header, _: float) -> m.Message:
        return m.VelocitySetpoint(
            header=header, velocity_m_s=self._vector(), yaw_rate_rad_s=0.1, lifetime_ms=300, epoch=1000
        )

    def _observation(self, header: m.Header, _: float) -> m.Message:
        return m.RelativeObservation(
            header=header,
            observer=header.entity,
            subject=_TARGET,
            camera=header.source,
            position_m=self._vector(),
            yaw_rad=self._noise(1)[0],
            covariance=self._noise(16),
            margin=4.0,
        )

    def _innovation(self, header: m.Header, _: float) -> m.Message:
        return m.Innovation(
            header=header,
            observer=header.entity,
            subject=_TARGET,
            verdict=m.Verdict.ACCEPTED,
            residual=self._noise(3),
            covariance=self._noise(9),
            nis=abs(self._noise(1, 4.0)[0]),
            latency_ms=130.0,
        )

    def _truth(self, number: int) -> Build:
        def build(header: m.Header, time_s: float) -> m.Message:
            return m.TruthState(
                header=header,
                position_m=self._place(number, time_s),
                velocity_m_s=self._vector(),
                attitude_rad=self._vector(),
                on_ground=False,
            )

        return build

    def _entity(self, number: int, time_s: float) -> m.EntityEstimate:
        place = self._place(number, time_s)
        mean = (*place, 0.3) if number < 2 else place[:2]
        size = len(mean)
        spread = [1e-3 + abs(value) if row % (size + 1) == 0 else 0.0 for row, value in enumerate(self._noise(size**2))]
        name, kind = (DRONES[number], "robot") if number < 2 else (_TARGET, "target")
        return m.EntityEstimate(name, kind, mean, tuple(spread), self._noise(3 if number < 2 else 2), True, 0.05)

    def _estimate(self, header: m.Header, time_s: float) -> m.Message:
        return m.Estimate(header=header, entities=tuple(self._entity(n, time_s) for n in range(3)), epoch=1000)

    def _belief(self, header: m.Header, _: float) -> m.Message:
        layout = tuple(f"{name}.{part}" for name in (*DRONES, _TARGET) for part in ("x", "y", "z", "yaw", "vx", "vy"))
        size = len(layout)
        return m.Belief(
            header=header, mean=self._noise(size), covariance_upper=self._noise(size * (size + 1) // 2), layout=layout
        )

    def _plan(self, header: m.Header, _: float) -> m.Message:
        return m.Plan(
            header=header,
            topology="drone_2/drone_1",
            cost=0.04 + self._noise(1)[0],
            controls=tuple(m.Control(name, self._vector(), 0.1, (), self._vector()) for name in DRONES),
            edges=tuple(m.Edge(name, _TARGET, 900.0 + self._noise(1)[0]) for name in DRONES),
            alternatives=(m.Alternative("drone_1,drone_2", 0.05), m.Alternative("drone_1/drone_2", 0.06, True)),
            solver=m.SolverReport("converged", 120, 0.01, 3, 2),
            mode="multistart",
        )


def _vehicle_status(header: m.Header, _: float) -> m.Message:
    return m.VehicleStatus(
        header=header, flight_state=m.FlightState.FLYING, mode="TRACK", battery=0.9, link_quality=1.0, rate_hz=97.0
    )


def _camera_status(header: m.Header, time_s: float) -> m.Message:
    frames = round(15 * time_s)
    return m.CameraStatus(
        header=header, connected=True, fps=15.0, age_ms=140.0, frames=frames, skipped=0, detections=frames
    )


def _journal(header: m.Header, time_s: float) -> m.Message:
    taken = tuple((keys.expression(SITE, t.ODOMETRY, name, name), round(97 * time_s)) for name in DRONES)
    return m.JournalEntry(header=header, tick=header.seq, now_ns=header.stamp_ns, ingested=taken * 2)


def _lease(header: m.Header, _: float) -> m.Message:
    return m.Lease(header=header, holder="operator", expires_ns=header.stamp_ns + NS_PER_S)


def _process_status(header: m.Header, time_s: float) -> m.Message:
    return m.ProcessStatus(
        header=header, state=m.Lifecycle.READY, pid=4321, cpu=0.05, ticks=round(50 * time_s), detail="synthetic"
    )


def _event(header: m.Header, time_s: float) -> m.Message:
    return m.Event(header=header, severity=m.Severity.INFO, text=f"at {time_s:.0f} s", remedy="nothing is wrong")


def turns(samples: Iterable[tuple[int, Sample]]) -> Iterator[tuple[int, list[Sample]]]:
    """Yield (time [ns], samples) as the recorder finds them in its queues at each of its turns."""
    turn: list[Sample] = []
    now_ns = due_ns = 0
    for now_ns, sample in samples:
        if now_ns >= due_ns:
            yield now_ns, turn
            turn, due_ns = [], now_ns + _TURN_NS
        turn.append(sample)
    yield now_ns, turn


def write_run(folder: Path, field: bytes, duration_s: float, rotation: Rotation = NO_ROTATION) -> None:
    """Write a made-up run to a folder; field: the resolved field as JSON."""
    writer = RunWriter(folder, field, 1, Timeline(CLOCK, UNIX_OFFSET_NS), rotation=rotation)
    for now_ns, samples in turns(SyntheticRun().samples(0.0, duration_s)):
        write_turn(writer, samples, now_ns)
    writer.close()


def write_turn(writer: RunWriter, samples: list[Sample], now_ns: int) -> None:
    """Write the samples of a turn, as the recorder does."""
    writer.write((one for one in samples if not one.attachment), writer.state, now_ns)
    writer.write((one for one in samples if one.attachment), writer.raw, now_ns)
    writer.tick(now_ns)
