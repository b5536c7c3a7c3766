"""Refusals of MAVLink FTP: a client without an answer repeats its request for seconds before it goes on without."""

from drivers.mavlink.wire.service import FileTransferProtocol

_NAK, _FAIL, _SIZE = 129, 1, 251


def refusal(request: FileTransferProtocol, system: int, component: int) -> FileTransferProtocol:
    """Return the refusal of a request, addressed to its sender."""
    # WIRE (MAVLink FTP): sequence + 1, opcode NAK, the request's opcode, error FAIL.
    asked = request.payload
    sequence = (asked[0] | asked[1] << 8) + 1 & 0xFFFF
    head = (sequence & 255, sequence >> 8, asked[2], _NAK, 1, asked[3], 0, 0, 0, 0, 0, 0, _FAIL)
    return FileTransferProtocol(0, system, component, head + (0,) * (_SIZE - len(head)))
