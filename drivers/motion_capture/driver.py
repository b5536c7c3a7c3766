"""The motion capture process: frames in; poses, observations and status out."""

from collections import Counter

from pydantic import ValidationError

from drivers.base import HostProcess
from drivers.motion_capture.body_watch import BodyWatch
from drivers.motion_capture.captured_frame import CapturedFrame
from drivers.motion_capture.convert import EntityPose, Placement, body_pose
from drivers.motion_capture.settings import MotionCaptureSection, parse_source
from drivers.motion_capture.sources import Source, open_source
from groundstation.bus import clock
from groundstation.bus.messages import BodyPoses, CameraStatus, Severity
from groundstation.bus.topics import BODY_POSES, CAMERA_STATUS, OBSERVATION
from groundstation.errors import SettingsError
from groundstation.time_units import NS_PER_MS, NS_PER_S

_POLL_S = 0.02
_STATUS_PERIOD_NS = 500_000_000
_CHECK = "check the system's definition of its markers, what hides them, and its names of the bodies"


def run(child: HostProcess) -> int:
    """Serve one system until a stop is requested; returns the exit code."""
    try:
        settings = MotionCaptureSection.model_validate_json(child.section)
    except ValidationError as error:
        problems = [f"motion capture: {'.'.join(map(str, p['loc']))}: {p['msg']}" for p in error.errors()]
        raise SettingsError(problems) from None
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
        self._flowing: bool | None = None
        self._heard_ns = self._status_ns = clock.now_ns()
        self._exposure_ns = self._next_ns = 0
        self._frames = self._frames_then = self._reported = self._skipped = 0
        self.counts: Counter[str] = Counter()

    def turn(self) -> None:
        """Wait shortly for frames, handle them, and keep up heartbeat, status and the watch over silence."""
        for frame in self._source.poll(_POLL_S):
            self._handle(frame)
        now_ns = clock.now_ns()
        if now_ns - self._heard_ns > self._patience_s * NS_PER_S:
            self._announce(flowing=False)
        if now_ns - self._status_ns >= _STATUS_PERIOD_NS:
            self._publish_status(now_ns)
        self._child.beat()
        self._child.tick_status(ticks=self._frames, overruns=self._skipped)

    @property
    def _patience_s(self) -> float:
        """Return how long nothing may come [s]."""
        return self._settings.silent_after_s if self._frames else self._settings.start_within_s

    def _handle(self, frame: CapturedFrame) -> None:
        self._frames += 1
        self._heard_ns = frame.arrival_ns
        self._announce(flowing=True)
        delay_ns = round(self._settings.delay_ms * NS_PER_MS)
        exposure_ns = frame.arrival_ns - frame.processing_ns - delay_ns
        if exposure_ns <= self._exposure_ns:
            self._skipped += 1  # overtaken on the way
            return
        self._exposure_ns = exposure_ns
        poses = self._entity_poses(frame)
        faults = self._watch.look(exposure_ns, {name: pose.position for name, pose in poses.items()})
        self._tell(faults)
        if exposure_ns >= self._next_ns:
            period_ns = round(NS_PER_S / self._settings.rate_hz)
            on_grid = exposure_ns - self._next_ns < period_ns
            self._next_ns = (self._next_ns if on_grid else exposure_ns) + period_ns
            self._publish(exposure_ns, poses, faults)

    def _entity_poses(self, frame: CapturedFrame) -> dict[str, EntityPose]:
        """Return the poses of our entities; what is no pose is counted and left out."""
        poses = {}
        for name, (position, quaternion) in frame.poses.items():
            body = self._bodies.get(name)
            if body is None:
                continue
            pose = self._placement.entity_pose(body, position, quaternion)
            if pose is None:
                self.counts["no pose"] += 1
            else:
                poses[body.entity] = pose
        self.counts["untracked"] += sum(name in self._bodies for name in frame.untracked)
        return poses

    def _in_volume(self, pose: EntityPose) -> bool:
        spans = self._settings.volume_m
        return all(low <= value <= high for value, (low, high) in zip(pose.position, spans, strict=True))

    def _publish(self, exposure_ns: int, poses: dict[str, EntityPose], faults: dict[str, str]) -> None:
        bus, name = self._child.bus, self._settings.name
        bodies = tuple(body_pose(entity, pose) for entity, pose in poses.items())
        refused = {entity: why for entity, why in faults.items() if why}
        bus.publish(BODY_POSES, BodyPoses(header=bus.header(name, exposure_ns), bodies=bodies, refused=refused))
        for entity, pose in poses.items():
            if not self._in_volume(pose):
                self.counts["outside of the volume"] += 1
            elif entity in self._settings.observed and entity not in refused:
                bus.publish(OBSERVATION, self._placement.observation(entity, pose, bus.header(name, exposure_ns)))
                self._reported += 1

    def _tell(self, faults: dict[str, str]) -> None:
        """Report each body whose poses cannot be true, once, and its return."""
        name = self._settings.name
        for entity, why in faults.items():
            kind, before = why.partition(" ")[0], self._faults.get(entity, "").partition(" ")[0]
            if why and kind != before:
                self.counts[kind] += 1
                self._child.event(Severity.WARNING, f"{name}: {entity} {why}", _CHECK, entity)
            elif before and not why:
                self._child.event(Severity.INFO, f"{name}: {entity} is followed again", entity=entity)
            self._faults[entity] = why

    def _announce(self, *, flowing: bool) -> None:
        """Report to lifecycle and operator whether frames come."""
        if flowing is self._flowing:
            return
        self._flowing = flowing
        source, name = self._settings.source, self._settings.name
        if flowing:
            self._child.ready(f"frames from {source}")
            self._child.event(Severity.INFO, f"motion capture {name}: frames arrive", entity=name)
        else:
            self._child.degrade(self._trouble())
            remedy = f"check the system, whether it streams, and its address {source}"
            self._child.event(Severity.WARNING, f"motion capture {name}: {self._trouble()}", remedy, entity=name)

    def _trouble(self) -> str:
        why = f" ({self._source.detail})" if self._source.detail else ""
        return f"no frame for {self._patience_s:g} s{why}"

    def _publish_status(self, now_ns: int) -> None:
        elapsed_s = (now_ns - self._status_ns) / NS_PER_S
        wrong = "; ".join(f"{entity} {why}" for entity, why in self._faults.items() if why)
        status = CameraStatus(
            header=self._child.bus.header(self._settings.name),
            connected=bool(self._flowing),
            fps=(self._frames - self._frames_then) / elapsed_s,
            age_ms=(now_ns - (self._exposure_ns or self._heard_ns)) / NS_PER_MS,
            frames=self._frames,
            skipped=self._skipped,
            detections=self._reported,
            detail=self._trouble() if self._flowing is False else wrong,
            rejected=dict(+(self.counts + self._source.rejected)),
        )
        self._child.bus.publish(CAMERA_STATUS, status)
        self._status_ns, self._frames_then = now_ns, self._frames
