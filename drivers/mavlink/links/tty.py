"""Serial devices: raw bytes at a speed."""

import termios

from groundstation.errors import DriverError


def make_raw(fd: int, baud: int) -> None:
    """Set an open device to raw bytes, 8N1; raises DriverError, termios.error."""
    speed = getattr(termios, f"B{baud}", None)
    if speed is None:
        raise DriverError("no such speed")
    attributes = termios.tcgetattr(fd)
    control = termios.CS8 | termios.CREAD | termios.CLOCAL
    termios.tcsetattr(fd, termios.TCSANOW, [0, 0, control, 0, speed, speed, attributes[6]])
