"""Decodes a link's frames, and encodes messages as frames in its own name, signed if it has a key."""

from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.signing_clock import SigningClock
from drivers.mavlink.wire.frames import FrameDecoder, FrameEncoder, Message
from drivers.mavlink.wire.verification import Signing


class FrameCodec:
    """Decoder and encoder of one link; one thread decodes, and one at a time encodes."""

    def __init__(self, settings: LinkSettings, signing: Signing | None) -> None:
        self.own = (settings.system_id, settings.component_id)
        self._decoder, self._encoder = FrameDecoder(signing), FrameEncoder(*self.own, signing)
        self.decode = self._decoder.decode
        self._clock = SigningClock()

    @property
    def newest_stamp(self) -> int:
        """Return the newest time of signing, received or sent; 0 without a key."""
        return max(self._decoder.newest_stamp, self._encoder.newest_stamp)

    def encode(self, message: Message) -> bytes:
        """Return the next frame, signed by a steady clock, but not older than times that the vehicles have received.

        WIRE (docs/reference/mavlink.md 5.9): a restarted vehicle ignores senders whose time is more than a minute
        older than the newest that it knows, which may come from another ground station or a clock that was ahead.
        """
        return self._encoder.encode(message, not_before=max(self._clock.stamp(), self._decoder.newest_stamp + 1))
