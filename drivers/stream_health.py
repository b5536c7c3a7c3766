"""The health of a world sensor's stream: its lifecycle, events for the operator, and its status twice a second."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from drivers.base import HostProcess
from drivers.stream_watch import StreamState, StreamWatch
from groundstation.bus import clock
from groundstation.bus.messages import CameraStatus, Severity
from groundstation.bus.topics import CAMERA_STATUS
from groundstation.time_units import NS_PER_MS, NS_PER_S

_STATUS_PERIOD_NS = 500 * NS_PER_MS


@dataclass(frozen=True, slots=True)
class StreamNames:
    """The words for a stream in events.

    kind, name: of the sensor; piece: its unit ("frame"); source: where it comes from; remedy: against silence; refused:
    remedy against unusable pieces.
    """

    kind: str
    name: str
    piece: str
    source: str
    remedy: str
    refused: str = ""


class StreamHealth:
    """Call `came` with each piece, and `end_turn` at the end of each turn of the driver's loop.

    start_within_s, silent_after_s: permitted silence at first, and later. pieces: counted by `came`, or by the caller
    that uses only `flows`.
    """

    def __init__(self, child: HostProcess, names: StreamNames, start_within_s: float, silent_after_s: float) -> None:
        self._child, self._names = child, names
        self._status_ns = clock.now_ns()
        self._watch = StreamWatch(start_within_s, silent_after_s, self._status_ns)
        self._silence_s = start_within_s
        self._pieces_then = self._newest_ns = 0
        self.pieces = self.skipped = self.reported = 0

    @property
    def flowing(self) -> bool:
        """Return whether usable pieces arrive."""
        return self._watch.state is StreamState.FLOWING

    def came(self, arrival_ns: int) -> None:
        """Count a piece that arrived."""
        self.pieces += 1
        self.flows(arrival_ns)

    def flows(self, arrival_ns: int) -> None:
        """Note that a piece arrived."""
        if self._watch.usable(arrival_ns):
            names = self._names
            self._child.ready(f"{names.piece}s from {names.source}")
            self._child.event(Severity.INFO, f"{names.kind} {names.name}: {names.piece}s arrive", entity=names.name)

    def refuse(self, reason: str, arrival_ns: int) -> None:
        """Note that an unusable piece arrived, and why."""
        if self._watch.refused(reason, arrival_ns):
            self._warn(reason, self._names.refused)

    def used(self, measured_ns: int) -> None:
        """Note when the newest piece that is used was measured."""
        self._newest_ns = measured_ns

    def end_turn(
        self, why_silent: str, wrong: str, rejected: Counter[str],
        quality: Callable[[], tuple[float | None, float | None]] = lambda: (None, None),
    ) -> None:  # fmt: skip
        """Signal that the loop turns, report silence, and publish the status when due.

        wrong: other faults, in words; quality: brightness and width of edges [px] of the pictures.
        """
        now_ns = clock.now_ns()
        patience_s = self._watch.patience_s
        if self._watch.look(now_ns):
            self._silence_s = patience_s
            self._warn(self._silence(why_silent), self._names.remedy)
        if now_ns - self._status_ns >= _STATUS_PERIOD_NS:
            troubles = {StreamState.SILENT: self._silence(why_silent), StreamState.REFUSED: self._watch.reason}
            seen = quality() if self.flowing else (None, None)
            self._publish(now_ns, troubles.get(self._watch.state, wrong), rejected, *seen)
        self._child.beat()
        self._child.tick_status(ticks=self.pieces, overruns=self.skipped)

    def _silence(self, why: str) -> str:
        return f"no {self._names.piece} for {self._silence_s:g} s{f' ({why})' if why else ''}"

    def _warn(self, trouble: str, remedy: str) -> None:
        names = self._names
        self._child.degrade(trouble)
        self._child.event(Severity.WARNING, f"{names.kind} {names.name}: {trouble}", remedy, entity=names.name)

    def _publish(
        self, now_ns: int, detail: str, rejected: Counter[str], brightness: float | None, edge_px: float | None
    ) -> None:
        elapsed_s = (now_ns - self._status_ns) / NS_PER_S
        status = CameraStatus(
            header=self._child.bus.header(self._names.name),
            connected=self.flowing,
            fps=(self.pieces - self._pieces_then) / elapsed_s,
            age_ms=(now_ns - (self._newest_ns or self._watch.since_ns)) / NS_PER_MS,
            frames=self.pieces,
            skipped=self.skipped,
            detections=self.reported,
            detail=detail,
            rejected=dict(+rejected),
            brightness=brightness,
            edge_px=edge_px,
        )
        self._child.bus.publish(CAMERA_STATUS, status)
        self._status_ns, self._pieces_then = now_ns, self.pieces
