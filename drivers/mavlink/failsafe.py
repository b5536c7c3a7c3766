"""Datagrams that supervisor or guardian send to vehicles for a driver that died or hangs."""

from collections.abc import Sequence

from drivers.mavlink.convert import setpoint_from_velocity
from drivers.mavlink.wire.flight import command_to
from drivers.mavlink.wire.frames import FrameEncoder
from drivers.mavlink.wire.names import MavCmd
from drivers.mavlink.wire.telemetry import OUR_HEARTBEAT
from drivers.mavlink.wire.verification import Signing
from drivers.vehicle_settings import VehicleLimits

# Without its driver it gets no positions: in a hover it drifts ever faster (docs/reference/mavlink.md 2.1).
# Without these datagrams it would land as soon: COM_OF_LOSS_T.
HOVERS_S = 0.5
# The ids that ground stations have.
_SYSTEM, _COMPONENT = 255, 190


def hover_and_land(systems: Sequence[int], *, signed: bool = False) -> tuple[bytes, bytes]:
    """Return the datagrams that stop and land the vehicles of a link; both may be repeated.

    signed: with room for signatures, which the sender makes (`wire/signature.py`).
    """
    encoder = _encoder(signed)
    stop = [setpoint_from_velocity(system, 0, (0.0, 0.0, 0.0), 0.0, VehicleLimits()) for system in systems]
    land = [command_to(system, MavCmd.NAV_LAND) for system in systems]
    return b"".join(map(encoder.encode, stop)), b"".join(map(encoder.encode, land))


def heartbeat(*, signed: bool = False) -> bytes:
    """Return the driver's heartbeat; signed: as above."""
    return _encoder(signed).encode(OUR_HEARTBEAT)


def _encoder(signed: bool) -> FrameEncoder:
    return FrameEncoder(_SYSTEM, _COMPONENT, Signing(bytes(32), 0) if signed else None)
