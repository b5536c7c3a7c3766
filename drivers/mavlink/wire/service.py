"""Parameters, clocks, origin and the small services around a flight, in the order of the dialect."""

from typing import NamedTuple


class ParamRequestRead(NamedTuple):
    """Request one parameter, by name if the index is -1."""

    target_system: int
    target_component: int
    param_id: str
    param_index: int


class ParamRequestList(NamedTuple):
    """Request all parameters."""

    target_system: int
    target_component: int


class ParamSet(NamedTuple):
    """Write a parameter.

    WIRE (docs/reference/mavlink.md 5.4): PX4 carries integers bytewise, ArduPilot as a float of the value.
    """

    target_system: int
    target_component: int
    param_id: str
    param_value: float
    param_type: int


class ParamValue(NamedTuple):
    """A parameter as it is now."""

    param_id: str
    param_value: float
    param_type: int
    param_count: int
    param_index: int


class Timesync(NamedTuple):
    """tc1 0: a request sent at ts1 [ns]; else the answer: own time tc1, the request's ts1."""

    tc1: int
    ts1: int


class SystemTime(NamedTuple):
    """UNIX and boot time."""

    time_unix_usec: int
    time_boot_ms: int


class Ping(NamedTuple):
    """target 0/0: a request; else the answer to it."""

    time_usec: int
    seq: int
    target_system: int
    target_component: int


class SetGpsGlobalOrigin(NamedTuple):
    """Where on Earth the local origin shall lie: degrees x 1e7, mm."""

    target_system: int
    latitude: int
    longitude: int
    altitude: int
    time_usec: int = 0


class RequestDataStream(NamedTuple):
    """The old request for rates (MAVProxy, dronekit)."""

    target_system: int
    target_component: int
    req_stream_id: int
    req_message_rate: int
    start_stop: int


class MissionRequestList(NamedTuple):
    """Request the number of mission items."""

    target_system: int
    target_component: int
    mission_type: int = 0


class MissionCount(NamedTuple):
    """How many mission items there are."""

    target_system: int
    target_component: int
    count: int  # type: ignore[assignment]
    mission_type: int = 0


class MissionRequestInt(NamedTuple):
    """Request one mission item."""

    target_system: int
    target_component: int
    seq: int
    mission_type: int = 0


class MissionClearAll(NamedTuple):
    """Forget all mission items."""

    target_system: int
    target_component: int
    mission_type: int = 0


class MissionAck(NamedTuple):
    """How a transfer of mission items ended: 0 accepted, 3 unsupported, 13 no such item."""

    target_system: int
    target_component: int
    type: int
    mission_type: int = 0


class FileTransferProtocol(NamedTuple):
    """A step of MAVLink FTP."""

    target_network: int
    target_system: int
    target_component: int
    payload: tuple[int, ...]


class PlayTune(NamedTuple):
    """Play a tune, in music macro language."""

    target_system: int
    target_component: int
    tune: str
    tune2: str
