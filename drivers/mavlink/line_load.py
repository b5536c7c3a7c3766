"""How much of a serial line a vehicle's messages take, by their rates and sizes. Pure.

Both directions count: its telemetry, and our poses, setpoints and heartbeats.
"""

from collections.abc import Mapping, Sequence

from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink.links.tty import BITS_PER_BYTE
from drivers.mavlink.settings import MavlinkDriverSettings, VehicleSettings
from drivers.mavlink.stream_rates import streams
from drivers.mavlink.wire.flight import OdometryMessage, SetPositionTargetLocalNed, VisionPositionEstimate
from drivers.mavlink.wire.frames import Message, id_of
from drivers.mavlink.wire.names import Flavour
from drivers.mavlink.wire.service import Timesync
from drivers.mavlink.wire.signature import CHECKSUM, HEADER, SIGNATURE
from drivers.mavlink.wire.telemetry import Heartbeat

# Beyond this share requests, parameters and a radio that carries less than its line find too little room.
WISE = 0.6
_SLOWER = ", or a lower vision_hz"
_HEARTBEAT_HZ, _TIMESYNC_HZ = 4.0, 10.0


def fault(settings: MavlinkDriverSettings) -> str:
    """Return why the line of a driver cannot carry what the driver sends, or ""."""
    sent = _bytes_sent(settings)
    return _told("carries less than is sent", settings, sent, _SLOWER) if _of_line(settings, sent) > 1.0 else ""


def caution(settings: MavlinkDriverSettings) -> str:
    """Return that the line of a driver has little or nothing to spare in its busier direction, or "".

    Autopilots send less often if the line is full: too much telemetry is no fault.
    """
    received = _bytes_received(settings)
    busier = max(_bytes_sent(settings), received)
    if fault(settings) or _of_line(settings, busier) <= WISE:
        return ""
    what = "cannot carry its telemetry" if _of_line(settings, received) > 1.0 else "leaves little room"
    return _told(what, settings, busier, _SLOWER if _of_line(settings, received) <= WISE else "")


def _told(what: str, settings: MavlinkDriverSettings, bytes_per_s: float, slower: str) -> str:
    share = f"{bytes_per_s / 1000:.1f} kB/s are {100 * _of_line(settings, bytes_per_s):.0f} % of it"
    return f"{what}: {share}, up to {100 * WISE:.0f} % are sound: take a faster line{slower}"


def _of_line(settings: MavlinkDriverSettings, bytes_per_s: float) -> float:
    way, _, baud = settings.link.target.split(":")
    return bytes_per_s * BITS_PER_BYTE / max(1, int(baud)) if way == "serial" else 0.0


def _bytes_sent(settings: MavlinkDriverSettings) -> float:
    return _bytes_per_s(settings, [_sent(one, settings.vision.rate_hz) for one in settings.vehicles])


def _bytes_received(settings: MavlinkDriverSettings) -> float:
    return _bytes_per_s(settings, [_received(one) for one in settings.vehicles])


def _sent(vehicle: VehicleSettings, vision_hz: float) -> Mapping[type[Message], float]:
    pose = OdometryMessage if vehicle.flavour == "px4" else VisionPositionEstimate
    rates = {pose: vision_hz, SetPositionTargetLocalNed: vehicle.setpoint_hz, Heartbeat: _HEARTBEAT_HZ}
    return rates | ({Timesync: _TIMESYNC_HZ} if vehicle.flavour == "px4" else {})


def _received(vehicle: VehicleSettings) -> Mapping[type[Message], float]:
    return streams(Flavour[vehicle.flavour.upper()], vehicle.odometry_hz, vehicle.imu_hz)


def _bytes_per_s(settings: MavlinkDriverSettings, flows: Sequence[Mapping[type[Message], float]]) -> float:
    around = HEADER + CHECKSUM + (SIGNATURE if settings.link.key_file else 0)
    sizes = {kind: around + dialect.mavlink_map[id_of(kind)].unpacker.size for flow in flows for kind in flow}
    return float(sum(sizes[kind] * rate_hz for flow in flows for kind, rate_hz in flow.items()))
