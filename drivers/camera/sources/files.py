"""Pictures from the disk at the pace of a camera: a video file, or a folder of pictures."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import av
import cv2
import numpy as np

from drivers.camera.sources.frames import Matrix, Picture, Unit
from drivers.camera.sources.h264 import VideoPicture
from drivers.camera.sources.raw import Decoded
from drivers.camera.sources.reader_thread import Drain, EndOfStreamError, PictureDecoder
from groundstation.bus import clock
from groundstation.errors import DriverError
from groundstation.time_units import NS_PER_S

_FOLDER_FPS = 5.0
_SUFFIXES = frozenset({".jpg", ".jpeg", ".png", ".bmp", ".tif", ".tiff", ".pgm", ".webp"})


class FileReader:
    """Plays a video file at its own frame rate, or the pictures of a folder by name at 5 a second; once."""

    def __init__(self, path: str) -> None:
        self._path = Path(path)
        self.name = self._path.name
        self.rejected: Counter[str] = Counter()
        self.decoder: PictureDecoder | None = Decoded()

    @property
    def is_folder(self) -> bool:
        """Return whether each picture is a file of its own."""
        return self._path.is_dir()

    def interrupt(self) -> None:
        """Do nothing: a file never keeps its reader waiting."""

    def pictures(self) -> Iterator[tuple[float, str, Picture]]:
        """Yield every picture as fast as it is requested: its due time [s], its name, and the picture."""
        if not self._path.exists():
            raise DriverError("there is no such file or folder")
        if not self._path.is_file() and not self._path.is_dir():  # opening a pipe would wait for a writer
            raise DriverError("it is neither a file nor a folder")
        yield from self._folder() if self._path.is_dir() else self._video()

    def read(self, drain: Drain) -> None:
        """Hand over pictures, each when it is due; raises EndOfStreamError after the last."""
        start_ns, count = clock.now_ns(), 0
        for due_s, _, picture in self.pictures():
            due_ns = start_ns + round(due_s * NS_PER_S)
            if drain.wait(max(0.0, (due_ns - clock.now_ns()) / NS_PER_S)):
                return
            drain.opened()
            drain.keep([Unit(b"", clock.now_ns(), due_ns, picture=picture)])
            count += 1
        if not count:
            raise DriverError("there is no picture in it")
        raise EndOfStreamError(f"ended after {count} pictures")

    def _folder(self) -> Iterator[tuple[float, str, Picture]]:
        paths = sorted(path for path in self._path.iterdir() if path.suffix.lower() in _SUFFIXES)
        shown = 0
        for path in paths:
            try:
                pixels = cv2.imread(str(path), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
            except cv2.error:  # a picture that claims to be huge
                pixels = None
            if pixels is None:
                self.rejected["unreadable"] += 1
                continue
            yield shown / _FOLDER_FPS, path.name, Matrix(np.asarray(pixels, dtype=np.uint8))
            shown += 1

    def _video(self) -> Iterator[tuple[float, str, Picture]]:
        try:
            with av.open(str(self._path)) as container:
                stream = next(iter(container.streams.video), None)
                if stream is None:
                    raise DriverError("there is no video in it")
                stream.codec_context.thread_count = 1
                first_s: float | None = None
                for index, frame in enumerate(container.decode(stream)):
                    shown_s = frame.time if frame.time is not None else index / float(stream.average_rate or 25)
                    first_s = shown_s if first_s is None else first_s
                    yield shown_s - first_s, f"{shown_s - first_s:.2f} s", VideoPicture(frame)
        except av.InvalidDataError:
            raise DriverError("is no video, picture file or folder of pictures that can be read") from None
        except (av.FFmpegError, ValueError) as error:
            raise DriverError(getattr(error, "strerror", None) or str(error)) from None
