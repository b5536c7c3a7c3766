"""A camera's context from the bus: attitudes and heights of vehicles, and the belief."""

import math
from collections.abc import Collection

from drivers.camera import convert
from drivers.camera.attitudes import AttitudeHistory
from drivers.camera.pose import Gravity
from drivers.camera.prediction import Attitude, Foresight, Predictions
from drivers.camera.settings import CameraDriverSettings, MarkerKind
from groundstation.bus import clock
from groundstation.bus.api import Bus
from groundstation.bus.messages import Estimate, Odometry
from groundstation.bus.topics import ESTIMATE, ODOMETRY
from groundstation.geometry.rotations import rotation_from_euler
from groundstation.time_units import NS_PER_S

_LEVEL = (0.0, 0.0)
# Samples that wait while a picture is searched.
_WAITING = 64
# A picture may be as much older than its usual delay [s].
_LATE_S = 0.5
# Below this measured height a vehicle may be standing.
_ALOFT_M = 0.4


class Surroundings:
    """Subscribes to odometry and estimates, and gives their values at the time of an exposure."""

    def __init__(self, bus: Bus, settings: CameraDriverSettings) -> None:
        self._settings = settings
        markers = settings.expected_markers
        self._markers = {marker.entity: marker for marker in markers}
        robots = {marker.entity for marker in markers if marker.kind is MarkerKind.ROBOT}
        self._targets = set(self._markers) - robots
        if not settings.mount.in_world:
            robots.add(settings.observer)
        # Roll, pitch and height only; all samples, for attitudes at exposures.
        self._odometry = [bus.subscribe([ODOMETRY], entity=name, capacity=_WAITING) for name in sorted(robots)]
        self._estimates = bus.subscribe([ESTIMATE], newest=True)
        self._attitudes = AttitudeHistory(round((settings.video_delay_ms / 1e3 + _LATE_S) * NS_PER_S))
        self._heights: dict[str, float] = {}
        self._foresight = Foresight(settings.mount, settings.observer, markers, settings.calibration.intrinsics())

    def read(self) -> None:
        """Take in messages; those with stamps of other clocks are ignored."""
        now_ns = clock.now_ns()
        for subscription in (*self._odometry, self._estimates):
            for received in subscription.drain():
                message = received.message
                if message is None or message.header.clock != clock.clock_id():
                    continue
                if isinstance(message, Odometry):
                    entity, tilt = message.header.entity, (message.roll_rad, message.pitch_rad)
                    self._attitudes.add(entity, message.header.stamp_ns, *tilt, now_ns)
                    self._keep_height(entity, message.height_m)
                elif isinstance(message, Estimate):
                    self._foresight.add(message)

    def attitude(self, exposure_ns: int) -> Attitude | None:
        """Return the observer's roll and pitch; level for a camera fixed in the world; None when not measured."""
        settings = self._settings
        return _LEVEL if settings.mount.in_world else self._attitudes.at(settings.observer, exposure_ns)

    def tilt_aloft(self, exposure_ns: int) -> Attitude | None:
        """Return roll and pitch of an observer that flies; None for a camera fixed in the world, or if unknown."""
        aloft = self._heights.get(self._settings.observer, 0.0) > _ALOFT_M
        return self.attitude(exposure_ns) if aloft else None

    def gravity(self, entity: str, exposure_ns: int) -> Gravity:
        """Return the known direction of "down" for a subject; targets stand level."""
        observer = self.attitude(exposure_ns)
        subject = _LEVEL if entity in self._targets else self._attitudes.at(entity, exposure_ns)
        rotation = convert.stabilized_from_optical(self._settings.mount, *(observer or _LEVEL))
        return Gravity(rotation, *(subject or _LEVEL), known=observer is not None and subject is not None)

    def predictions(self, exposure_ns: int) -> Predictions:
        """Return where the belief expects the markers."""
        return self._foresight.at(exposure_ns, self.attitude(exposure_ns))

    def sought(self, exposure_ns: int, predictions: Predictions) -> Collection[str]:
        """Return the entities for which whole pictures are searched often; none while the tracker is silent."""
        return self._foresight.sought(exposure_ns, predictions)

    def drop_m(self, entity: str, exposure_ns: int) -> float | None:
        """Return how far a marker is below the camera by height sensors alone [m].

        None if one of them gives no height, or the observer's attitude is unknown.
        """
        marker, mount = self._markers[entity], self._settings.mount
        subject = 0.0 if entity in self._targets else self._heights.get(entity)
        own = 0.0 if mount.in_world else self._heights.get(self._settings.observer)
        tilt = self.attitude(exposure_ns)
        if subject is None or own is None or tilt is None:
            return None
        turn = rotation_from_euler(*tilt, 0.0)
        return float(own + (turn @ mount.position_m)[2]) - subject - marker.position_m[2]

    def _keep_height(self, entity: str, height_m: float | None) -> None:
        if height_m is None or not math.isfinite(height_m):
            self._heights.pop(entity, None)
        else:
            self._heights[entity] = height_m
