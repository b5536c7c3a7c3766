"""Whether a world sensor's stream flows: its lifecycle, the operator's events, and its status twice a second."""

from collections import Counter
from dataclasses import dataclass

from drivers.base import HostProcess
from groundstation.bus import clock
from groundstation.bus.messages import CameraStatus, Severity
from groundstation.bus.topics import CAMERA_STATUS
from groundstation.time_units import NS_PER_MS, NS_PER_S

_STATUS_PERIOD_NS = 500 * NS_PER_MS


@dataclass(frozen=True, slots=True)
class StreamNames:
    """How events speak of a stream: kind and name of the sensor, what comes ("frame"), from where, and the remedy."""

    kind: str
    name: str
    piece: str
    source: str
    remedy: str


class StreamHealth:
    """Use: `came` with each piece, `watch` in each turn.

    start_within_s, silent_after_s: how long nothing may come at first, and later.
    """

    def __init__(self, child: HostProcess, names: StreamNames, start_within_s: float, silent_after_s: float) -> None:
        self._child, self._names = child, names
        self._patience = (start_within_s, silent_after_s)
        self._flowing: bool | None = None
        self._heard_ns = self._status_ns = clock.now_ns()
        self._pieces_then = self._newest_ns = 0
        self.pieces = self.skipped = self.reported = 0

    def came(self, arrival_ns: int) -> None:
        """Count a piece that arrived."""
        self.pieces += 1
        self._heard_ns = arrival_ns
        self._announce("", flowing=True)

    def used(self, measured_ns: int) -> None:
        """Note when the newest piece that is used was measured."""
        self._newest_ns = measured_ns

    def watch(self, why_silent: str, wrong: str, rejected: Counter[str]) -> None:
        """Tell of silence, and publish the status when it is due; wrong: what else is, in words."""
        now_ns = clock.now_ns()
        if now_ns - self._heard_ns > self._patience_s * NS_PER_S:
            self._announce(why_silent, flowing=False)
        if now_ns - self._status_ns >= _STATUS_PERIOD_NS:
            self._publish(now_ns, self._trouble(why_silent) if self._flowing is False else wrong, rejected)
        self._child.beat()
        self._child.tick_status(ticks=self.pieces, overruns=self.skipped)

    @property
    def _patience_s(self) -> float:
        return self._patience[1 if self.pieces else 0]

    def _trouble(self, why: str) -> str:
        return f"no {self._names.piece} for {self._patience_s:g} s{f' ({why})' if why else ''}"

    def _announce(self, why: str, *, flowing: bool) -> None:
        """Report to lifecycle and operator whether pieces come."""
        if flowing is self._flowing:
            return
        self._flowing = flowing
        names = self._names
        if flowing:
            self._child.ready(f"{names.piece}s from {names.source}")
            self._child.event(Severity.INFO, f"{names.kind} {names.name}: {names.piece}s arrive", entity=names.name)
            return
        trouble = self._trouble(why)
        self._child.degrade(trouble)
        self._child.event(Severity.WARNING, f"{names.kind} {names.name}: {trouble}", names.remedy, entity=names.name)

    def _publish(self, now_ns: int, detail: str, rejected: Counter[str]) -> None:
        elapsed_s = (now_ns - self._status_ns) / NS_PER_S
        status = CameraStatus(
            header=self._child.bus.header(self._names.name),
            connected=bool(self._flowing),
            fps=(self.pieces - self._pieces_then) / elapsed_s,
            age_ms=(now_ns - (self._newest_ns or self._heard_ns)) / NS_PER_MS,
            frames=self.pieces,
            skipped=self.skipped,
            detections=self.reported,
            detail=detail,
            rejected=dict(+rejected),
        )
        self._child.bus.publish(CAMERA_STATUS, status)
        self._status_ns, self._pieces_then = now_ns, self.pieces
