"""Navdata as an AR.Drone 2 (firmware 2.3) writes it: a template packet with the living fields written in place.

This file writes native units and axes (mdeg, mm, mg; forward-right-down) by itself and by offsets of its own, taken
from the protocol sheet: it shares neither the driver's conversions nor the layouts that the driver decodes with.
"""

import math
import struct
from dataclasses import dataclass

import numpy as np

from drivers.ardrone.wire.tags import OPTION_SIZES
from sim_bridge.world.airframe import GRAVITY_M_S2
from sim_bridge.world.onboard import Onboard

PROFILE = "ar2-2.3"
DEFAULT_OPTIONS = 65537  # DEMO and VISION_DETECT
_DEMO, _TIME, _RAW, _PHYS, _EULER, _REFERENCES, _PWM, _ALTITUDE, _VISION_DETECT = 0, 1, 2, 3, 5, 6, 9, 10, 16
_VIDEO_STREAM, _PRESSURE, _MAGNETO = 19, 21, 22

_HEADER = struct.Struct("<IIII")
_CHECKSUM = struct.Struct("<HHI")
_DEMO_FIELDS = struct.Struct("<II3fi3f")  # control state, battery, theta phi psi, altitude, vx vy vz
_PHYS_FIELDS = struct.Struct("<3f3f")
_EULER_FIELDS = struct.Struct("<2f")
_ALTITUDE_FIELDS = struct.Struct("<ifii")  # vision, vz, reference, raw
_MAGNETO_FIELDS = struct.Struct("<3f")  # heading: unwrapped, gyro, fusion [deg]
_RAW_FIELDS = struct.Struct("<3H3h")
_WORD = struct.Struct("<I")
_SIGNED = struct.Struct("<i")

_MDEG = math.degrees(1.0) * 1000.0
_DEG = math.degrees(1.0)
_MG = 1000.0 / GRAVITY_M_S2
# WIRE: on the ground the ultrasound still reads about 240 mm while DEMO says 0.
_GROUND_ECHO_MM = 243
_MICROSECONDS_PER_TICK = 5000


@dataclass(slots=True)
class NavdataState:
    """What the packet says besides the sensor readings; `pcmd_sequence` is that of the last PCMD obeyed."""

    word: int = 0
    control_state: int = 2 << 16
    motors_on: bool = False
    pcmd_sequence: int = 0
    at_sequence: int = 0


class _Packet:
    """A buffer with the given options, zero but for constants, and the offset of each."""

    def __init__(self, tags: list[int]) -> None:
        sizes = OPTION_SIZES[PROFILE]
        self.at: dict[int, int] = {}
        offset = _HEADER.size
        for tag in tags:
            self.at[tag] = offset
            offset += sizes[tag]
        self.buffer = bytearray(offset + _CHECKSUM.size)
        self._body = np.frombuffer(self.buffer, dtype=np.uint8)[:offset]
        self._end = offset
        for tag, start in self.at.items():
            struct.pack_into("<HH", self.buffer, start, tag, sizes[tag])
        self._write_constants()

    def _write_constants(self) -> None:
        for tag, offset, form, values in _CONSTANTS:
            if tag in self.at:
                struct.pack_into(form, self.buffer, self.at[tag] + offset, *values)

    def finish(self, word: int, sequence: int) -> bytearray:
        """Write header and checksum and return the packet."""
        _HEADER.pack_into(self.buffer, 0, 0x55667788, word, sequence & 0xFFFFFFFF, 1 if self.at else 0)
        total = int(np.add.reduce(self._body, dtype=np.uint32))
        _CHECKSUM.pack_into(self.buffer, self._end, 0xFFFF, 8, total)
        return self.buffer


# What never changes in these emulated drones; values of the real landed packet.
_CONSTANTS: tuple[tuple[int, int, str, tuple[float, ...]], ...] = (
    (_DEMO, 96, "<I", (3,)),
    (_DEMO, 100, "<9f", (1, 0, 0, 0, 1, 0, 0, 0, 1)),
    (_RAW, 20, "<I", (11686,)),
    (_RAW, 28, "<H", (3758,)),
    (_PHYS, 4, "<fH", (45.0, 0)),
    (_PWM, 8, "<4B", (255, 255, 255, 255)),
    (17, 4, "<i", (4822,)),
    (_PRESSURE, 10, "<ii", (435, 101586)),
    (_MAGNETO, 58, "<B", (1,)),
)


class NavdataWriter:
    """Writes the packets of one drone; the returned buffers are reused by the next call."""

    def __init__(self) -> None:
        self._status = _Packet([])
        self._full = _Packet(sorted(OPTION_SIZES[PROFILE]))
        self._demo = _Packet([_DEMO, _VISION_DETECT])
        self._mask = DEFAULT_OPTIONS

    def status(self, word: int, sequence: int) -> bytearray:
        """Return a packet of header and checksum only."""
        return self._status.finish(word, sequence)

    def demo(self, mask: int, state: NavdataState, onboard: Onboard, ticks: int, sequence: int) -> bytearray:
        """Return the packet of demo mode with the options of the mask; DEMO and VISION_DETECT always come."""
        if mask != self._mask:
            self._mask = mask
            wanted = mask | DEFAULT_OPTIONS
            self._demo = _Packet([tag for tag in sorted(OPTION_SIZES[PROFILE]) if wanted >> tag & 1])
        return self._fill(self._demo, state, onboard, ticks, sequence)

    def full(self, state: NavdataState, onboard: Onboard, ticks: int, sequence: int) -> bytearray:
        """Return the packet of full mode: all 28 options, 1916 bytes."""
        return self._fill(self._full, state, onboard, ticks, sequence)

    def _fill(self, packet: _Packet, state: NavdataState, onboard: Onboard, ticks: int, sequence: int) -> bytearray:
        buffer, at = packet.buffer, packet.at
        theta, phi, psi = -onboard.pitch * _MDEG, onboard.roll * _MDEG, -onboard.yaw * _MDEG
        _DEMO_FIELDS.pack_into(
            buffer, at[_DEMO] + 4, state.control_state, round(onboard.battery * 100), theta, phi, psi,
            round(onboard.height * 1000), onboard.vx * 1000, -onboard.vy * 1000, 0.0,
        )  # fmt: skip
        if len(at) > 2:
            _fill_measures(buffer, at, onboard, ticks)
            _fill_control(buffer, at, state, psi)
        return packet.finish(state.word, sequence)


def _fill_measures(buffer: bytearray, at: dict[int, int], onboard: Onboard, ticks: int) -> None:
    if _TIME in at:
        microseconds = ticks * _MICROSECONDS_PER_TICK
        seconds, rest = divmod(microseconds, 1_000_000)
        _WORD.pack_into(buffer, at[_TIME] + 4, (seconds % 2048) << 21 | rest)
    gx, gy, gz = onboard.gyros
    fx, fy, fz = onboard.accelerometers
    if _RAW in at:
        # AR2: about 512 LSB per g around 2048; gyros 16.4 LSB per deg/s.
        _RAW_FIELDS.pack_into(
            buffer, at[_RAW] + 4,
            *(max(0, min(4095, round(2048 + 52.2 * f))) for f in (fx, -fy, fz)),
            *(max(-32768, min(32767, round(939.0 * g))) for g in (gx, -gy, -gz)),
        )  # fmt: skip
        _WORD.pack_into(buffer, at[_RAW] + 20, round(11000 + 1400 * onboard.battery))
        _SIGNED.pack_into(buffer, at[_RAW] + 46, round(onboard.height * 1000) or _GROUND_ECHO_MM)
    if _PHYS in at:
        _PHYS_FIELDS.pack_into(
            buffer, at[_PHYS] + 10, fx * _MG, -fy * _MG, -fz * _MG, gx * _DEG, -gy * _DEG, -gz * _DEG
        )
    if _EULER in at:  # from the accelerometers alone
        _EULER_FIELDS.pack_into(buffer, at[_EULER] + 4, math.atan2(fx, fz) * _MDEG, math.atan2(fy, fz) * _MDEG)
    if _ALTITUDE in at:
        height = round(onboard.height * 1000)
        _ALTITUDE_FIELDS.pack_into(
            buffer, at[_ALTITUDE] + 4, height, onboard.vz * 1000, height, height or _GROUND_ECHO_MM
        )


def _fill_control(buffer: bytearray, at: dict[int, int], state: NavdataState, psi_mdeg: float) -> None:
    if _REFERENCES in at:
        _SIGNED.pack_into(buffer, at[_REFERENCES] + 84, state.pcmd_sequence)
    if _PWM in at:
        pwm = 170 if state.motors_on else 0  # 67 % of 255 carries an AR2 with its indoor hull
        struct.pack_into("<4B", buffer, at[_PWM] + 4, pwm, pwm, pwm, pwm)
    if _MAGNETO in at:  # WIRE: degrees, whatever the SDK header says; fusion equals psi
        heading = psi_mdeg / 1000
        _MAGNETO_FIELDS.pack_into(buffer, at[_MAGNETO] + 46, heading, heading, heading)
    if _VIDEO_STREAM in at:
        _WORD.pack_into(buffer, at[_VIDEO_STREAM] + 13, state.at_sequence & 0xFFFFFFFF)
