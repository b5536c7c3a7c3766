"""The search for unseen targets: probability maps of their places replace the Gaussians, and robots get stands."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from groundstation.arrays import Array
from groundstation.bus.messages import RelativeObservation, SearchedPicture
from groundstation.control.coverage import choose_stands, robots_in_order
from groundstation.control.excursion import Excursions
from groundstation.control.parameters import ControlParameters
from groundstation.control.pursuit import choose_pursuit
from groundstation.control.search_parameters import SearchParameters
from groundstation.control.search_ranges import searching_cameras
from groundstation.control.search_reach import extra_ways_m, permitted, shown_by_fixed, shown_from
from groundstation.control.search_state import SearchMode, SearchState
from groundstation.control.search_team import SearchTeam
from groundstation.control.stand import Stand
from groundstation.control.sweeps import NO_OUTLOOK, Outlook, lattice_of
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.belief_history import KEPT_NS, BeliefHistory
from groundstation.estimation.room_map import RoomGrid, RoomMap, lost_at, unknown_place
from groundstation.sensing.detection import detection_map
from groundstation.sensing.footprint import footprint_of
from groundstation.sensing.models import SensorSuite
from groundstation.sensing.occlusion import box_rows, outside_boxes, sight_map
from groundstation.sensing.visibility import camera_rows
from groundstation.time_units import NS_PER_MS, NS_PER_S

_STEP_NS, _MOST_STEPS = 100 * NS_PER_MS, 20  # of the maps' motion, and how many at once after a pause
_SLOW_SEARCH_S = 999.0
_AT_ONCE_NS = 100 * NS_PER_MS  # largest difference of two last sightings that count as simultaneous
_TWO_SIDES_COS = math.cos(math.radians(30.0))
_TIPPED_M = 0.08  # error of a picture at the distance of a target, by the error of the robot's tilt


class Search:
    """Probability maps of unseen targets, updated by pictures without them, and the stands of the searching robots.

    Call `see` with sightings, `take` with searched pictures, `advance` with each belief; read `targets`, ask for
    `stands`.
    """

    def __init__(
        self, parameters: SearchParameters, control: ControlParameters, sensors: SensorSuite, targets: Sequence[str],
        excursions: Excursions,
    ) -> None:  # fmt: skip
        self.parameters = parameters
        self.grid = RoomGrid.over(*parameters.room_m)
        self.targets: dict[str, SearchState] = {name: SearchState(SearchMode.SEARCH, 0) for name in targets}
        self._lost_after_s, self._sensors, self._excursions = control.lost_after_s, sensors, excursions
        observers = [name for name in parameters.observers if name in sensors.onboard or name in sensors.world]
        onboard = searching_cameras(sensors.onboard, parameters.ranges_m)
        self._cameras = {
            name: camera_rows([onboard.get(name) or sensors.world[name]], sensors.softness) for name in observers
        }
        marker_m = max((sensors.marker_height_m[name] for name in targets), default=0.0)
        self._footprints = {
            name: footprint_of(camera, self.grid.cell_m, control.search_height_m, marker_m, sensors.softness)
            for name, camera in onboard.items()
            if name in parameters.observers
        }
        self._boxes = box_rows(sensors.obstacles)
        # What is in a box is never seen: looking there would be in vain, and never end.
        self._floor = outside_boxes(self._boxes, self.grid.xs, self.grid.ys, marker_m)
        self._lattice = lattice_of(self.grid, parameters)
        places, there_and_back_s_m = self._lattice.places, 1.0 / parameters.speed_m_s + 1.0 / control.return_speed_m_s
        extra_m = {name: extra_ways_m(name, places, control, sensors) for name in self._footprints}
        self._extra_s = {name: there_and_back_s_m * way_m for name, way_m in extra_m.items()}
        free = {name: permitted(name, places, way_m, parameters, control, sensors) for name, way_m in extra_m.items()}
        fixed = [rows[0] for name, rows in self._cameras.items() if name in sensors.world]
        self._team = SearchTeam(
            self._floor,
            shown_by_fixed(self.grid, fixed, marker_m),
            {name: shown_from(self.grid, self._lattice, free[name], one) for name, one in self._footprints.items()},
        )
        self._heard = set[str]()
        self._pictures: list[SearchedPicture] = []
        self._history = BeliefHistory()
        self._moved_ns = 0
        self._shown_ns: dict[str, dict[str, int]] = {name: {} for name in targets}
        self._outlook = NO_OUTLOOK
        self._planned: tuple[int, tuple[str, ...], tuple[str, ...]] = (0, (), ())

    @property
    def never_shown(self) -> float:
        """Return the share of the floor that no robot may fly near enough to, and no fixed camera shows."""
        return 1.0 - float(self._team.shown.sum()) / max(1, int(self._floor.sum()))

    @property
    def blind(self) -> Collection[str]:
        """Return the robots that cannot search, because their pictures stay away."""
        return self._team.blind

    def hear(self, observer: str) -> None:
        """Take a sign of life of a camera."""
        self._heard.add(observer)

    def take(self, picture: SearchedPicture) -> None:
        """Take a picture that was searched; it counts with the next `advance`."""
        self.hear(picture.observer)
        if picture.observer in self._cameras:
            self._pictures.append(picture)

    def see(self, sighting: RelativeObservation) -> None:
        """Take a sighting; it counts even if the filter refuses it, because a camera shows the target there."""
        name = sighting.subject
        if sighting.observer in self._cameras and name in self.targets:
            shown_ns, observer = self._shown_ns[name], sighting.observer
            shown_ns[observer] = max(sighting.header.stamp_ns, shown_ns.get(observer, 0))

    def is_missing(self, name: str) -> bool:
        """Return whether a target is searched for."""
        return self.targets[name].mode is not SearchMode.TRACK

    def likeliest(self, name: str) -> tuple[float, float]:
        """Return the likeliest place of a target that is searched for [m; world]."""
        room = self.targets[name].room
        return (0.0, 0.0) if room is None else room.likeliest(self._floor)

    def shown_s(self, name: str, now_ns: int) -> float:
        """Return the time since a picture last showed a target [s]; infinite if none ever did."""
        stamp_ns = max(self._shown_ns[name].values(), default=None)
        return math.inf if stamp_ns is None else (now_ns - stamp_ns) / NS_PER_S

    def advance(
        self,
        belief: JointBelief,
        ages_s: Mapping[str, float],
        misplaced: Collection[str] = (),
        unsteered: Collection[str] = (),
    ) -> tuple[str, ...]:
        """Update the maps to a belief's time; returns the targets whose estimates no longer hold.

        ages_s: time since each target was last seen (infinite: not in the belief); misplaced: robots that may be
        elsewhere than estimated, so that nobody knows what their pictures show; unsteered: those that do not obey.
        """
        self._history.append(belief)
        now_ns = belief.stamp_ns
        dropped = []
        for name, age_s in ages_s.items():
            before = self.targets[name]
            after = self._begun(name, before, belief, age_s)
            if after.given_up and not before.given_up and name in belief.layout:
                dropped.append(name)
            self.targets[name] = after
        self._move(belief)
        pictures, self._pictures = self._pictures, []
        for picture in pictures:
            if picture.observer not in misplaced and picture.header.stamp_ns > now_ns - KEPT_NS:
                self._look(picture)
        self._team.advance(belief, self._heard.difference(misplaced), unsteered)
        self._heard.clear()
        return tuple(dropped)

    def stands(self, robots: Sequence[str], targets: Collection[str], belief: JointBelief) -> Mapping[str, Stand]:
        """Return the robots' stands for the search, none within `column_m` of another; some robots may have none."""
        wanted = tuple(name for name in sorted(targets) if name in self.targets and self.targets[name].room is not None)
        able = tuple(name for name in robots if name in self._footprints and name not in self.blind)
        planned_ns, of_robots, of_targets = self._planned
        recent = belief.stamp_ns - planned_ns < self.parameters.plan_period_s * NS_PER_S
        if not (recent and (able, wanted) == (of_robots, of_targets)):
            self._planned = belief.stamp_ns, able, wanted
            self._outlook = self._choose(able, wanted, belief)
            self._judge(belief.stamp_ns)
        return self._outlook.stands

    def _choose(self, robots: Sequence[str], targets: Sequence[str], belief: JointBelief) -> Outlook:
        rooms = [room for name in targets if (room := self.targets[name].room) is not None]
        if not rooms or not robots:
            return NO_OUTLOOK
        chances: Array = self._floor * np.sum([room.in_view for room in rooms], axis=0) / len(rooms)
        poses = {name: belief.mean_of(name)[:4] for name in robots}
        order = robots_in_order(robots, chances, poses, self.grid)
        footprints = {name: self._footprints[name] for name in order}
        allowed_s = {name: self._allowed_s(name, belief) for name in robots}
        held, parameters = self._outlook.sweeps, self.parameters
        choose = choose_stands
        if all(self.targets[name].near for name in targets):
            choose, parameters = choose_pursuit, replace(parameters, yaw_rate_rad_s=parameters.near_yaw_rate_rad_s)
        return choose(chances, self._lattice, footprints, poses, allowed_s, held, parameters)

    def _allowed_s(self, name: str, belief: JointBelief) -> Array:
        """Return the latest time [s] to be at each stand; negative: never."""
        allowed_s, extra_s = self._excursions.allowed_s(name, belief, self._lattice.places), self._extra_s[name]
        return np.asarray(np.subtract(allowed_s, extra_s, out=np.full(len(extra_s), -1.0), where=np.isfinite(extra_s)))

    def _begun(self, name: str, state: SearchState, belief: JointBelief, age_s: float) -> SearchState:
        p, now_ns = self.parameters, belief.stamp_ns
        # A picture that shows it elsewhere than predicted is for the filter to judge, no reason to search.
        shown = self.shown_s(name, now_ns) <= p.begin_after_s and name in belief.layout
        if age_s <= p.begin_after_s or shown:
            return (
                state
                if state.mode is SearchMode.TRACK and state.room is None
                else SearchState(SearchMode.TRACK, now_ns)
            )
        if name not in belief.layout:
            if not belief.layout.robots or (state.room is not None and state.given_up):
                return state
            return SearchState(SearchMode.SEARCH, now_ns, self._anywhere(belief), given_up=True)
        mean, covariance = belief.mean_of(name)[:2], belief.covariance_of(name)[:2, :2]
        room = state.room
        if room is None:
            room = lost_at(self.grid, mean, covariance, at_once=self._lost_at_once(name, mean))
            state = replace(state, predicted=_place_and_variance(belief, name))
        state = replace(state, room=room, near=True)
        if state.given_up:
            return state
        if room.mass_near(mean, covariance, 2.0, 0.5) < p.given_up_below:
            since_ns = state.since_ns if state.mode is SearchMode.SEARCH else now_ns
            return replace(state, mode=SearchMode.SEARCH, since_ns=since_ns, given_up=True)
        if age_s > self._lost_after_s and state.mode is SearchMode.TRACK:
            return replace(state, mode=SearchMode.SEARCH, since_ns=now_ns)
        return state

    def _lost_at_once(self, name: str, place: Array) -> bool:
        """Return whether cameras on two sides of a place (2) [m; world] last saw a target there in the same moment."""
        shown_ns = self._shown_ns[name]
        last_ns = max(shown_ns.values(), default=0)
        poses = {eye: self._pose_at(eye, ns)[0] for eye, ns in shown_ns.items() if last_ns - ns <= _AT_ONCE_NS}
        at = np.append(place, self._sensors.marker_height_m[name])
        lines = [self._sensors.eye(eye, pose) - at for eye, pose in poses.items() if pose is not None]
        return any(a @ b < _TWO_SIDES_COS * np.linalg.norm(a) * np.linalg.norm(b) for a, b in combinations(lines, 2))

    def _anywhere(self, belief: JointBelief) -> RoomMap:
        """Return the map of a target that was never seen: likeliest ahead of the team."""
        ahead_m = self.parameters.starts_ahead_m
        poses = (belief.mean_of(name) for name in belief.layout.robots)
        places = [(float(p[0] + ahead_m * np.cos(p[3])), float(p[1] + ahead_m * np.sin(p[3]))) for p in poses]
        return unknown_place(self.grid, places)

    def _move(self, belief: JointBelief) -> None:
        """Let the targets of the maps drive on, in whole steps; what is left of the time counts with the next."""
        self._moved_ns = self._moved_ns or belief.stamp_ns
        due, rest_ns = divmod(belief.stamp_ns - self._moved_ns, _STEP_NS)
        if due < 1:
            return
        self._moved_ns = belief.stamp_ns - rest_ns
        p = self.parameters
        variance = p.target_speed_m_s**2 * p.target_straight_s * _STEP_NS / NS_PER_S
        for name in self.targets:
            state = self._predicted(name, belief)
            room = state.room
            for _ in range(min(due, _MOST_STEPS)):
                room = room and room.moved(variance).uncovered(_STEP_NS / NS_PER_S)
            self.targets[name] = replace(state, room=room)

    def _predicted(self, name: str, belief: JointBelief) -> SearchState:
        """Return the state whose map has followed the prediction of its target, by whole cells."""
        state = self.targets[name]
        if state.room is None:
            return state
        if state.given_up or name not in belief.layout:
            return replace(state, room=state.room.given_up())
        cell_m, (x, y, before) = self.grid.cell_m, state.predicted
        at_x, at_y, variance = _place_and_variance(belief, name)
        columns, rows = round((at_x - x) / cell_m), round((at_y - y) / cell_m)
        predicted = (x + columns * cell_m, y + rows * cell_m, variance)
        return replace(
            state, room=state.room.predicted(rows, columns, max(0.0, variance - before)), predicted=predicted
        )

    def _look(self, picture: SearchedPicture) -> None:
        """Count a picture against all targets that it cannot show, and that were not seen since."""
        stamp_ns = picture.header.stamp_ns
        pose, slack_m = self._pose_at(picture.observer, stamp_ns)
        searched = (name for name, state in self.targets.items() if state.room is not None)
        unseen = (name for name in searched if stamp_ns > max(self._shown_ns[name].values(), default=-1))
        missing = [name for name in unseen if not picture.may_show(name)]
        if pose is None or not missing:
            return
        for name in missing:
            state = self.targets[name]
            assert state.room is not None
            camera, height_m = self._cameras[picture.observer][0], self._sensors.marker_height_m[name]
            chance = detection_map(camera, pose, slack_m, self.grid.xs, self.grid.ys, height_m)
            if len(self._boxes):
                eye = self._sensors.eye(picture.observer, pose)
                chance = chance * sight_map(self._boxes, eye, self.grid.xs, self.grid.ys, height_m)
            self.targets[name] = replace(state, room=state.room.emptied(chance))

    def _pose_at(self, observer: str, stamp_ns: int) -> tuple[Array | None, float]:
        """Return the pose of a camera's carrier and its standard deviation; None if unknown."""
        if observer in self._sensors.world:
            return np.zeros(4), 0.0
        belief = self._history.at(stamp_ns)
        if belief is None or observer not in belief.layout:
            return None, 0.0
        variance = float(np.diag(belief.covariance_of(observer))[:2].max())
        return np.array(belief.mean_of(observer)[:4]), variance**0.5 + _TIPPED_M

    def _judge(self, now_ns: int) -> None:
        """Update the mode of each search, and find those that have become hopeless."""
        p, outlook = self.parameters, self._outlook
        expected_s = min(_SLOW_SEARCH_S, (outlook.after_s + p.look_s) / outlook.chance) if outlook.chance > 0 else None
        for name, state in self.targets.items():
            if state.room is None or state.mode is SearchMode.TRACK:
                continue
            excluded = state.room.excluded(self._team.shown)
            lasted_s = (now_ns - state.since_ns) / NS_PER_S
            lost = state.mode is SearchMode.LOST or (lasted_s > p.lost_after_s and excluded > p.lost_excluded)
            self.targets[name] = replace(
                state,
                mode=SearchMode.LOST if lost else SearchMode.SEARCH,
                place=state.room.likeliest(self._floor),
                excluded=excluded,
                expected_s=expected_s,
            )


def _place_and_variance(belief: JointBelief, name: str) -> tuple[float, float, float]:
    """Return an entity's estimated place [x, y in m], and the mean variance of both axes [m^2]."""
    mean, variances = belief.mean_of(name), np.diag(belief.covariance_of(name))[:2]
    return float(mean[0]), float(mean[1]), float(variances.mean())
