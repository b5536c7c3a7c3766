"""A camera without pictures: geometry in, relative observations with a detector's errors out."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivers.camera.search import HALVE_ABOVE_PX
from groundstation.arrays import Array
from groundstation.bus.messages import Estimate, Header, RelativeObservation, SearchedPicture
from groundstation.geometry.board import Checkerboard
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.rotations import euler_from_rotation, rotation_from_euler, world_from_downward_optical
from groundstation.geometry.tag import SquareTag
from sim_bridge.mounting import (
    as_measured,
    generator_of_eye,
    mounted,
    on_drone,
    told_on_drone,
    true_lens,
    turned_about,
)
from sim_bridge.scenario import CameraScenario
from sim_bridge.site import Lens, Site, SiteCamera, SiteDrone
from sim_bridge.study.attention import Attention, marker_of, mount_of, phase_s
from sim_bridge.world.mavlink_copter import MavlinkCopter
from sim_bridge.world.world import World

_BORDER_PX = 6.0
# Pixels per square that the detector needs (docs/reference/vision.md 8): in a window about the last sighting or the
# belief; in a search of the whole picture of a camera that stands; in that of a large picture, which is halved first;
# and in that of a camera that a searching robot turns.
_WINDOW_PX, _STANDING_PX, _HALVED_PX, _TURNING_PX = 5.5, 5.5, 6.7, 8.5
_FORGET_S = 0.4
_STEEPEST_COS = math.cos(math.radians(72.0))
# The detector estimates the variance of a pixel from the residuals of the pose and adds the square of a floor. On
# rendered pictures (1.2 to 3.1 m, onboard and ceiling, 1200 sightings) its NEES per degree of freedom is 1.1 to 1.2:
# the estimate scatters, as it does here.
_DETECTOR_FLOOR_PX = 0.02
_FREEDOM = 18  # of the residuals of twelve corners about a pose


@dataclass(frozen=True, slots=True)
class Carried:
    """A board on a body: its centre [base], its corners and the outline of its card [marker]."""

    body: str
    board: Checkerboard | SquareTag
    position: Array
    corners: Array
    outline: Array

    @classmethod
    def of(cls, body: str, board: Checkerboard | SquareTag, position_m: tuple[float, float, float]) -> "Carried":
        """Return a board at a place on a body [m; base]."""
        return cls(body, board, np.array(position_m), board.corners(), board.outline())


def _square_m(printed: Checkerboard | SquareTag) -> float:
    """Return the square [m] of a checkerboard with the same range as a marker (tag of 168 mm: 44 mm)."""
    return printed.square_m if isinstance(printed, Checkerboard) else printed.size_mm / 3800.0


def boards_of(site: Site) -> tuple[Carried, ...]:
    """Return all boards of a site: drones' and targets'."""
    drones = [Carried.of(name, drone.marker.printed, drone.marker.position_m) for name, drone in site.drones.items()]
    targets = [
        Carried.of(name, target.marker.printed, (0.0, 0.0, target.marker.height_m))
        for name, target in site.tracked.items()
    ]
    return (*drones, *targets)


def _hidden(world: World, carried: Carried, state: Array, eye: Array) -> bool:
    """Return whether an obstacle hides a marker's centre."""
    centre = state[:3] + carried.position
    return any(box.hides(eye, centre) for box in world.obstacles)


class Eye:
    """One camera. On a drone it observes all boards but its carrier's own, in the world those of its settings.

    outliers: share of sightings with a gross error, besides the scenario's. Mounting and lens are a little off
    the field's figures, unless the scenario says otherwise.
    """

    def __init__(
        self, name: str, lens: Lens, mount: SiteDrone | SiteCamera, site: Site, cameras: CameraScenario,
        outliers: float, rng: np.random.Generator,
    ) -> None:  # fmt: skip
        self.name = name
        self.period_s = 1.0 / cameras.fps
        self.lateness_ms: float | None = None  # a video's delay is the scenario's
        self._carrier = name if isinstance(mount, SiteDrone) else None
        if isinstance(mount, SiteDrone):
            assert mount.camera is not None
            self._rotation, self._position = on_drone(mount.camera, cameras.mounting_errors, rng)
            self._told = told_on_drone(mount.camera)
        else:
            self._rotation, self._position = mounted(mount, cameras.mounting_errors, rng)
            self._told = world_from_downward_optical(mount.rotation_deg)
        self._mounted = self._rotation
        standing_px = _HALVED_PX if lens.intrinsics.width_px > HALVE_ABOVE_PX else _STANDING_PX
        self._search_px = standing_px if self._carrier is None else _TURNING_PX
        self._told_lens, self._lens = lens.intrinsics, true_lens(lens, cameras.mounting_errors, rng)
        observed = ("robots", "targets") if isinstance(mount, SiteDrone) else mount.observes
        bodies = {*(site.drones if "robots" in observed else ()), *(site.tracked if "targets" in observed else ())}
        self._boards = tuple(b for b in boards_of(site) if b.body in bodies - {self._carrier})
        self._scenario, self._outliers, self._rng = cameras, outliers, rng
        self._last_seen = {b.body: -math.inf for b in self._boards}
        self._seq = 0
        markers = [marker_of(b.body, b.board, tuple(b.position.tolist()), site.drones) for b in self._boards]
        self._attention = Attention(mount_of(name, mount), name, markers, self._told_lens, phase_s(name, site))
        self._looked = False

    def take(self, estimate: Estimate) -> None:
        """Take an estimate of the tracker, by which the camera's driver chooses its windows."""
        self._attention.take(estimate)

    @property
    def truth(self) -> tuple[Array, Array, CameraIntrinsics]:
        """Return the true mounting of the camera before any bump (rotation, place [m]), and its true lens."""
        return self._mounted, self._position, self._lens

    def bump(self, angle_deg: float, axis_deg: float) -> None:
        """Turn the camera away from its mounting, unknown to the ground station; 0: back to it."""
        self._rotation = self._mounted @ turned_about(angle_deg, axis_deg) if angle_deg else self._mounted

    @property
    def arrived(self) -> bool:
        """Return whether the last picture reached its driver."""
        return self._looked

    def look(self, world: World, stamp_ns: int, clock: str) -> list[RelativeObservation]:
        """Return the sightings of one exposure; stamps have the error of a delay of which only the mean is known."""
        self._looked = bool(self._rng.random() >= self._scenario.frame_loss)
        if not self._looked:
            return []
        states = dict(zip(world.bodies, world.states(), strict=True))
        rotation, position, reported, told = self._rotation, self._position, (0.0, 0.0), self._told
        if self._carrier is not None:
            own = states[self._carrier]
            base = rotation_from_euler(own[6], own[7], own[8])
            rotation, position = base @ rotation, own[:3] + base @ position
            carrier = world.drones.get(self._carrier)
            onboard = carrier.estimate if isinstance(carrier, MavlinkCopter) else world.onboard[self._carrier]
            reported = (onboard.roll, onboard.pitch)
            told = rotation_from_euler(*reported, 0.0) @ told
        tracked = [name for name, seen_s in self._last_seen.items() if world.time_s - seen_s < _FORGET_S]
        self._attention.begin(stamp_ns, reported, tracked)
        jitter = self._rng.uniform(-1.0, 1.0) * self._scenario.video_jitter_ms
        seen = []
        for carried in self._boards:
            if _hidden(world, carried, states[carried.body], position):
                continue
            sighting = self._sight(carried, states[carried.body], rotation, position, world.time_s)
            if sighting is not None:
                place, unit, facing = sighting
                # As a detector computes it, with the mounting of its settings and the reported attitude.
                yaw = euler_from_rotation(told @ facing)[2]
                stamp = stamp_ns + round(jitter * 1e6)
                seen.append(self._message(carried.body, (place, unit), yaw, stamp, clock, reported))
        self._attention.end([sighting.subject for sighting in seen])
        return seen

    def searched(self, seen: Sequence[RelativeObservation], stamp_ns: int, clock: str) -> SearchedPicture | None:
        """Return the message that the last picture was searched all over; None if only windows were searched."""
        if not (self._looked and self._attention.searching):
            return None
        self._seq += 1
        camera = f"{self.name}_camera"
        header = Header(stamp_ns, clock, self.name, camera, self._seq)
        found = tuple(sighting.subject for sighting in seen)
        return SearchedPicture(header=header, observer=self.name, camera=camera, found=found)

    def _sight(
        self, carried: Carried, state: Array, rotation: Array, position: Array, now_s: float
    ) -> tuple[Array, Array, Array] | None:
        """Return the board's centre [optical], the covariance of (centre, heading) at one pixel, and its rotation.

        The last: optical_from_subject (3, 3). None if it is not seen.
        """
        base = rotation_from_euler(state[6], state[7], state[8])
        centre = rotation.T @ (state[:3] + base @ carried.position - position)
        if centre[2] < 0.2:
            return None
        facing = rotation.T @ base
        normal = facing[:, 2]
        distance_m = float(np.linalg.norm(centre))
        if -float(normal @ centre) < _STEEPEST_COS * distance_m:
            return None
        if self._lens.fx_px * _square_m(carried.board) / distance_m < self._least_px(carried.body, centre, now_s):
            return None
        if not self._is_framed(carried.outline @ facing.T + centre):
            return None
        self._last_seen[carried.body] = now_s
        place = as_measured(centre, self._lens, self._told_lens)
        return place, self._covariance(carried.corners @ facing.T, centre, rotation.T[:, 2]), facing

    def _least_px(self, body: str, centre: Array, now_s: float) -> float:
        """Return the least size [px] of a marker's squares for the detector; infinite where it does not search."""
        if now_s - self._last_seen[body] < _FORGET_S:
            return _WINDOW_PX
        if self._attention.expects(body, self._lens.pixel(*centre.tolist())):
            return _WINDOW_PX
        return self._search_px if self._attention.searching else math.inf

    def _is_framed(self, points: Array) -> bool:
        """Return whether all points (n, 3) [optical] are in the picture, inside its border."""
        right, low = self._lens.width_px - _BORDER_PX, self._lens.height_px - _BORDER_PX
        pixels = (self._lens.pixel(*point) for point in points.tolist())
        return all(at is not None and _BORDER_PX < at[0] < right and _BORDER_PX < at[1] < low for at in pixels)

    def _covariance(self, corners: Array, centre: Array, up: Array) -> Array:
        """Return the covariance (4, 4) of (centre, heading) for corners known to one pixel."""
        (x, y, z), (a, b, c) = (corners + centre).T, corners.T
        along, across, down = self._lens.fx_px / z, -self._lens.fx_px * x / z**2, -self._lens.fx_px * y / z**2
        slopes = np.zeros((2, 6, len(corners)))  # by the centre, and by a turn: d(point) / d(rotation) = -[corner]x
        slopes[0, 0] = slopes[1, 1] = along
        slopes[0, 2], slopes[1, 2] = across, down
        slopes[0, 3], slopes[0, 4], slopes[0, 5] = across * b, along * c - across * a, -along * b
        slopes[1, 3], slopes[1, 4], slopes[1, 5] = down * b - along * c, -down * a, along * a
        J = slopes.transpose(2, 0, 1).reshape(-1, 6)
        full = np.linalg.solve(J.T @ J, np.eye(6))
        T = np.zeros((4, 6))
        T[:3, :3] = np.eye(3)
        T[3, 3:] = up
        return np.asarray(T @ full @ T.T)

    def _message(
        self, subject: str, sighting: tuple[Array, Array], yaw: float, stamp_ns: int, clock: str,
        reported: tuple[float, float],
    ) -> RelativeObservation:  # fmt: skip
        centre, unit = sighting
        noise = self._scenario.corner_noise_px
        error = noise * np.linalg.cholesky(unit) @ self._rng.standard_normal(4)
        if self._rng.random() < self._outliers:
            error = error + self._rng.normal(0.0, (0.5, 0.5, 0.5, 1.0))
        estimated = noise**2 * float(self._rng.chisquare(_FREEDOM)) / _FREEDOM
        covariance = (estimated + _DETECTOR_FLOOR_PX**2) * unit
        self._seq += 1
        return RelativeObservation(
            header=Header(stamp_ns, clock, self.name, f"{self.name}_camera", self._seq),
            observer=self.name,
            subject=subject,
            camera=f"{self.name}_camera",
            position_m=tuple((centre + error[:3]).tolist()),
            yaw_rad=math.remainder(yaw + float(error[3]), math.tau),
            covariance=tuple(covariance.ravel().tolist()),
            margin=2.0,
            roll_rad=reported[0],
            pitch_rad=reported[1],
        )


def eyes_of(site: Site, cameras: CameraScenario, outliers: float, seed: int) -> list[Eye]:
    """Return the eyes of a site: fixed ones first."""
    mounts: list[tuple[str, Lens, SiteDrone | SiteCamera]] = [(n, c.calibration, c) for n, c in site.cameras.items()]
    mounts += [(name, d.camera.calibration, d) for name, d in site.drones.items() if d.camera is not None]
    return [
        Eye(name, lens, mount, site, cameras, outliers, generator_of_eye(seed, name)) for name, lens, mount in mounts
    ]
