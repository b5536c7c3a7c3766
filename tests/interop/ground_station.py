"""Traffic like that of QGroundControl at start and in flight, by pymavlink; system 255, component 190."""

import math
import socket
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

_ALL, _RATE_HZ = 0, 4
_OPEN_FILE, _NAK = 4, 129


class GroundStation:
    """Sends a heartbeat once a second while it waits."""

    def __init__(self, address: str, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.settimeout(0.1)
        self._socket.connect((address, port))
        self._mav = dialect.MAVLink(self, srcSystem=255, srcComponent=190)
        self._heard: deque[Any] = deque()
        self._beat_s = 0.0
        heard = self.until("HEARTBEAT")
        self.system, self.px4 = heard.get_srcSystem(), heard.autopilot == dialect.MAV_AUTOPILOT_PX4

    def write(self, data: bytes) -> None:
        """Send a frame: pymavlink writes to a file."""
        self._socket.send(data)

    def until(self, kind: str, good: Callable[[Any], bool] = lambda _: True, seconds: float = 20.0) -> Any:
        """Return the next good message of a kind; fails on time-out."""
        deadline = time.monotonic() + seconds
        while (now := time.monotonic()) < deadline:
            if now - self._beat_s >= 1.0:
                self._beat_s = now
                self._mav.heartbeat_send(dialect.MAV_TYPE_GCS, dialect.MAV_AUTOPILOT_INVALID, 0, 0, 4)
            while self._heard:
                message = self._heard.popleft()
                if message.get_type() == kind and good(message):
                    return message
            with suppress(TimeoutError):
                self._heard += self._mav.parse_buffer(self._socket.recv(2048)) or ()
        raise AssertionError(f"no good {kind} within {seconds:g} s")

    def command(self, number: int, *values: float) -> int:
        """Return the result of a command."""
        self._mav.command_long_send(self.system, 1, number, 0, *values, *(0.0,) * (7 - len(values)))
        return int(self.until("COMMAND_ACK", lambda ack: ack.command == number).result)

    def version(self) -> Any:
        """Return AUTOPILOT_VERSION by REQUEST_MESSAGE."""
        assert self.command(dialect.MAV_CMD_REQUEST_MESSAGE, float(dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION)) == 0
        return self.until("AUTOPILOT_VERSION")

    def parameters(self) -> dict[str, float]:
        """Return all parameters of the list."""
        self._mav.param_request_list_send(self.system, 1)
        found: dict[str, float] = {}

        def is_last(parameter: Any) -> bool:
            found[parameter.param_id] = parameter.param_value
            return len(found) == parameter.param_count

        self.until("PARAM_VALUE", is_last)
        return found

    def files_are_refused(self) -> bool:
        """Return whether a file request is refused explicitly, and not ignored."""
        payload = [0] * 251
        payload[0], payload[3] = 7, _OPEN_FILE
        self._mav.file_transfer_protocol_send(0, self.system, 1, payload)
        return bool(self.until("FILE_TRANSFER_PROTOCOL").payload[3] == _NAK)

    def mission_sizes(self) -> list[int]:
        """Return the numbers of items of mission, fence and rally points."""
        sizes = []
        for kind in range(3):
            self._mav.mission_request_list_send(self.system, 1, kind)
            count = self.until("MISSION_COUNT")
            assert count.mission_type == kind
            sizes.append(int(count.count))
            self._mav.mission_ack_send(self.system, 1, 0, kind)
        return sizes

    def take_off(self, height_m: float) -> None:
        """Take off; PX4 climbs to the height of its parameters, 2.5 m by default."""
        if not self.px4:
            self._mav.request_data_stream_send(self.system, 1, _ALL, _RATE_HZ, 1)
        ready = dialect.MAV_SYS_STATUS_PREARM_CHECK
        self.until("SYS_STATUS", lambda status: status.onboard_control_sensors_health & ready)
        if not self.px4:
            assert self.command(dialect.MAV_CMD_DO_SET_MODE, 1.0, float(dialect.COPTER_MODE_GUIDED)) == 0
        assert self.command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0) == 0
        height = math.nan if self.px4 else height_m
        assert self.command(dialect.MAV_CMD_NAV_TAKEOFF, *(0.0,) * 6, height) == 0
        self.until("GLOBAL_POSITION_INT", lambda place: place.relative_alt > 920 * height_m, 30.0)

    def land(self) -> None:
        """Land, and wait until the motors have stopped."""
        assert self.command(dialect.MAV_CMD_NAV_LAND) == 0
        armed = dialect.MAV_MODE_FLAG_SAFETY_ARMED
        self.until("HEARTBEAT", lambda beat: not beat.base_mode & armed, 40.0)

    def close(self) -> None:
        """Close the port."""
        self._socket.close()
