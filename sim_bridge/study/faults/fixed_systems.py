"""Sensors fixed in the room other than cameras, and targets' odometry, each on a schedule of its own."""

from collections.abc import Iterator

from drivers.ranging.anchor_watch import AnchorWatch
from groundstation.bus.messages import Message
from groundstation.bus.topics import OBSERVATION, RANGE, REPORTED_MOTION, Topic
from groundstation.time_units import NS_PER_MS
from sim_bridge.scenario import Scenario
from sim_bridge.site import Site
from sim_bridge.study.capture_model import CaptureEye, captures_of
from sim_bridge.study.exposures import Exposures
from sim_bridge.study.odometry_model import OdometryEar, odometry_of
from sim_bridge.study.ranging_model import RangingEye, ranging_of
from sim_bridge.world.world import World


class FixedSystems:
    """Motion capture and ranging systems that the tracker uses, and targets that report their motion.

    They shift neither the cameras' exposures nor each other's: a flight without one of them is otherwise the same.
    """

    def __init__(self, site: Site, world: World, scenario: Scenario, seed: int) -> None:
        errors, faults = scenario.cameras.mounting_errors, scenario.faults
        self._world = world
        self._reports = Exposures[OdometryEar](odometry_of(site, world, errors, seed))
        self._rounds = Exposures[RangingEye](ranging_of(site, errors, seed, faults, lambda: AnchorWatch().sound))
        self._frames = Exposures[CaptureEye](captures_of(site, errors, seed, faults))

    def due(self, now_ns: int, clock: str) -> Iterator[tuple[int, Topic, Message]]:
        """Yield the measurements of this tick: time of arrival [ns], topic and message."""
        for topic, sensors in ((REPORTED_MOTION, self._reports), (RANGE, self._rounds), (OBSERVATION, self._frames)):
            for sensor in sensors.due(self._world.time_s):
                for told in sensor.look(self._world, now_ns, clock):
                    yield now_ns + round(sensor.lateness_ms * NS_PER_MS), topic, told
