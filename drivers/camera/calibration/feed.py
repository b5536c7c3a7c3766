"""Pictures of any source, one after the other, for tools that process them at once."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from drivers.camera.source_address import SourceKind, parse_source
from drivers.camera.sources.files import FileReader
from drivers.camera.sources.frames import GREY_AS_EXPOSED, FrameSource, Packet
from drivers.camera.sources.opening import open_source
from drivers.camera.why_silent import why_silent
from groundstation.arrays import Image
from groundstation.bus import clock
from groundstation.errors import DriverError, without_password
from groundstation.time_units import NS_PER_MS, NS_PER_S

_POLL_S = 0.2
PATIENCE_S = 6.0


@dataclass(frozen=True, slots=True)
class SourcePicture:
    """One picture: its name (of a file, else its number), brightness (h, w), when it arrived, and its age then [ms].

    alone: it is a file of its own, which may have nothing to do with the one before.
    """

    name: str
    grey: Image
    at_s: float
    age_ms: float = 0.0
    alone: bool = False

    @property
    def size(self) -> tuple[int, int]:
        """Return width and height [px]."""
        return int(self.grey.shape[1]), int(self.grey.shape[0])


def shots(source: str, size: tuple[int, int] | None = None) -> Iterator[SourcePicture]:
    """Yield pictures: every one of a file or folder, as fast as they are requested; always the newest of a camera.

    size: the picture size requested of a camera of this machine. A camera never ends; raises DriverError when no
    picture comes for 6 s, or when a file holds none.
    """
    cv2.setNumThreads(1)
    try:
        address = parse_source(source)
    except ValueError as error:
        raise DriverError(f"camera source {without_password(source)}: {error}") from None
    if address.kind is SourceKind.FILE:
        yield from _stored(address.path)
        return
    opened = open_source(source, size)
    try:
        yield from _live(opened, without_password(source), PATIENCE_S)
    finally:
        opened.close()


def _stored(path: str) -> Iterator[SourcePicture]:
    reader = FileReader(path)
    count = 0
    try:
        for due_s, name, picture in reader.pictures():
            count += 1
            yield SourcePicture(name, picture.grey(), due_s, alone=reader.is_folder)
    except DriverError as error:
        raise DriverError(f"{path}: {error}") from None
    if not count:
        raise DriverError(f"{path}: there is no picture in it")


def _live(source: FrameSource, name: str, patience_s: float) -> Iterator[SourcePicture]:
    began_ns = last_ns = clock.now_ns()
    broken, refused_then = 0, source.rejected.copy()
    while True:
        packet = source.take_newest(_POLL_S)
        grey = _grey(packet) if packet is not None else None
        now_ns = clock.now_ns()
        if packet is not None and grey is not None:
            last_ns, broken, refused_then = now_ns, 0, source.rejected.copy()
            age_ms = (now_ns - packet.arrival_ns) / NS_PER_MS
            yield SourcePicture(f"{packet.number:05d}", grey, (packet.arrival_ns - began_ns) / NS_PER_S, age_ms)
            last_ns = clock.now_ns()
            continue
        broken += packet is not None
        if (now_ns - last_ns) / NS_PER_S > patience_s:
            refused = source.rejected.copy() - refused_then + Counter(jpeg=broken)
            why = why_silent(refused) if refused or source.connected else source.detail
            raise DriverError(f"{name}: no picture for {patience_s:g} s ({why})")


def _grey(packet: Packet) -> Image | None:
    return packet.picture.grey() if packet.picture is not None else decoded(packet.data)


def decoded(data: bytes) -> Image | None:
    """Return the brightness (h, w) of a picture as it is stored or sent, such as a JPEG; None if it is none."""
    try:
        grey = cv2.imdecode(np.frombuffer(data, np.uint8), GREY_AS_EXPOSED) if data else None
    except cv2.error:  # a picture that claims to be huge
        return None
    return None if grey is None else np.asarray(grey, dtype=np.uint8)
