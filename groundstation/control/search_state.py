"""The state of the search for one target."""

from dataclasses import dataclass
from enum import StrEnum

from groundstation.estimation.room_map import RoomMap


class SearchMode(StrEnum):
    """State of the search for one target."""

    TRACK = "TRACK"  # it is seen, or was a moment ago
    SEARCH = "SEARCH"  # the team searches for it
    LOST = "LOST"  # the team has searched nearly everywhere: the operator is asked


@dataclass(frozen=True, slots=True)
class SearchState:
    """The state of the search for one target.

    since_ns: since when the mode holds; place: its most likely place [m; world]; excluded: share of the floor where it
    is not, of that which can be shown; expected_s: approximate time to find it; near: it was tracked when it got out of
    sight; predicted: to where the map has followed its prediction [x, y in m] and that one's variance (mean of both
    axes) [m^2].
    """

    mode: SearchMode
    since_ns: int
    room: RoomMap | None = None
    place: tuple[float, float] | None = None
    excluded: float = 0.0
    expected_s: float | None = None
    given_up: bool = False
    near: bool = False
    predicted: tuple[float, float, float] = (0.0, 0.0, 0.0)
