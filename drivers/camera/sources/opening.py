"""Opens the reader of a source's address."""

from pkgutil import resolve_name

from drivers.camera.source_address import SourceAddress, SourceKind, parse_source
from drivers.camera.sources.container import device, rtsp
from drivers.camera.sources.files import FileReader
from drivers.camera.sources.frames import FrameSource
from drivers.camera.sources.mjpeg import MjpegReader
from drivers.camera.sources.reader_thread import Drain, Reader
from drivers.camera.sources.ros2 import Ros2Reader
from groundstation import plug_ins
from groundstation.errors import DriverError, without_password
from groundstation.vehicles import all_kinds

_READER = ("name", "decoder", "rejected", "read", "interrupt")


def open_source(source: str, size: tuple[int, int] | None = None) -> FrameSource:
    """Return the reader of a source, already at work; raises DriverError for an address of no known kind.

    size: (width, height) [px] requested of a camera of this machine; others send what they are set to.
    """
    try:
        return Drain(_reader(parse_source(source), source, size))
    except ValueError as error:
        raise DriverError(f"camera source {without_password(source)}: {error}") from None


def _reader(address: SourceAddress, source: str, size: tuple[int, int] | None) -> Reader:
    match address.kind:
        case SourceKind.HTTP:
            return MjpegReader(address.host, address.port, address.path, address.login, address.interface)
        case SourceKind.RTSP:
            return rtsp(source, f"{address.host}:{address.port}")
        case SourceKind.ROS2:
            return Ros2Reader(address.host, address.port, address.path, address.domain)
        case SourceKind.DEVICE:
            return device(address.path, size)
        case SourceKind.FILE:
            return FileReader(address.path)
        case SourceKind.VEHICLE:
            return _own_video(address)
        case SourceKind.PLUG_IN:
            reader: Reader = plug_ins.made(plug_ins.CAMERAS, address.host, _READER, source, size)
            return reader


def _own_video(address: SourceAddress) -> Reader:
    (reader,) = (kind.reader for kind in all_kinds().values() if kind.camera == address.vehicle)
    try:
        made: Reader = resolve_name(reader)((address.host, address.port), address.interface)
    except (ImportError, AttributeError, TypeError) as error:
        raise ValueError(f"{reader} cannot be used: {plug_ins.reason(error)}") from error
    return made
