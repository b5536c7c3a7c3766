"""The messages of cameras: CompressedImage and Image, as they are; pixels are not interpreted.

WIRE (docs/reference/ros2.md 6): fields and encodings.
"""

from dataclasses import dataclass

from drivers.rmw_zenoh.wire.cdr import CdrReader, WireError

COMPRESSED, RAW = "sensor_msgs::msg::dds_::CompressedImage_", "sensor_msgs::msg::dds_::Image_"
# encoding -> bytes of a pixel
ENCODINGS = {"mono8": 1, "rgb8": 3, "bgr8": 3}
LARGEST_PX = 8192


@dataclass(frozen=True, slots=True)
class CompressedPicture:
    """A picture in a file format that its first bytes name; stamp_ns: on the sender's clock."""

    stamp_ns: int
    format: str
    data: bytes


@dataclass(frozen=True, slots=True)
class RawPicture:
    """A picture of `height` rows, each `step` bytes; stamp_ns: on the sender's clock."""

    stamp_ns: int
    width: int
    height: int
    encoding: str
    step: int
    data: bytes


def decode_compressed(payload: bytes) -> CompressedPicture:
    """Return a CompressedImage; raises WireError if cut short or empty."""
    reader = CdrReader(payload)
    stamp_ns, _ = reader.header()
    picture = CompressedPicture(stamp_ns, reader.text(), reader.blob())
    if not picture.data:
        raise WireError("empty")
    return picture


def decode_raw(payload: bytes) -> RawPicture:
    """Return an Image; raises WireError if cut short, empty, or with contradicting sizes."""
    reader = CdrReader(payload)
    stamp_ns, _ = reader.header()
    height, width = reader.numbers("I", 2)
    encoding = reader.text()
    reader.numbers("B")  # the byte order, for pixel values of several bytes
    (step,) = reader.numbers("I")
    picture = RawPicture(stamp_ns, width, height, encoding, step, reader.blob())
    if not picture.data or not width or not height:
        raise WireError("empty")
    pixel = ENCODINGS.get(encoding)
    if pixel is not None and (
        max(width, height) > LARGEST_PX or step < width * pixel or len(picture.data) != step * height
    ):
        raise WireError("size")
    return picture
