"""Bus samples to recording entries, without decoding more than their header."""

from base64 import b64encode
from collections import Counter
from dataclasses import dataclass

import msgspec

from groundstation.bus import keys
from groundstation.bus.api import Sample
from groundstation.bus.keys import Key
from groundstation.bus.messages import ClockOffset, Header
from groundstation.bus.topics import CLOCK
from groundstation.errors import MessageError
from groundstation.recording import viewers
from groundstation.recording.file_topics import is_picture
from groundstation.recording.schemas import Description, description_of
from groundstation.recording.timeline import Timeline


class _Envelope(msgspec.Struct, gc=False):
    header: Header


# msgspec checks that the whole message is JSON but builds the header only: about 1 us.
_envelope = msgspec.json.Decoder(_Envelope)
_header = msgspec.json.Decoder(Header)
_clock_offset = msgspec.json.Decoder(ClockOffset)


@dataclass(slots=True)
class Entry:
    """One message on its way into a file, times in UNIX ns; `facts` go to its channel's metadata.

    derived: repeats another entry for viewers; it counts neither as written nor as lost.
    """

    channel: str
    log_time_ns: int
    publish_time_ns: int
    sequence: int
    data: bytes
    description: Description
    facts: dict[str, str]
    derived: bool = False


@dataclass(frozen=True, slots=True)
class _Channel:
    key: Key
    description: Description
    facts: dict[str, str]


class Capture:
    """Makes entries; keys are parsed once each. Samples that no reader could use are counted in `refused`."""

    def __init__(self, timeline: Timeline) -> None:
        self._timeline = timeline
        self._channels: dict[str, _Channel] = {}
        self.refused: Counter[str] = Counter()

    def entry(self, sample: Sample, arrival_ns: int) -> Entry | None:
        """Return the entry for a sample with its arrival on the boot clock; None if it is refused."""
        try:
            channel = self._channels.get(sample.key) or self._parse(sample.key)
            key = channel.key
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
        number = header.seq & 0xFFFF_FFFF
        return Entry(sample.key, logged, published, number, data, channel.description, channel.facts)

    def _parse(self, text: str) -> _Channel:
        key = keys.parse(text)
        facts = {"site": key.site, "entity": key.entity, "topic": key.topic.name, "source": key.source}
        facts["plane"] = str(key.topic.plane)
        channel = self._channels[text] = _Channel(key, description_of(key.topic), facts)
        return channel

    def _learn(self, payload: bytes) -> None:
        try:
            self._timeline.learn(_clock_offset.decode(payload))
        except (msgspec.DecodeError, ValueError, RecursionError):
            self.refused["malformed"] += 1


def _wrapped(key: Key, header: Header, sample: Sample, published_ns: int) -> bytes:
    if is_picture(key.topic):
        family, _, kind = key.topic.encoding.partition("/")
        write = viewers.video if family == "video" else viewers.image
        return write(published_ns, header.entity, kind, sample.attachment, sample.payload)
    return b'{"header":%s,"data":"%s"}' % (sample.attachment, b64encode(sample.payload))
