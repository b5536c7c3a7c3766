"""The last seconds of a flight, as they came."""

from collections import deque

from groundstation.bus.messages import FlightState, Message, RelativeObservation, VehicleStatus
from groundstation.bus.topics import IMU, OBSERVATION, ODOMETRY, VEHICLE_STATUS
from groundstation.calibration.flown import Flown
from groundstation.time_units import NS_PER_S

TOPICS = (ODOMETRY, IMU, OBSERVATION, VEHICLE_STATUS)
_LASTS_NS = 40 * NS_PER_S
_LEAST_NS = 8 * NS_PER_S
_DOWN = frozenset({FlightState.LANDED, FlightState.UNKNOWN})


class Window:
    """Takes messages as they arrive; `flown` returns those of the last 40 s while somebody flies."""

    def __init__(self, clock: str) -> None:
        self._clock = clock
        self._rows: deque[tuple[int, tuple[str, Message]]] = deque()
        self._flying: dict[str, bool] = {}

    def take(self, key: str, message: Message, now_ns: int) -> None:
        """Take a message; what another clock stamped tells nothing here."""
        if message.header.clock != self._clock:
            return
        if isinstance(message, VehicleStatus):
            self._flying[message.header.entity] = message.flight_state not in _DOWN
        self._rows.append((now_ns, (key, message)))
        while self._rows[0][0] < now_ns - _LASTS_NS:
            self._rows.popleft()

    def flown(self) -> Flown | None:
        """Return what was taken; None while nobody flies, or for less than 8 s."""
        rows = tuple(self._rows)
        if not any(self._flying.values()) or rows[-1][0] - rows[0][0] < _LEAST_NS:
            return None
        cameras: dict[str, int] = {}
        for _, (_, message) in rows:
            if isinstance(message, RelativeObservation):
                cameras[message.camera] = cameras.get(message.camera, 0) + 1
        return Flown(tuple((now_ns, (row,)) for now_ns, row in rows), self._clock, cameras)
