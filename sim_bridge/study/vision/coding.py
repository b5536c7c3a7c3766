"""Pictures after coding: JPEG, or H.264 as AR.Drones send it."""

from fractions import Fraction

import av
import cv2
import numpy as np

from groundstation.arrays import Image


def through_jpeg(picture: Image, quality: int) -> Image:
    """Return a picture after JPEG."""
    coded = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return np.asarray(cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE), dtype=np.uint8)


def through_h264(picture: Image, quantiser: int) -> Image:
    """Return a picture after H.264 baseline at a constant quantiser (0..51), as the picture after a key picture."""
    height, width = picture.shape
    encoder = av.CodecContext.create("libx264", "w")
    encoder.width, encoder.height, encoder.pix_fmt = width, height, "yuv420p"
    encoder.time_base = Fraction(1, 15)
    encoder.options = {"profile": "baseline", "preset": "veryfast", "tune": "zerolatency", "qp": str(quantiser)}
    decoder, decoded = av.CodecContext.create("h264", "r"), []
    # The key picture is shifted by a pixel, so that the next one is predicted and not merely repeated.
    for number, shown in enumerate((np.roll(picture, 1, axis=1), picture)):
        frame = av.VideoFrame.from_ndarray(shown, format="gray").reformat(format="yuv420p")
        frame.pts = number
        for packet in encoder.encode(frame):
            decoded += decoder.decode(packet)
    decoded += decoder.decode(None)
    return np.asarray(decoded[-1].to_ndarray(format="gray"), dtype=np.uint8)
