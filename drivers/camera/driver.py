"""The camera process: newest picture in; observations, status and a few pictures out."""

import logging
from collections import Counter

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.base import HostProcess, read_section
from drivers.camera import convert
from drivers.camera.clear_pictures import ClearPictures
from drivers.camera.context import Surroundings
from drivers.camera.picture_quality import quality_of
from drivers.camera.pipeline import Pipeline
from drivers.camera.settings import CameraDriverSettings
from drivers.camera.sighting import Sighting
from drivers.camera.sources.frames import GREY_AS_EXPOSED, FrameSource, Packet, Unit
from drivers.camera.sources.opening import open_source
from drivers.camera.unchanged import SteadyMarkers, UnchangedPictures
from drivers.camera.why_silent import why_silent
from drivers.stream_health import StreamHealth, StreamNames
from drivers.thinning import Grid
from groundstation.arrays import Image
from groundstation.bus.jpeg import whole_size
from groundstation.bus.messages import SearchedPicture
from groundstation.bus.topics import IMAGE, OBSERVATION, SEARCHED_PICTURE, VIDEO
from groundstation.errors import without_password
from groundstation.time_units import NS_PER_MS, NS_PER_S

_log = logging.getLogger(__name__)
# Most pictures come sooner, and then nothing else wakes it.
_POLL_S = 0.08
# A picture that shows nothing new for so long is reported to hang [s].
_HANGS_S = 3.0


def run(child: HostProcess) -> int:
    """Serve one camera until a stop is requested; returns the exit code."""
    settings = read_section(CameraDriverSettings, child.section, "camera")
    cv2.setNumThreads(1)
    lens = settings.calibration
    source = open_source(settings.source, (lens.width_px, lens.height_px))
    try:
        driver = CameraDriver(child, settings, source)
        while not child.stop_requested and child.supervisor_alive:
            driver.turn()
        driver.tell_counts()
    finally:
        source.close()
    return 0


class CameraDriver:
    """Turns pictures of one source into messages; `turn` is one pass of its loop (at most 80 ms of waiting).

    `counts` holds the refusals, by reason.
    """

    def __init__(self, child: HostProcess, settings: CameraDriverSettings, source: FrameSource) -> None:
        self._child, self._settings, self._source = child, settings, source
        self._intrinsics = settings.calibration.intrinsics()
        self._delay_ns = round(settings.video_delay_ms * NS_PER_MS)
        self._pipeline = Pipeline(
            self._intrinsics,
            settings.expected_markers,
            settings.detector,
            settings.search_rate_hz,
            settings.search_phase_s,
            others=settings.markers,
        )
        self._surroundings = Surroundings(child.bus, settings)
        self._newest: Image | None = None
        self._unchanged, self._steady = UnchangedPictures(), SteadyMarkers(self._intrinsics.fx_px)
        self._hangs_s = 0.0
        self._clear = ClearPictures(stands=settings.mount.in_world)
        self._images = Grid(settings.image_fps)
        address = without_password(settings.source)
        remedy = f"check the camera and its address {address}"
        size = "set the camera to the calibrated size, or calibrate it at this one"
        names = StreamNames("camera", settings.name, "picture", address, remedy, size)
        self._health = StreamHealth(child, names, settings.start_within_s, settings.stall_after_s)
        self.counts: Counter[str] = Counter()
        self._refused_then: Counter[str] = Counter()

    def tell_counts(self) -> None:
        """Log the counts of all pictures and boards."""
        counts = {"pictures": self._health.pieces, "skipped": self._skipped, **self.counts, **self._pipeline.counts}
        _log.info("%s", ", ".join(f"{name} {count}" for name, count in counts.items()))

    def turn(self) -> None:
        """Wait briefly for a picture, process it, and keep up heartbeat, status and stream watch."""
        packet = self._source.take_newest(_POLL_S)
        self._publish_video()
        self._surroundings.read()
        if packet is not None:
            self._handle(packet)
        self._health.skipped = self._skipped
        refused = self.counts + self._source.rejected.copy()
        why = why_silent(refused - self._refused_then) if self._source.connected else self._source.detail
        self._health.end_turn(why, self._hanging(), refused, self._quality)

    @property
    def _skipped(self) -> int:
        return max(0, self._source.received - self._health.pieces - sum(self.counts.values()))

    def _handle(self, packet: Packet) -> None:
        exposure_ns = self._exposed(packet)
        picture = self._decoded(packet)
        if picture is None:
            return
        self._health.flows(packet.arrival_ns)
        self._refused_then = self.counts + self._source.rejected.copy()
        self._health.used(exposure_ns)
        self._newest = picture
        self._publish_image(packet, exposure_ns)
        try:
            self._observe(picture, exposure_ns)
        except (cv2.error, np.linalg.LinAlgError, ValueError) as error:
            self.counts["detector"] += 1
            _log.warning("picture %d cannot be measured: %s", packet.number, error)
            return
        self._health.pieces += 1

    def _exposed(self, taken: Packet | Unit) -> int:
        """Return a picture's exposure time [ns]: its (usual) arrival less the calibrated delay."""
        return min(taken.settled_ns - self._delay_ns, taken.arrival_ns)

    def _decoded(self, packet: Packet) -> Image | None:
        """Return the grey picture, or None when it is damaged or not of the calibrated size."""
        if packet.picture is not None:
            picture = packet.picture.grey()
            return picture if self._has_size(picture.shape[1], picture.shape[0], packet) else None
        size = whole_size(packet.data)
        if size is not None and not self._has_size(*size, packet):
            return None
        decoded = cv2.imdecode(np.frombuffer(packet.data, np.uint8), GREY_AS_EXPOSED) if size else None
        if decoded is None:
            self.counts["jpeg"] += 1
            return None
        return np.asarray(decoded, dtype=np.uint8)

    def _has_size(self, width: int, height: int, packet: Packet) -> bool:
        """Return whether a picture has the calibrated size; another size is refused by name."""
        wanted = self._intrinsics
        if (width, height) == (wanted.width_px, wanted.height_px):
            return True
        self.counts["size"] += 1
        reason = f"its pictures are {width}x{height}, its calibration is for {wanted.width_px}x{wanted.height_px}"
        self._health.refuse(reason, packet.arrival_ns)
        return False

    def _observe(self, picture: NDArray[np.uint8], exposure_ns: int) -> None:
        settings, around = self._settings, self._surroundings
        attitude = around.attitude(exposure_ns)
        predictions = around.predictions(exposure_ns)
        sightings = self._pipeline.process(
            picture,
            exposure_ns,
            lambda entity: around.gravity(entity, exposure_ns),
            predictions,
            lambda entity: None if self._hangs_s else around.drop_m(entity, exposure_ns),
            around.sought(exposure_ns, predictions),
        )
        picture_ns = self._first_shown_ns(picture, exposure_ns, sightings)
        for sighting in sightings:
            later_ns = convert.row_ns(sighting.corners, self._intrinsics.height_px, settings.readout_ms)
            header = self._child.bus.header(settings.observer, exposure_ns + later_ns)
            observation = convert.observation_from_sighting(
                sighting, header, settings.name, settings.mount, attitude, picture_ns
            )
            self._child.bus.publish(OBSERVATION, observation)
            self._health.reported += 1
        if self._pipeline.searched and picture_ns == exposure_ns:  # old pictures do not show who is missing now
            self._tell_searched(picture, exposure_ns, tuple(sighting.entity for sighting in sightings))
        for notice in self._pipeline.take_notices():
            self._child.event(notice.severity, f"camera {settings.name}: {notice.text}", notice.remedy, notice.entity)

    def _tell_searched(self, picture: Image, exposure_ns: int, found: tuple[str, ...]) -> None:
        """Publish that a picture was searched, unless it could not show anybody."""
        unmeasured = self._pipeline.unmeasured
        if not self._clear.is_clear(picture, shows_marker=bool(found or unmeasured)):
            self._pipeline.counts["unclear"] += 1
            return
        observer = self._settings.observer
        header = self._child.bus.header(observer, exposure_ns)
        searched = SearchedPicture(
            header=header, observer=observer, camera=self._settings.name, found=found, unmeasured=unmeasured
        )
        self._child.bus.publish(SEARCHED_PICTURE, searched)

    def _publish_image(self, packet: Packet, exposure_ns: int) -> None:
        """Pass a JPEG on, at most `image_fps` times a second: as received, or encoded from the decoded picture."""
        if not self._images.is_due(exposure_ns):
            return
        data = packet.data or (packet.picture.jpeg() if packet.picture is not None else b"")
        self._child.bus.publish_bytes(IMAGE, self._child.bus.header(self._settings.name, exposure_ns), data)

    def _publish_video(self) -> None:
        """Pass all H.264 on as received, for the recording: each picture needs those before it."""
        for unit in self._source.take_video():
            if self._settings.image_fps > 0.0:
                header = self._child.bus.header(self._settings.name, self._exposed(unit))
                self._child.bus.publish_bytes(VIDEO, header, unit.data)

    def _first_shown_ns(self, picture: Image, exposure_ns: int, sightings: list[Sighting]) -> int:
        """Return the exposure of a picture, or of the last one that showed anything new [ns]."""
        corners = {sighting.entity: sighting.corners for sighting in sightings}
        first_ns = min(
            self._unchanged.since_ns(picture, exposure_ns),
            self._steady.since_ns(exposure_ns, corners, self._surroundings.tilt_aloft(exposure_ns)),
        )
        self._hangs_s = (exposure_ns - first_ns) / NS_PER_S
        return first_ns

    def _hanging(self) -> str:
        """Return a text if the picture hangs, else ""; that of a standing vehicle may be black for long."""
        shows = self._settings.mount.in_world or self._pipeline.tracked
        hangs = self._hangs_s >= _HANGS_S and shows
        return "its picture does not change: it hangs, or nothing moves and it has no noise" if hangs else ""

    def _quality(self) -> tuple[float | None, float | None]:
        """Return brightness and width of edges [px] of the newest picture."""
        if self._newest is None:
            return None, None
        quality = quality_of(self._newest)
        return round(quality.brightness, 3), None if quality.edge_px is None else round(quality.edge_px, 1)
