"""The motion capture process: frames in; poses, observations and status out."""

from collections import Counter
from dataclasses import replace

from drivers.base import HostProcess, read_section
from drivers.motion_capture.body_watch import BodyWatch
from drivers.motion_capture.captured_frame import CapturedFrame
from drivers.motion_capture.convert import EntityPose, Placement, body_pose
from drivers.motion_capture.settings import MotionCaptureSection, parse_source
from drivers.motion_capture.sources import Source, open_source
from drivers.motion_capture.wire.ros2_pose import UNKNOWN
from drivers.stream_health import StreamHealth, StreamNames
from drivers.thinning import Grid
from groundstation.bus.messages import BodyPoses, Severity
from groundstation.bus.topics import BODY_POSES, OBSERVATION
from groundstation.time_units import NS_PER_MS

_POLL_S = 0.02
_NOBODY = ""  # the turn of frames without a body
_CHECK = (
    "check the system's definition of its markers (each body must look different from each side), what hides them, and "
    "its names of the bodies"
)


def run(child: HostProcess) -> int:
    """Serve one system until a stop is requested; returns the exit code."""
    settings = read_section(MotionCaptureSection, child.section, "motion capture")
    source = open_source(parse_source(settings.source))
    try:
        driver = MotionCaptureDriver(child, settings, source)
        while not child.stop_requested and child.supervisor_alive:
            driver.turn()
    finally:
        source.close()
    return 0


class MotionCaptureDriver:
    """Turns frames of one system into messages; `turn` is one pass of its loop (at most 20 ms of waiting)."""

    def __init__(self, child: HostProcess, settings: MotionCaptureSection, source: Source) -> None:
        self._child, self._settings, self._source = child, settings, source
        self._placement = Placement(settings)
        self._bodies = {body.name: body for body in settings.bodies}
        self._watch = BodyWatch(settings.max_speed_m_s)
        self._faults: dict[str, str] = {}
        # Each body has a grid of its own, as bodies may arrive one by one: otherwise only the first would be published.
        self._grids = {entity: Grid(settings.rate_hz) for entity in (_NOBODY, *(one.entity for one in settings.bodies))}
        self._exposures_ns = dict.fromkeys(self._grids, 0)
        remedy = f"check the system, whether it streams, and its address {settings.source}"
        names = StreamNames("motion capture", settings.name, "frame", settings.source, remedy)
        self._health = StreamHealth(child, names, settings.start_within_s, settings.silent_after_s)
        self._others = ""
        self.counts: Counter[str] = Counter()

    def turn(self) -> None:
        """Wait briefly for frames, process them, and keep up heartbeat, status and the watch over silence."""
        for frame in self._source.poll(_POLL_S):
            self._handle(frame)
        wrong = "; ".join(f"{entity} {why}" for entity, why in self._faults.items() if why)
        self._health.end_turn(self._source.detail or self._others, wrong, self.counts + self._source.rejected.copy())

    def _handle(self, frame: CapturedFrame) -> None:
        delay_ns = round(self._settings.delay_ms * NS_PER_MS)
        exposure_ns = frame.arrival_ns - frame.processing_ns - delay_ns
        came = self._entity_poses(frame, exposure_ns)
        if not came and not frame.whole:
            self._others = f"only other bodies come, such as {min(frame.poses)}" if frame.poses else ""
            return
        self._others = ""
        self._health.came(frame.arrival_ns)
        poses = {entity: pose for entity, pose in came.items() if pose.exposure_ns > self._exposures_ns[entity]}
        if len(poses) < len(came):
            self._health.skipped += 1  # overtaken by newer poses of the same body on the way
            if not poses:
                return
        stamps_ns = {entity: pose.exposure_ns for entity, pose in poses.items()} or {_NOBODY: exposure_ns}
        self._exposures_ns |= stamps_ns
        newest_ns = max(stamps_ns.values())
        self._health.used(newest_ns)
        faults = self._watch.look(newest_ns, poses)
        self._tell(faults)
        due_ns = {entity: at_ns for entity, at_ns in stamps_ns.items() if self._grids[entity].is_due(at_ns)}
        for at_ns in sorted(set(due_ns.values())):
            self._publish(at_ns, {one: pose for one, pose in poses.items() if due_ns.get(one) == at_ns}, faults)

    def _entity_poses(self, frame: CapturedFrame, exposure_ns: int) -> dict[str, EntityPose]:
        """Return the poses of our entities; invalid poses are counted and left out; exposure_ns: of the frame."""
        poses = {}
        for name, (position, quaternion) in frame.poses.items():
            body = self._bodies.get(name)
            if body is None:
                continue
            told = frame.deviations.get(name, UNKNOWN)
            pose = self._placement.entity_pose(body, position, quaternion, told)
            if pose is None:
                self.counts["no pose"] += 1
            else:
                poses[body.entity] = replace(pose, exposure_ns=exposure_ns - frame.behind_ns.get(name, 0))
        self.counts["untracked"] += sum(name in self._bodies for name in frame.untracked)
        return poses

    def _in_volume(self, pose: EntityPose) -> bool:
        spans = self._settings.volume_m
        return all(low <= value <= high for value, (low, high) in zip(pose.position, spans, strict=True))

    def _publish(self, exposure_ns: int, poses: dict[str, EntityPose], faults: dict[str, str]) -> None:
        bus, name = self._child.bus, self._settings.name
        bodies = tuple(body_pose(entity, pose) for entity, pose in poses.items())
        refused = {entity: faults[entity] for entity in poses if faults[entity]}
        bus.publish(BODY_POSES, BodyPoses(header=bus.header(name, exposure_ns), bodies=bodies, refused=refused))
        for entity, pose in poses.items():
            if not self._in_volume(pose):
                self.counts["outside of the volume"] += 1
            elif entity in self._settings.observed and entity not in refused:
                bus.publish(OBSERVATION, self._placement.observation(entity, pose, bus.header(name, exposure_ns)))
                self._health.reported += 1

    def _tell(self, faults: dict[str, str]) -> None:
        """Report each body whose poses cannot be true, once, and its return or that it is out of sight."""
        name = self._settings.name
        for gone in sorted(self._faults.keys() - self._watch.names):
            if self._faults.pop(gone):
                self._child.event(Severity.INFO, f"{name}: {gone} is out of sight, and judged anew", entity=gone)
        for entity, why in faults.items():
            kind, before = why.partition(" ")[0], self._faults.get(entity, "").partition(" ")[0]
            if why and kind != before:
                self.counts[kind] += 1
                self._child.event(Severity.WARNING, f"{name}: {entity} {why}", _CHECK, entity)
            elif before and not why:
                self._child.event(Severity.INFO, f"{name}: {entity} is followed again", entity=entity)
            self._faults[entity] = why
