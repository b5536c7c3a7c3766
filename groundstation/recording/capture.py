"""Bus samples to recording entries, without decoding more than their header."""

from base64 import b64encode
from collections import Counter
from dataclasses import dataclass

import msgspec

from groundstation.bus import keys
from groundstation.bus.api import Sample
from groundstation.bus.clock import NS_PER_S
from groundstation.bus.keys import Key
from groundstation.bus.messages import ClockOffset, Header
from groundstation.bus.topics import CLOCK
from groundstation.errors import MessageError
from groundstation.recording.schemas import CompressedImage, recorded_type
from groundstation.recording.timeline import Timeline


class _Envelope(msgspec.Struct, gc=False):
    header: Header


# msgspec checks that the whole message is JSON but builds the header only: about 1 us.
_envelope = msgspec.json.Decoder(_Envelope)
_header = msgspec.json.Decoder(Header)
_clock_offset = msgspec.json.Decoder(ClockOffset)


@dataclass(slots=True)
class Entry:
    """One message on its way into a file: JSON as it came (typed) or wrapped (raw bytes), times in UNIX ns."""

    key: Key
    channel: str
    log_time_ns: int
    publish_time_ns: int
    sequence: int
    data: bytes


class Capture:
    """Makes entries; keys are parsed once each. Samples that no reader could use are counted in `refused`."""

    def __init__(self, timeline: Timeline) -> None:
        self._timeline = timeline
        self._keys: dict[str, Key] = {}
        self.refused: Counter[str] = Counter()

    def entry(self, sample: Sample, arrival_ns: int) -> Entry | None:
        """Return what to write for a sample that arrived at a boot-clock time; None if it is refused."""
        try:
            key = self._keys.get(sample.key) or self._parse(sample.key)
            raw = key.topic.type is None
            header = _header.decode(sample.attachment) if raw else _envelope.decode(sample.payload).header
        except MessageError as error:
            self.refused[error.reason] += 1
            return None
        except (msgspec.DecodeError, ValueError, RecursionError):
            self.refused["malformed"] += 1
            return None
        if header.entity != key.entity or header.source != key.source:
            self.refused["header_mismatch"] += 1
            return None
        if key.topic is CLOCK:
            self._learn(sample.payload)
        logged, published = self._timeline.times(header.stamp_ns, header.clock, arrival_ns)
        data = _wrapped(key, header, sample, published) if raw else sample.payload
        return Entry(key, sample.key, logged, published, header.seq & 0xFFFF_FFFF, data)

    def _parse(self, text: str) -> Key:
        key = self._keys[text] = keys.parse(text)
        return key

    def _learn(self, payload: bytes) -> None:
        try:
            self._timeline.learn(_clock_offset.decode(payload))
        except (msgspec.DecodeError, ValueError, RecursionError):
            self.refused["malformed"] += 1


def _wrapped(key: Key, header: Header, sample: Sample, published_ns: int) -> bytes:
    front = b""
    if recorded_type(key.topic) is CompressedImage:
        seconds, nanoseconds = divmod(published_ns, NS_PER_S)
        kind = key.topic.encoding.removeprefix("image/")
        front = b'"timestamp":{"sec":%d,"nsec":%d},"frame_id":"%s","format":"%s",' % (
            seconds,
            nanoseconds,
            header.entity.encode(),
            kind.encode(),
        )
    return b'{%s"header":%s,"data":"%s"}' % (front, sample.attachment, b64encode(sample.payload))
