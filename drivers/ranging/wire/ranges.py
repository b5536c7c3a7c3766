"""Datagrams of ranges, as docs/reference/ranges.md 2 has them. Pure."""

import msgspec

LARGEST = 1400
_MOST_ANCHORS, _LONGEST_NAME = 64, 100
_FARTHEST_M, _OLDEST_MS, _LATEST_MS = 1000.0, 1000.0, 1e15

# WIRE (docs/reference/ranges.md 2): a client sends this once a second.
ASK = b'{"ranges": 1}'


class WireError(Exception):
    """An invalid datagram; reason: in a word or two, for counting."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


class Round(msgspec.Struct, frozen=True, omit_defaults=True):
    """One transponder's distances [m] to the anchors that answered, measured `age_ms` before they were sent.

    sent_ms: when that was, on the gateway's own clock.
    """

    transponder: str
    m: dict[str, float]
    age_ms: float = 0.0
    sent_ms: float | None = None


_decoder = msgspec.json.Decoder(Round)


def encode(told: Round) -> bytes:
    """Return the datagram of a round."""
    return msgspec.json.encode(told)


def decode(datagram: bytes) -> Round:
    """Return the round in a datagram; raises WireError. Unknown keys are ignored."""
    if len(datagram) > LARGEST:
        raise WireError("too long")
    try:
        told = _decoder.decode(datagram)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        raise WireError("damaged") from None
    names = (told.transponder, *told.m)
    if not told.m or len(told.m) > _MOST_ANCHORS or max(map(len, names)) > _LONGEST_NAME:
        raise WireError("damaged")
    times_told = 0.0 <= told.age_ms <= _OLDEST_MS and 0.0 <= (told.sent_ms or 0.0) <= _LATEST_MS
    if not times_told or not all(0.0 < distance <= _FARTHEST_M for distance in told.m.values()):
        raise WireError("impossible")
    return told
