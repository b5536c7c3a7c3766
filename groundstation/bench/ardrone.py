"""CPU time of the AR.Drone codec, against a public client and a bare loop of structs."""

import statistics
import struct
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from drivers.ardrone.wire import at, navdata, options
from drivers.ardrone.wire.navdata import Navdata
from drivers.ardrone.wire.tags import OPTION_SIZES, Tag

LIMIT_US = 60.0
_FIRMWARE = "ar2-2.3"
_PYARDRONE = Path(".interop") / "pyardrone" / "bin" / "python"
# Runs in pyardrone's own environment. Its decoder checks the sum and copies every option, but turns a field into a
# number when it is read; ours has turned all of them.
_PEER = """
import ctypes, sys, time
from pyardrone.navdata import NavData
packet, count, fields = bytes.fromhex(sys.argv[1]), int(sys.argv[2]), sys.argv[3] == "fields"
def decode():
    read = NavData(packet)
    if fields:
        for option in vars(read).values():
            for name, *_ in getattr(option, "_fields_", ()):
                value = getattr(option, name)
                if isinstance(value, ctypes.Array):
                    list(value)
decode()
began = time.process_time()
for _ in range(count):
    decode()
print((time.process_time() - began) / count * 1e6)
"""
_HEAD, _OPTION = struct.Struct("<IIII"), struct.Struct("<HH")


def full_packet() -> bytes:
    """Return a packet with all 28 options of an AR.Drone 2 (1916 bytes)."""
    sizes = OPTION_SIZES[_FIRMWARE]
    known = {
        0: options.DEMO.encode(options.Demo(theta_mdeg=-1200.0, psi_mdeg=14668.0, altitude_mm=760), sizes[0]),
        1: options.TIME.encode(options.Time.from_seconds(362.9)),
        2: options.RAW_MEASURES.encode(options.RawMeasures(), sizes[2]),
        3: options.PHYS_MEASURES.encode(options.PhysMeasures()),
        9: options.PWM.encode(options.Pwm(motors=(170, 171, 169, 170)), sizes[9]),
        10: options.ALTITUDE.encode(options.Altitude(vision_mm=760)),
    }
    payloads = tuple((tag, known.get(tag, bytes(size - 4))) for tag, size in sizes.items())
    return navdata.encode(Navdata(0x0F8004D0, 4711, 1, payloads))


def read_everything(packet: bytes) -> int:
    """Decode a packet, its checksum and the values of all its options; returns the number of options."""
    decoded = navdata.decode(packet)
    return sum(decoded.read(layout) is not None for layout in options.LAYOUTS)


def bare_loop(packet: bytes) -> int:
    """Decode the least possible: walk the options by their sizes and check the sum."""
    _HEAD.unpack_from(packet)
    offset, count = _HEAD.size, 0
    while True:
        tag, size = _OPTION.unpack_from(packet, offset)
        if tag == Tag.CHECKSUM:
            return count if struct.unpack_from("<I", packet, offset + 4)[0] == sum(packet[:offset]) else -1
        count += len(packet[offset + 4 : offset + size]) > 0
        offset += size


def microseconds(work: Callable[[], object], count: int, rounds: int) -> dict[str, float]:
    """Return the CPU time of one call: median and least of several rounds [us]."""
    work()
    found = []
    for _ in range(rounds):
        began = time.process_time()
        for _ in range(count):
            work()
        found.append((time.process_time() - began) / count * 1e6)
    return {"median_us": statistics.median(found), "min_us": min(found)}


def peer_microseconds(packet: bytes, count: int, rounds: int, what: str) -> dict[str, float] | None:
    """Return the CPU time of pyardrone's decoder [us], or None without its environment (`make interop`).

    what: `options` as it decodes them, or `fields`: each read once.
    """
    if not _PYARDRONE.exists():
        return None
    found = []
    for _ in range(rounds):
        command = [str(_PYARDRONE), "-c", _PEER, packet.hex(), str(count), what]
        result = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
        if result.returncode != 0:
            return None
        found.append(float(result.stdout))
    return {"median_us": statistics.median(found), "min_us": min(found)}


def measure(count: int, rounds: int) -> dict[str, Any]:
    """Return the figures of all timed work."""
    packet = full_packet()
    decoded = navdata.decode(packet)
    motion = at.ProgressiveMotion(1, 0.1, -0.2, 0.3, -0.4)
    datagram = at.encode_datagram([at.ref(True), at.pcmd(motion)], 4711)
    times: dict[str, dict[str, float] | None] = {
        "navdata: packet and all options": microseconds(lambda: read_everything(packet), count, rounds),
        "navdata: packet and DEMO": microseconds(lambda: navdata.decode(packet).read(options.DEMO), count, rounds),
        "navdata: packet alone": microseconds(lambda: navdata.decode(packet), count, rounds),
        "navdata: encode a packet": microseconds(lambda: navdata.encode(decoded), count, rounds),
        "AT: encode REF and PCMD": microseconds(
            lambda: at.encode_datagram([at.ref(True), at.pcmd(motion)], 4711), count, rounds
        ),
        "AT: decode REF and PCMD": microseconds(lambda: at.decode_datagram(datagram), count, rounds),
        "peer: bare loop of structs": microseconds(lambda: bare_loop(packet), count, rounds),
        "peer: pyardrone, all options": peer_microseconds(packet, count, rounds, "options"),
        "peer: pyardrone, all fields": peer_microseconds(packet, count, rounds, "fields"),
    }
    return {"packet_bytes": len(packet), "limit_us": LIMIT_US, "times": times}
