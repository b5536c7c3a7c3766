"""The time that we sign with: the clock's, and not older than what the vehicles of a link have heard already."""

import time

from drivers.mavlink.wire.frames import FrameDecoder
from drivers.mavlink.wire.signature import stamp_at


def time_to_sign(decoder: FrameDecoder) -> int:
    """Return the least time for the next frame [10 us since 2015-01-01 UTC], if it is signed; decoder: of the link.

    WIRE (docs/reference/mavlink.md 5.9): a vehicle that was started anew hears nobody whose time is more than a minute
    older than the newest that it knows, from another ground station or from a clock that was ahead.
    """
    return max(stamp_at(time.time()), decoder.newest_stamp + 1)
