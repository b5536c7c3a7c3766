"""Unseen targets and robots: searches, missed robots, and events for the operator."""

from collections.abc import Collection, Mapping, Sequence

from groundstation.bus.messages import (
    Message,
    RelativeObservation,
    SearchedPicture,
    Severity,
    TargetSearch,
    VehicleStatus,
)
from groundstation.bus.notice import Notice
from groundstation.control.excursion import Excursions
from groundstation.control.missing_robots import MissingRobots
from groundstation.control.odometry_errors import OdometryErrors
from groundstation.control.parameters import ControlParameters
from groundstation.control.search_parameters import SearchParameters
from groundstation.control.search_state import SearchMode, SearchState
from groundstation.control.stand import Stand
from groundstation.control.target_search import Search
from groundstation.control.unseen_targets import UnseenTargets
from groundstation.control.view import spread_m
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.room_map import RoomMap
from groundstation.sensing.models import SensorSuite
from groundstation.time_units import NS_PER_S

_OBEYS = "TRACK"  # a driver's mode in which setpoints move the drone
_CALL_REMEDY = "check its marker and the light; drive it into the middle of the room; or land the team"
_TOLD_SHARE = 0.01  # smaller parts of the floor that nobody can see are not told
_ROBOT_REMEDY = "check its marker and that camera; land it if it strays"


class Lookout:
    """Use: `take` messages, `see` sightings, `advance` with each belief.

    Read `targets`, `missing`, `missed_s`, `take_notices`.
    """

    def __init__(
        self, search: SearchParameters, control: ControlParameters, sensors: SensorSuite,
        robots: Sequence[str], targets: Sequence[str],
    ) -> None:  # fmt: skip
        self._excursions = Excursions(control, sensors)
        self._search = Search(search, control, sensors, targets, self._excursions)
        self._robots = MissingRobots(sensors, robots)
        self._errors = OdometryErrors()
        self._names = tuple(robots)
        self._hint_std_m = control.hint_std_m
        self._modes: dict[str, str] = {}
        self._braked = set[str]()
        self._unseen = UnseenTargets()
        self._told = dict.fromkeys(targets, SearchMode.SEARCH)
        self._notices: list[Notice] = []

    @property
    def targets(self) -> Mapping[str, SearchState]:
        """Return the state of the search for each target."""
        return self._search.targets

    @property
    def missing(self) -> tuple[str, ...]:
        """Return the targets being searched for."""
        return tuple(name for name in self.targets if self._search.is_missing(name))

    @property
    def missed_s(self) -> Mapping[str, float]:
        """Return how long cameras have missed each robot that they should see [s]."""
        return self._robots.missed_s

    @property
    def unsteered(self) -> tuple[str, ...]:
        """Return the robots that, by their drivers' modes, follow no setpoints: they wait or land."""
        return tuple(name for name in self._names if self._modes.get(name, _OBEYS) != _OBEYS)

    @property
    def unmoved(self) -> frozenset[str]:
        """Return the robots that follow no setpoints, or in TRACK none for as long as a failsafe lets them hover."""
        return frozenset((*self._braked, *self.unsteered))

    @property
    def held(self) -> frozenset[str]:
        """Return the robots that follow no setpoints while others do; none before a flight begins, when all wait."""
        return frozenset(self.unsteered if len(self.unsteered) < len(self._names) else ())

    @property
    def blind(self) -> frozenset[str]:
        """Return the robots that cannot search, because their pictures stay away."""
        return frozenset(self._search.blind)

    @property
    def velocity_errors_m_s(self) -> Mapping[str, float]:
        """Return the expected rms error of each robot's odometry [m/s]."""
        return self._excursions.velocity_errors_m_s

    def take(self, message: Message, counts: bool = True, in_our_time: bool = True) -> None:
        """Take a driver's mode, a sighting as a sign of life, or a fully searched picture.

        counts: it was not refused; one stamped by another clock shows only that its camera works.
        """
        match message:
            case VehicleStatus():
                self._modes[message.header.entity] = message.mode
                (self._braked.add if message.braked else self._braked.discard)(message.header.entity)
            case RelativeObservation() if counts:
                self._search.hear(message.observer)
            case SearchedPicture() if counts and not in_our_time:
                self._search.hear(message.observer)
            case SearchedPicture() if counts:
                self._search.take(message)
                self._robots.take(message)

    def see(self, sighting: RelativeObservation) -> None:
        """Take a sighting, stamped by our clock, that the filter gets too."""
        self._search.see(sighting)

    def advance(
        self,
        belief: JointBelief,
        ages_s: Mapping[str, float],
        rooted_s: Mapping[str, float],
        unlocalised: Collection[str] = (),
    ) -> tuple[str, ...]:
        """Count all pictures; returns the targets whose estimates no longer hold.

        ages_s: time since each airborne robot and each target was last seen; rooted_s: time since a sensor fixed in the
        room last located each airborne robot, directly or through others. Infinite: not in the belief. unlocalised:
        robots that may be elsewhere than estimated.
        """
        self._excursions.unseen_s = {name: age_s for name, age_s in ages_s.items() if name in self._names}
        self._excursions.velocity_errors_m_s = self._errors.advance(belief)
        for name in self._robots.advance(belief, rooted_s):
            text = "is not seen where it is believed, in a fixed camera's view: it turns and looks for the view"
            self._notices.append(Notice(Severity.WARNING, text, _ROBOT_REMEDY, name))
        target_ages_s = {name: age_s for name, age_s in ages_s.items() if name in self.targets}
        gone = self._search.advance(belief, target_ages_s, {*unlocalised, *self.missed_s}, self.unsteered)
        self._tell()
        self._notices += self._unseen.advance(belief, self._unseen_s(belief.stamp_ns, ages_s))
        return gone

    def hopeless(self, belief: JointBelief) -> tuple[str, ...]:
        """Return the missing targets too uncertain for a plan: a scout searches for them while others are tracked."""
        missing = self.missing
        if len(missing) == len(self.targets):
            return ()
        return tuple(n for n in missing if n in belief.layout and spread_m(belief, n) > self._hint_std_m)

    def stands(self, robots: Sequence[str], targets: Collection[str], belief: JointBelief) -> Mapping[str, Stand]:
        """Return the stand from which each robot looks for targets."""
        found = self._search.stands(robots, targets, belief)
        self._tell()
        return found

    def searches(self, now_ns: int) -> tuple[TargetSearch, ...]:
        """Return the state of each search, for display; none while no robot searches."""
        if not self._obeyed:
            return ()
        never_shown = self._search.never_shown
        states = {name: self.targets[name] for name in self.missing}
        return tuple(_message(name, one, now_ns, never_shown) for name, one in states.items() if one.place)

    def maps(self) -> Mapping[str, RoomMap]:
        """Return the probability map of each target that is searched for."""
        rooms = {name: self.targets[name].room for name in self.missing}
        return {name: room for name, room in rooms.items() if room is not None}

    def take_notices(self) -> list[Notice]:
        """Return and clear the events for the operator."""
        notices, self._notices = self._notices, []
        return notices

    @property
    def _obeyed(self) -> bool:
        """Return whether any robot follows the search's setpoints: not while all hold or land."""
        return _OBEYS in self._modes.values()

    def _unseen_s(self, now_ns: int, ages_s: Mapping[str, float]) -> Mapping[str, float]:
        """Return the time since a picture last showed each tracked target [s]."""
        tracked = [name for name in self.targets if not self._search.is_missing(name)] if self._obeyed else []
        return {name: min(ages_s[name], self._search.shown_s(name, now_ns)) for name in tracked}

    def _tell(self) -> None:
        """Add a notice when the search for a target begins, ends or becomes hopeless, once a robot can search."""
        for name, state in self.targets.items():
            if state.mode is self._told[name] or (state.mode is not SearchMode.TRACK and not self._obeyed):
                continue
            if state.mode is SearchMode.SEARCH and state.place is None:
                continue  # not yet known whether a robot is free: the setpoints of this tick decide it
            self._told[name] = state.mode
            if state.mode is SearchMode.LOST:
                floor = _floor(self._search.never_shown)
                text = f"{name} is not found: {state.excluded:.0%} of {floor} was searched"
                self._notices.append(Notice(Severity.ERROR, text, _CALL_REMEDY, name))
            elif state.mode is SearchMode.SEARCH:
                place = self._search.likeliest(name)
                text = f"{name} is not where it was expected: the team searches around ({place[0]:.1f}, {place[1]:.1f})"
                remedy = ""
                if state.expected_s is None:
                    text, remedy = f"{name} is not where it was expected, and no drone is free to search", _CALL_REMEDY
                self._notices.append(Notice(Severity.WARNING, text, remedy, name))
            else:
                self._notices.append(Notice(Severity.INFO, f"{name} is found", "", name))


def _message(name: str, state: SearchState, now_ns: int, never_shown: float) -> TargetSearch:
    since_s = (now_ns - state.since_ns) / NS_PER_S
    x, y = state.place or (0.0, 0.0)
    how_long = "nobody can search now" if state.expected_s is None else f"about {state.expected_s:.0f} s more"
    floor = _floor(never_shown)
    done = f"{state.excluded:.0%} of {floor} done"
    text = f"searched for {since_s:.0f} s, most likely near ({x:.1f}, {y:.1f}); {done}, {how_long}"
    if state.mode is SearchMode.LOST:
        text = f"not found in {since_s:.0f} s, {done}: {_CALL_REMEDY}"
    expected_s = None if state.expected_s is None else round(state.expected_s, 1)
    place = (round(x, 2), round(y, 2))
    mode, searched = str(state.mode), round(state.excluded, 3)
    return TargetSearch(name, mode, round(since_s, 1), place, searched, expected_s, text, floor)


def _floor(never_shown: float) -> str:
    """Return the name of the floor that a search can show; never_shown: share of the rest."""
    all_of_it = never_shown < _TOLD_SHARE
    return "the room" if all_of_it else f"the {1.0 - never_shown:.0%} of the room that the team can see"
