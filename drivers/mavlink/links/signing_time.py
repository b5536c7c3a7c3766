"""The time to sign with: the clock's, but not older than times that the vehicles of a link have heard."""

import time

from drivers.mavlink.wire.frames import FrameDecoder
from drivers.mavlink.wire.signature import stamp_at


def time_to_sign(decoder: FrameDecoder) -> int:
    """Return the least time for the next frame [10 us since 2015-01-01 UTC], if it is signed; decoder: of the link.

    WIRE (docs/reference/mavlink.md 5.9): a restarted vehicle ignores senders whose time is more than a minute older
    than the newest that it knows, which may come from another ground station or a clock that was ahead.
    """
    return max(stamp_at(time.time()), decoder.newest_stamp + 1)
