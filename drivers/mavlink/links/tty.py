"""Serial devices: raw bytes at a speed."""

import os
import termios

from groundstation.errors import DriverError

BITS_PER_BYTE = 10  # on a line 8N1, with start and stop


def make_raw(fd: int, baud: int) -> None:
    """Set an open device to raw bytes, 8N1; raises DriverError, termios.error."""
    speed = getattr(termios, f"B{baud}", None)
    if speed is None or baud == 0:  # B0 would hang up
        raise DriverError("no such speed")
    if not os.isatty(fd):
        raise DriverError("it is no serial port")
    attributes = termios.tcgetattr(fd)
    control = termios.CS8 | termios.CREAD | termios.CLOCAL
    termios.tcsetattr(fd, termios.TCSANOW, [0, 0, control, 0, speed, speed, attributes[6]])


def open_raw(device: str, baud: int) -> int:
    """Return the descriptor of a device, opened raw and without waiting; raises DriverError."""
    try:
        fd = os.open(device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError as error:
        raise DriverError(f"cannot open {device}: {error.strerror}") from error
    try:
        make_raw(fd, baud)
    except (termios.error, DriverError) as error:
        os.close(fd)
        raise DriverError(f"cannot use {device} at {baud} baud: {error}") from error
    return fd
