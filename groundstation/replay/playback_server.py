"""Shows a recording in the console's own server and page, through a bus within this process."""

import math
import time
from collections.abc import Callable
from typing import Any

from groundstation.bus import codec
from groundstation.bus.api import Received, Sample
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import OPERATOR, Command, Event, Severity
from groundstation.bus.topics import ESTIMATE, IMAGE, INNOVATION, LEASE, OBSERVATION, PLAN, TRUTH, Topic
from groundstation.console.room import scene_from_field
from groundstation.console.server import STATES, ConsoleServer, claim_port
from groundstation.errors import MessageError
from groundstation.monitor.state import cast_from_field
from groundstation.recording.chunks import RawRecord, among
from groundstation.recording.reader import RecordingError, payload
from groundstation.replay.playback import Playback
from groundstation.time_units import NS_PER_MS, NS_PER_S

_LATCHED = (*STATES, LEASE)
_TRACED = (ESTIMATE, PLAN, TRUTH, INNOVATION)
# The past that the page shows: two minutes of curves, which is longer than any detection or sighting is shown.
_LOOK_BACK_NS, _SEEN_NS = 122 * NS_PER_S, 5 * NS_PER_S
# The first, shorter look back after a jump, shown before two minutes can be read.
_GLANCE_NS = 5 * NS_PER_S
# Trails continue at 5 Hz, curves at 2 Hz (console.history).
_TRACE_NS, _CURVE_NS = 200 * NS_PER_MS, 500 * NS_PER_MS
_MARKS = 400
_MS = 1e6


class Show:
    """One replay for any number of viewers, who all see the same and may all control it."""

    def __init__(self, playback: Playback, port: int | None) -> None:
        source = playback.source
        self.playback = playback
        self._reel = playback.reel
        self._exchange = MemoryExchange()
        bus = MemoryBus(self._exchange, source.run.get("site", "lab"), "replay")
        try:
            field = source.resolved
            cast = cast_from_field(field)
            scene = scene_from_field(field, TRUTH.name in self._reel.topics)
        except ValueError as error:
            raise RecordingError(f"{source.name}: this version cannot read its field ({error})") from error
        scene["replay"] = self._about()
        listener = claim_port(port or field.console.port)
        self.server = ConsoleServer(bus, cast, scene, field, listener, "replay", playback)
        self.undecodable = 0
        self._glanced = False
        self._at_s = time.monotonic()

    def _about(self) -> dict[str, Any]:
        start, end = (self.playback.boot_ns(at) / _MS for at in (self._reel.start_ns, self._reel.end_ns))
        name, rerun = self.playback.source.name, self.playback.source.rerun
        what, note = (rerun.mark, f"{rerun.subject}; the vehicles moved as recorded") if rerun else ("REPLAY", "")
        return {"name": name, "what": what, "note": note, "start_ms": start, "end_ms": end, "marks": self._marks()}

    def _marks(self) -> list[dict[str, Any]]:
        """Return the marks of the time line: events, and the first sending of each command."""
        marks: list[dict[str, Any]] = []
        said: set[tuple[str, ...]] = set()
        for at_ns, record in self._reel.milestones:
            message = _received(record)
            # Not before the event, or a jump to the mark would not show it.
            at_ms = math.ceil(self.playback.boot_ns(at_ns) / _MS)
            match message and message.message:
                case Event() as event:
                    marks.append({"at_ms": at_ms, "kind": str(event.severity), "text": event.sentence})
                case Command() as command:
                    name = (command.verb, command.issuer, *command.scope)
                    if name not in said:
                        said.add(name)
                        whom = ", ".join(name for name in command.scope if name != OPERATOR) or "all"
                        marks.append({"at_ms": at_ms, "kind": "COMMAND", "text": f"{command.verb} {whom}"})
        if len(marks) > _MARKS:  # minor ones are dropped first
            loud = [mark for mark in marks if mark["kind"] != Severity.INFO]
            marks = loud[:_MARKS]
        return marks

    def turn(self) -> None:
        """Bring the server's board to the replay's position; the server's own turn updates the viewers."""
        now_s = time.monotonic()
        elapsed_s, self._at_s = now_s - self._at_s, now_s
        sought = self.playback.take_sought()
        if sought or self._glanced:
            self._refill(_GLANCE_NS if sought else _LOOK_BACK_NS)
            self._glanced = sought
            self._at_s = time.monotonic()
            return
        for after_ns, until_ns in self.playback.advance(elapsed_s):
            for _, record in self._reel.between(after_ns, until_ns):
                self._deliver(record)
            self.server.take_in(self.playback.boot_ns(until_ns))

    def _deliver(self, record: RawRecord) -> None:
        if record.key.topic.type is not None:
            self._exchange.deliver(Sample(str(record.key), record.data))
            return
        try:
            header, content = payload(record)
        except MessageError:
            self.undecodable += 1
            return
        self._exchange.deliver(Sample(str(record.key), content, codec.encode(header)))

    def _refill(self, look_back_ns: int) -> None:
        """Rebuild the past up to now: the newest of everything, events, trails and curves."""
        server, reel, at_ns = self.server, self._reel, self.playback.at_ns
        now_ns = self.playback.now_ns()
        server.begin_anew()
        self._trace(max(reel.start_ns - 1, at_ns - look_back_ns), at_ns)
        self._ingest(self._newest(at_ns, _LATCHED), now_ns)
        for came_ns, record in reel.milestones:
            if came_ns > at_ns:
                break
            self._ingest([record], self.playback.boot_ns(came_ns))
        recently = reel.between(at_ns - _SEEN_NS, at_ns, among((OBSERVATION,)))
        self._ingest([record for _, record in recently], now_ns)
        for record in self._newest(at_ns, (IMAGE,)):
            self._deliver(record)
        server.sessions.desk.step(now_ns, server.state.doing())
        server.show_anew(now_ns)

    def _newest(self, at_ns: int, topics: tuple[Topic, ...]) -> list[RawRecord]:
        """Return the last arrived message of each key: one measured shortly before may not have arrived yet."""
        found = {str(record.key): record for record in self._reel.newest(at_ns - _SEEN_NS, among(topics))}
        found |= {str(record.key): record for _, record in self._reel.between(at_ns - _SEEN_NS, at_ns, among(topics))}
        return list(found.values())

    def _trace(self, after_ns: int, at_ns: int) -> None:
        """Rebuild trails, curves and NIS through the past, with the newest message of each key at each step."""
        step: dict[str, RawRecord] = {}
        innovations: list[RawRecord] = []
        due_ns = after_ns + _TRACE_NS
        for came_ns, record in self._reel.between(after_ns, at_ns, among(_TRACED)):
            while came_ns >= due_ns:
                self._ingest([*step.values(), *innovations], self.playback.boot_ns(due_ns))
                self.server.state.note(self.playback.boot_ns(due_ns))
                step.clear()
                innovations.clear()
                gone_ns = due_ns - after_ns
                due_ns += min(_TRACE_NS - gone_ns % _TRACE_NS, _CURVE_NS - gone_ns % _CURVE_NS)
            if record.key.topic is INNOVATION:
                innovations.append(record)
            else:
                step[str(record.key)] = record
        self._ingest([*step.values(), *innovations], self.playback.boot_ns(at_ns))

    def _ingest(self, records: list[RawRecord], now_ns: int) -> None:
        received = [message for record in records if (message := _received(record)) is not None]
        self.undecodable += len(records) - len(received)
        self.server.ingest(received, now_ns)


def _received(record: RawRecord) -> Received | None:
    try:
        message = codec.decode(record.key, record.data)
    except MessageError:
        return None
    return Received(record.key, message.header, message, record.data)


async def serve(playback: Playback, port: int | None, headless: bool, announce: Callable[[str], None]) -> None:
    """Serve until interrupted; headless: until the recording ends."""
    show = Show(playback, port)
    announce(show.server.url)

    def go_on(_turns: int, _late: int) -> bool:
        show.turn()
        return not (headless and playback.ended)

    await show.server.serve(go_on)
