"""A serial line whose radio is unplugged, and one that two threads write to."""

import os
import time

from drivers.mavlink.links.serial import SerialLink
from drivers.mavlink.settings import LinkSettings


def test_an_unplugged_radio_is_counted_and_not_asked_without_a_pause():
    there, here = os.openpty()
    link = SerialLink(LinkSettings(target=f"serial:{os.ttyname(here)}:57600"))
    os.close(here)
    try:
        os.close(there)
        began = time.monotonic()
        assert [link.receive() for _ in range(3)] == [[], [], []]
        assert time.monotonic() - began >= 0.25, "a tenth of a second each"
        assert link.rejected["receive_failed"] == 3
    finally:
        link.close()
