"""Writes samples of the bus to the files of a run: state in one series, pictures and datagrams in the other."""

from collections.abc import Callable, Iterable
from pathlib import Path

from groundstation.bus.api import Sample
from groundstation.field.resolved import field_from_json
from groundstation.recording.capture import Capture
from groundstation.recording.derived import ViewerChannels
from groundstation.recording.file_topics import RAW, STATE
from groundstation.recording.preamble import preamble_of_run
from groundstation.recording.rotating_file import NO_ROTATION, FileSeries, Rotation
from groundstation.recording.timeline import Timeline


class RunWriter:
    """Writes one run: `state` and `raw` are its two series of files.

    field: the resolved field as JSON; has_room: called before a file is begun.
    """

    def __init__(
        self,
        folder: Path,
        field: bytes,
        epoch: int,
        timeline: Timeline,
        has_room: Callable[[], bool] = lambda: True,
        rotation: Rotation = NO_ROTATION,
    ) -> None:
        preamble = preamble_of_run(field, epoch, timeline, folder)
        self._capture, self._viewers = Capture(timeline), ViewerChannels(field_from_json(field))
        self.state, self.raw = (
            FileSeries(folder, stem, preamble, has_room=has_room, rotation=rotation) for stem in (STATE, RAW)
        )

    @property
    def refused(self) -> int:
        """Return the number of unusable samples."""
        return sum(self._capture.refused.values())

    def write(self, samples: Iterable[Sample], series: FileSeries, now_ns: int) -> None:
        """Add samples that arrived by now [ns, boot clock] to one of the series, and derived entries for viewers."""
        entry_of, derived, write = self._capture.entry, self._viewers.derived, series.write
        for sample in samples:
            entry = entry_of(sample, now_ns)
            if entry is None:
                continue
            write(entry, now_ns)
            for for_viewers in derived(entry):
                write(for_viewers, now_ns)

    def tick(self, now_ns: int) -> None:
        """Flush and rotate when it is due; call it each turn."""
        self.state.tick(now_ns)
        self.raw.tick(now_ns)

    def close(self) -> None:
        """Finish the files."""
        self.state.close()
        self.raw.close()
