"""The recorder process: writes everything on the bus to MCAP files at little cost, and survives a full disk.

Started as `groundstation.runtime.recorder:run`. See groundstation/recording for files and formats.
"""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from groundstation.bus import clock
from groundstation.bus.api import Sample
from groundstation.bus.messages import Severity
from groundstation.bus.topics import IMAGE, Topic
from groundstation.field.behaviour import RecordingValues
from groundstation.field.resolved import field_from_json
from groundstation.process.child import Child
from groundstation.recording.disk_space import Space, assess, free_bytes
from groundstation.recording.file_topics import DATAGRAM_TOPICS, IMAGE_TOPICS, STATE_TOPICS
from groundstation.recording.timeline import Timeline
from groundstation.time_units import NS_PER_MS, NS_PER_S

if TYPE_CHECKING:
    from groundstation.recording.rotating_file import FileSeries, Rotation

# 15 turns a second: the heartbeat needs 10, and each turn costs a wake-up of the interpreter.
_PERIOD_NS = 66 * NS_PER_MS
_SPACE_PERIOD_NS = 2 * NS_PER_S
_PICTURES: dict[str, tuple[Topic, ...]] = {"none": (), "blurred": (IMAGE,), "full": IMAGE_TOPICS}
_CONSEQUENCE = {
    Space.LOW: "pictures stop below 200 MB",
    Space.NO_IMAGES: "no pictures any more",
    Space.FULL: "disk is full",
}


class RecorderSection(msgspec.Struct, frozen=True):
    """The recorder's section: the resolved field as JSON, the run folder, the tracker's epoch."""

    field: msgspec.Raw
    run_dir: str
    epoch: int = 0


def _blurred(pictures: list[Sample]) -> list[Sample]:
    from groundstation.recording.blurring import blurred

    soft = ((sample, blurred(sample.payload)) for sample in pictures)
    return [replace(sample, payload=payload) for sample, payload in soft if payload is not None]


def _rotation(settings: RecordingValues) -> "Rotation":
    """Return the limits at which a part of the recording is full."""
    from groundstation.recording.rotating_file import Rotation

    return Rotation(round(settings.rotate_mb * 1e6), round(settings.rotate_minutes * 60 * NS_PER_S))


class Recorder:
    """Drains the bus into the files of one run."""

    def __init__(self, child: Child, section: RecorderSection) -> None:
        # First of all: messages from now on wait in these queues while the writer still loads. Bounded in bytes as well
        # as in number: a picture is a hundred times a state message.
        settings = field_from_json(section.field).recording
        self._state_queue = child.bus.subscribe(STATE_TOPICS, capacity=8192)
        self._image_queue = child.bus.subscribe(_PICTURES[settings.pictures], capacity=64)
        self._blurs = settings.pictures == "blurred"
        self._datagram_queue = child.bus.subscribe(DATAGRAM_TOPICS if settings.raw_datagrams else (), capacity=4096)
        # Only here: importing formats and compression takes half a second, which a restarted recorder must not lose.
        from groundstation.recording.reader import recorded_offset_ns
        from groundstation.recording.writing import RunWriter

        self._child = child
        self._folder = Path(section.run_dir)
        self._folder.mkdir(parents=True, exist_ok=True)
        # A restarted recorder keeps the first one's clock offset: the system's clock may have been set since.
        kept_ns = recorded_offset_ns(self._folder, clock.clock_id())
        timeline = Timeline(clock.clock_id(), clock.unix_offset_ns() if kept_ns is None else kept_ns)
        self._space = Space.AMPLE
        self._space_ns = 0
        self._writer = RunWriter(
            self._folder, bytes(section.field), section.epoch, timeline, self._has_room, _rotation(settings)
        )
        self._series = (self._writer.state, self._writer.raw)

    def turn(self) -> None:
        """Write the samples that have arrived, flush when due, watch the disk."""
        now_ns = clock.now_ns()
        self._check_space(now_ns)
        writer = self._writer
        writer.write(self._state_queue.drain_samples(), writer.state, now_ns)
        writer.write(self._datagram_queue.drain_samples(), writer.raw, now_ns)
        pictures = self._image_queue.drain_samples()
        if self._space < Space.NO_IMAGES:
            writer.write(_blurred(pictures) if self._blurs else pictures, writer.raw, now_ns)
        writer.tick(now_ns)
        for series in self._series:
            self._report(series)

    def _report(self, series: "FileSeries") -> None:
        for trouble in series.take_troubles():
            # A warning: it stands in the file that goes on, so the report names the gap before it.
            severity = Severity.WARNING if trouble.recovered else Severity.ERROR
            remedy = (
                "" if trouble.recovered else f"make room in {self._folder}, leave it there; the flight is not affected"
            )
            self._child.event(severity, trouble.text, remedy)
            if trouble.recovered:
                self.announce()
            else:
                self._child.degrade(trouble.text)

    def announce(self) -> None:
        """Report READY with the folder, unless a file still cannot be written."""
        if not any(series.failing for series in self._series):
            self._child.ready(str(self._folder))

    @property
    def dropped(self) -> int:
        """Return how many messages overflowed, were refused, or could not be written."""
        queues = (self._state_queue, self._image_queue, self._datagram_queue)
        lost = sum(series.lost for series in self._series)
        return sum(queue.overflowed for queue in queues) + lost + self._writer.refused

    @property
    def written(self) -> int:
        """Return how many messages are safe in the files."""
        return sum(series.written for series in self._series)

    def close(self) -> None:
        """Write remaining samples and finish the files; reports failures."""
        self.turn()
        self._writer.close()
        for series in self._series:
            self._report(series)

    def _has_room(self) -> bool:
        return assess(free_bytes(self._folder)) < Space.FULL

    def _check_space(self, now_ns: int) -> None:
        if now_ns < self._space_ns:
            return
        self._space_ns = now_ns + _SPACE_PERIOD_NS
        try:
            free = free_bytes(self._folder)
        except OSError:
            return  # the folder is gone: writing will report it
        before, self._space = self._space, assess(free, self._space)
        if self._space > before:
            text = f"{free / 1e6:.0f} MB left for recordings: {_CONSEQUENCE[self._space]}"
            self._child.event(Severity.WARNING, text, f"free space in {self._folder}")
        elif self._space < before:
            self._child.event(Severity.INFO, f"{free / 1e6:.0f} MB are free for recordings again")


def run(child: Child) -> int:
    """Record until asked to stop or until the supervisor is gone; then finish the files."""
    recorder = Recorder(child, msgspec.json.decode(child.section, type=RecorderSection))
    recorder.turn()
    recorder.announce()
    for ticks in child.turns(_PERIOD_NS):
        recorder.turn()
        child.tick_status(ticks=ticks, overflowed=recorder.dropped)
    recorder.close()
    return 0
