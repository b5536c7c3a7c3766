"""What an emulated autopilot keeps of one client: rates, sequence numbers, version, clock, place in a list. No sockets.

WIRE (PX4 and ArduPilot, source): all of it belongs to a MAVLink channel, a link of its own. Here one remote address is
one channel.
"""

from drivers.mavlink.wire.frames import FrameEncoder, Message, id_of
from sim_bridge.devices.mavlink_rates import Rates
from sim_bridge.devices.mavlink_time import SenderClock

# WIRE: MAVLink 1 has no numbers beyond this.
_LAST_OLD = 255


class Channel:
    """One client. old: it is sent MAVLink 1; heard_ns: time of its last frame; listed: its next parameter, or None.

    WIRE (PX4, MAV_PROTO_VER 0): MAVLink 1 until a frame of MAVLink 2 arrives, and never again. ArduPilot did so until
    4.0; 4.5 goes by SERIALn_PROTOCOL alone. Here both firmwares follow the client, so that old clients understand them.
    """

    def __init__(self, encoder: FrameEncoder, rates: Rates, clock: SenderClock, old: bool) -> None:
        self.rates, self.clock, self.old = rates, clock, old
        self.heard_ns: int | None = None
        self.listed: int | None = None
        self._encoder = encoder

    @property
    def newest_stamp(self) -> int:
        """Return the time from which the next frame is signed, 0 without a key."""
        return self._encoder.newest_stamp

    def hear(self, now_ns: int, old: bool) -> None:
        """Note a frame of this client, of MAVLink 1 if `old`."""
        self.heard_ns = now_ns
        self.old = self.old and old

    def is_heard(self, now_ns: int, within_ns: int) -> bool:
        """Return whether a frame came within a time."""
        return self.heard_ns is not None and now_ns - self.heard_ns <= within_ns

    def encode(self, message: Message, not_before: int) -> bytes:
        """Return the frame of a message, b"" if the version has none; not_before: the least time of signing."""
        if self.old and id_of(type(message)) > _LAST_OLD:
            return b""
        return self._encoder.encode(message, self.old, not_before)
