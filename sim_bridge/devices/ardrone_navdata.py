"""Navdata as an AR.Drone writes it: a template packet of its firmware with the living fields written in place.

This file writes native units and axes (mdeg, mm, mg; forward-right-down) by itself and by offsets of its own, taken
from docs/reference/ardrone.md 4: it shares neither conversions nor layouts with the driver.
"""

import math
import struct
from dataclasses import dataclass
from zlib import adler32

from sim_bridge.devices.ardrone_firmware import DEFAULT, FIRMWARES, ArdroneFirmware
from sim_bridge.world.airframe import GRAVITY_M_S2
from sim_bridge.world.ardrone_sensors import Onboard
from sim_bridge.world.readings import Readings

Readable = Onboard | Readings

DEFAULT_OPTIONS = 65537  # DEMO and VISION_DETECT
_DEMO, _TIME, _RAW, _PHYS, _EULER, _REFERENCES, _PWM, _ALTITUDE = 0, 1, 2, 3, 5, 6, 9, 10
_VISION, _VIDEO_STREAM, _PRESSURE, _MAGNETO, _KALMAN = 13, 19, 21, 22, 24

_HEADER = struct.Struct("<IIII")
_CHECKSUM = struct.Struct("<HHI")
_DEMO_FIELDS = struct.Struct("<II3fi3fI")  # control state, battery, theta phi psi, altitude, vx vy vz, pictures
_PHYS_FIELDS = struct.Struct("<3f3f")
_EULER_FIELDS = struct.Struct("<2f")
_ALTITUDE_FIELDS = struct.Struct("<ifii")  # vision, vz, reference, raw
_MAGNETO_FIELDS = struct.Struct("<3f")  # heading: unwrapped, gyro, fusion [deg]
_KALMAN_FIELDS = struct.Struct("<2f")  # height [mm], climb [m/s]
_VELOCITY_FIELDS = struct.Struct("<3f")
_AT_FIELDS = struct.Struct("<II")  # sequence number, mean gap
_PWM_FIELDS = struct.Struct("<4B")
_RAW_FIELDS = struct.Struct("<3H3h")
_WORD = struct.Struct("<I")
_SIGNED = struct.Struct("<i")

_MDEG = math.degrees(1.0) * 1000.0
_DEG = math.degrees(1.0)
_MG = 1000.0 / GRAVITY_M_S2
_MICROSECONDS_PER_TICK = 5000
_PICTURES_PER_SECOND = 30
_BLOCK = 256  # bytes: their sum is less than 65521


@dataclass(slots=True)
class NavdataState:
    """Contents of a packet other than sensor readings.

    pcmd_sequence: of the last PCMD obeyed; pwm: of the four motors; at_gap_ms: between the last two AT datagrams.
    """

    word: int = 0
    control_state: int = 2 << 16
    pwm: tuple[int, int, int, int] = (0, 0, 0, 0)
    pcmd_sequence: int = 0
    at_sequence: int = 0
    at_gap_ms: int = 0


class _Packet:
    """A buffer with the given options, zero but for constants, and the offset of each."""

    def __init__(self, firmware: ArdroneFirmware, mask: int) -> None:
        sizes = firmware.sizes
        tags = [tag for tag in sorted(sizes) if mask >> tag & 1]
        self.at: dict[int, int] = {}
        offset = _HEADER.size
        for tag in tags:
            self.at[tag] = offset
            offset += sizes[tag]
        self.buffer = bytearray(offset + _CHECKSUM.size)
        body = memoryview(self.buffer)[:offset]
        self._blocks = [body[start : start + _BLOCK] for start in range(0, offset, _BLOCK)]
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
        total = 0
        for block in self._blocks:
            # The low half of an Adler-32 from 0 on is the plain sum modulo 65521: the fastest way to add bytes up.
            total += adler32(block, 0) & 0xFFFF
        _CHECKSUM.pack_into(self.buffer, self._end, 0xFFFF, 8, total)
        return self.buffer


# Constant in these emulated drones; values of a real landed drone's packet.
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

    def __init__(self, firmware: ArdroneFirmware = FIRMWARES[DEFAULT]) -> None:
        self._firmware = firmware
        self._status = _Packet(firmware, 0)
        self._full = _Packet(firmware, -1)
        self._demo = _Packet(firmware, DEFAULT_OPTIONS)
        self._mask = DEFAULT_OPTIONS
        self._last, self._word = self._status, 0

    def status(self, word: int, sequence: int) -> bytearray:
        """Return a packet of header and checksum only."""
        return self._status.finish(word, sequence)

    def demo(self, mask: int, state: NavdataState, onboard: Readable, ticks: int, sequence: int) -> bytearray:
        """Return the packet of demo mode with the options of the mask; DEMO and VISION_DETECT always come."""
        if mask != self._mask:
            self._mask = mask
            self._demo = _Packet(self._firmware, mask | DEFAULT_OPTIONS)
        return self._fill(self._demo, state, onboard, ticks, sequence)

    def full(self, state: NavdataState, onboard: Readable, ticks: int, sequence: int) -> bytearray:
        """Return the packet of full mode: all options of the firmware."""
        return self._fill(self._full, state, onboard, ticks, sequence)

    def again(self, sequence: int) -> bytearray:
        """Return the last packet that was no status packet, with another number, for the next client."""
        return self._last.finish(self._word, sequence)

    def _fill(self, packet: _Packet, state: NavdataState, onboard: Readable, ticks: int, sequence: int) -> bytearray:
        buffer, at = packet.buffer, packet.at
        theta, phi, psi = -onboard.pitch * _MDEG, onboard.roll * _MDEG, -onboard.yaw * _MDEG
        height_mm = round(onboard.height * 1000)
        if self._firmware.generation == 1:
            height_mm = height_mm or round(onboard.echo * 1000)  # WIRE: a real AR.Drone 1 says 261 mm on the floor
        _DEMO_FIELDS.pack_into(
            buffer, at[_DEMO] + 4, state.control_state, round(onboard.battery * 100), theta, phi, psi,
            height_mm, onboard.vx * 1000, -onboard.vy * 1000, 0.0, ticks * _PICTURES_PER_SECOND // 200,
        )  # fmt: skip
        if len(at) > 2:
            _fill_measures(buffer, at, onboard, ticks)
            _fill_height(buffer, at, onboard, height_mm)
            _fill_control(buffer, at, state, onboard, self._firmware.generation == 2)
        self._last, self._word = packet, state.word
        return packet.finish(state.word, sequence)


def _fill_measures(buffer: bytearray, at: dict[int, int], onboard: Readable, ticks: int) -> None:
    if _TIME in at:
        microseconds = ticks * _MICROSECONDS_PER_TICK
        seconds, rest = divmod(microseconds, 1_000_000)
        _WORD.pack_into(buffer, at[_TIME] + 4, (seconds % 2048) << 21 | rest)
    gx, gy, gz = onboard.gyros
    fx, fy, fz = onboard.accelerometers
    if _RAW in at:
        _RAW_FIELDS.pack_into(
            buffer, at[_RAW] + 4,
            _raw_force(fx), _raw_force(-fy), _raw_force(fz), _raw_rate(gx), _raw_rate(-gy), _raw_rate(-gz),
        )  # fmt: skip
        _WORD.pack_into(buffer, at[_RAW] + 20, round(11000 + 1400 * onboard.battery))
    if _PHYS in at:
        _PHYS_FIELDS.pack_into(
            buffer, at[_PHYS] + 10, fx * _MG, -fy * _MG, -fz * _MG, gx * _DEG, -gy * _DEG, -gz * _DEG
        )
    if _EULER in at:  # from the accelerometers alone
        _EULER_FIELDS.pack_into(buffer, at[_EULER] + 4, math.atan2(fx, fz) * _MDEG, math.atan2(fy, fz) * _MDEG)


def _raw_force(force_m_s2: float) -> int:
    # AR2: about 512 LSB per g around 2048.
    return max(0, min(4095, round(2048 + 52.2 * force_m_s2)))


def _raw_rate(rate_rad_s: float) -> int:
    # AR2: 16.4 LSB per deg/s.
    return max(-32768, min(32767, round(939.0 * rate_rad_s)))


def _fill_height(buffer: bytearray, at: dict[int, int], onboard: Readable, height_mm: int) -> None:
    # WIRE: on the ground the ultrasound still reads about 240 mm while DEMO says 0.
    echo_mm = round(onboard.echo * 1000)
    if _ALTITUDE in at:
        _ALTITUDE_FIELDS.pack_into(buffer, at[_ALTITUDE] + 4, height_mm, onboard.vz * 1000, height_mm, echo_mm)
    if _KALMAN in at:
        _KALMAN_FIELDS.pack_into(buffer, at[_KALMAN] + 8, height_mm, onboard.vz)
        _WORD.pack_into(buffer, at[_KALMAN] + 52, onboard.rejected)


def _fill_control(buffer: bytearray, at: dict[int, int], state: NavdataState, onboard: Readable, second: bool) -> None:
    if _PWM in at:
        _PWM_FIELDS.pack_into(buffer, at[_PWM] + 4, *state.pwm)
    if _VISION in at:
        _VELOCITY_FIELDS.pack_into(buffer, at[_VISION] + 52, onboard.vx * 1000, -onboard.vy * 1000, 0.0)
    if _VIDEO_STREAM in at:
        _AT_FIELDS.pack_into(buffer, at[_VIDEO_STREAM] + 13, state.at_sequence & 0xFFFFFFFF, state.at_gap_ms)
    if not second:
        return  # WIRE: the fields below lie beyond the shorter options of an AR.Drone 1
    if _REFERENCES in at:
        _SIGNED.pack_into(buffer, at[_REFERENCES] + 84, state.pcmd_sequence)
    if _RAW in at:
        _SIGNED.pack_into(buffer, at[_RAW] + 46, round(onboard.echo * 1000))
    if _MAGNETO in at:  # WIRE: degrees, whatever the SDK header says; fusion equals psi
        heading = -onboard.yaw * _DEG
        _MAGNETO_FIELDS.pack_into(buffer, at[_MAGNETO] + 46, heading, heading, heading)
