"""The time to sign with: a steady clock's, but not older than times that the vehicles of a link have heard."""

from drivers.mavlink.signing_clock import SigningClock
from drivers.mavlink.wire.frames import FrameDecoder


def time_to_sign(clock: SigningClock, decoder: FrameDecoder) -> int:
    """Return the least time for the next frame [10 us since 2015-01-01 UTC], if it is signed; decoder: of the link.

    WIRE (docs/reference/mavlink.md 5.9): a restarted vehicle ignores senders whose time is more than a minute older
    than the newest that it knows, which may come from another ground station or a clock that was ahead.
    """
    return max(clock.stamp(), decoder.newest_stamp + 1)
