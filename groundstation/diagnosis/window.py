"""The messages of the last seconds of a flight, as they arrived."""

from collections import deque
from collections.abc import Mapping

from groundstation.bus.messages import (
    STANDING,
    Belief,
    FlightState,
    Message,
    RelativeObservation,
    VehicleStatus,
    Verdict,
)
from groundstation.bus.topics import BELIEF, IMU, OBSERVATION, ODOMETRY, VEHICLE_STATUS
from groundstation.calibration.flown import Flown
from groundstation.estimation.message_screen import MessageScreen
from groundstation.estimation.parameters import parameters_from_field
from groundstation.field.resolved import ResolvedField
from groundstation.time_units import NS_PER_MS, NS_PER_S

TOPICS = (ODOMETRY, IMU, OBSERVATION, VEHICLE_STATUS, BELIEF)
_LASTS_NS = 40 * NS_PER_S
# Length of flight that is judged; longer if it began in the air: no pad then gives the start, and figures bend paths.
_LEAST_NS, _LEAST_ALOFT_NS = 8 * NS_PER_S, 20 * NS_PER_S
_DOWN = STANDING | {FlightState.UNKNOWN}
# A picture repeated for this long is frozen; until then it may have been sent twice.
_HANGS_NS = 300 * NS_PER_MS
_Row = tuple[int, tuple[tuple[str, Message], ...]]
_REPEATS = (Verdict.DUPLICATE, Verdict.FROZEN)


class Window:
    """Takes messages as they arrive; `flown` returns those of the last 40 s while a drone flies.

    Messages that the tracker would refuse do not count here either: a frozen picture is no wrong figure. Nor do the
    sightings of a camera since it was bumped: no one mounting explains both those before and those after. `forgotten`
    rises with each such finding.
    """

    def __init__(self, field: ResolvedField, clock: str) -> None:
        self.forgotten = 0
        self._clock = clock
        self._screen = MessageScreen(parameters_from_field(field), _LASTS_NS)
        self._rows: deque[_Row] = deque()
        self._flying: dict[str, bool] = {}
        self._stood: set[str] = set()
        self._flew_before: set[str] = set()  # before the window began
        self._missed_the_start = False
        self._hung_ns: dict[str, int] = {}
        self._moved = frozenset[str]()

    def take(self, key: str, message: Message, now_ns: int) -> None:
        """Take a message; stamps of another clock are ignored."""
        stamp_ns = message.header.stamp_ns
        if message.header.clock != self._clock:
            return
        if isinstance(message, Belief):
            self._forget_moved(message)
            return
        if isinstance(message, RelativeObservation) and message.observer in self._moved:
            return
        verdict = self._screen.refusal(key, message, stamp_ns, now_ns)
        if verdict in _REPEATS and isinstance(message, RelativeObservation):
            self._forget_hung(message)
        if verdict:
            return
        if isinstance(message, VehicleStatus):
            self._note(message)
        self._rows.append((now_ns, ((key, message),)))
        while self._rows[0][0] < now_ns - _LASTS_NS:
            _, ((_, old),) = self._rows.popleft()
            if isinstance(old, VehicleStatus) and old.flight_state not in _DOWN:
                self._flew_before.add(old.header.entity)

    def _note(self, status: VehicleStatus) -> None:
        name, flies = status.header.entity, status.flight_state not in _DOWN
        self._missed_the_start = self._missed_the_start or (flies and name not in self._flying)
        self._flying[name] = flies
        if status.flight_state is FlightState.LANDED:
            self._stood.add(name)

    def _forget_hung(self, seen: RelativeObservation) -> None:
        """Drop a camera's sightings since the picture that it is now found to repeat."""
        since_ns, hung = self._hung_ns.get(seen.camera, 0), seen.picture_ns
        if not hung or hung == since_ns or seen.header.stamp_ns - hung < _HANGS_NS:
            return
        self._hung_ns[seen.camera] = hung
        self.forgotten += 1
        self._rows = deque(row for row in self._rows if not _shown_after(row[1][0][1], seen.camera, hung))

    def _forget_moved(self, belief: Belief) -> None:
        """Drop the sightings of a bumped camera since it was in place; once it counts again, all from before."""
        since_ns = {one.sensor: one.since_ns for one in belief.moved}
        found, again = since_ns.keys() - self._moved, self._moved - since_ns.keys()
        if not found and not again:
            return
        self._moved = frozenset(since_ns)
        self.forgotten += 1
        forgotten_ns = {name: since_ns[name] for name in found} | dict.fromkeys(again, 0)
        self._rows = deque(row for row in self._rows if not _came_after(row, forgotten_ns))

    def flown(self) -> Flown | None:
        """Return the messages; None while no drone flies, or before 8 s of flight (20 s if the start was missed)."""
        aloft = {name for name, flies in self._flying.items() if flies}
        least_ns = _LEAST_NS if aloft <= self._stood else _LEAST_ALOFT_NS
        if not aloft or not self._rows or self._rows[-1][0] - self._rows[0][0] < least_ns:
            return None
        # Who stood before the window began, while others flew, may have landed anywhere.
        off_pads = set(self._flying) if self._missed_the_start else self._flew_before
        return Flown(tuple(self._rows), self._clock, frozenset(off_pads))


def _shown_after(message: Message, camera: str, picture_ns: int) -> bool:
    return isinstance(message, RelativeObservation) and message.camera == camera and message.picture_ns > picture_ns


def _came_after(row: _Row, forgotten_ns: Mapping[str, int]) -> bool:
    now_ns, ((_, message),) = row
    return isinstance(message, RelativeObservation) and now_ns > forgotten_ns.get(message.observer, now_ns)
