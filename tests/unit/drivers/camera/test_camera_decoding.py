"""Decoded pixels equal those that the sensor exposed."""

import struct

import cv2
import numpy as np
from fake_camera import FakeChild, FakeSource, settings

from drivers.camera import driver
from drivers.camera.calibration import feed as calibration_feed
from drivers.camera.sources.frames import Packet
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange


def test_a_picture_that_asks_to_be_turned_is_measured_as_it_was_exposed() -> None:
    """As phones send theirs: EXIF tag 0x112 with 6, a quarter turn; the lens is that of the sensor."""
    grey = np.zeros((360, 640), np.uint8)
    grey[:90, :160] = 255
    whole, jpeg = cv2.imencode(".jpg", grey)
    exif = b"Exif\0\0MM\0*" + struct.pack(">IHHHIHHI", 8, 1, 0x112, 3, 1, 6, 0, 0)
    turned = jpeg.tobytes()[:2] + struct.pack(">HH", 0xFFE1, 2 + len(exif)) + exif + jpeg.tobytes()[2:]
    source, child = FakeSource(), FakeChild(MemoryBus(MemoryExchange(), "lab", "drone_1_camera"))
    served = driver.CameraDriver(child, settings(), source)
    picture = served._decoded(Packet(turned, 0, 0, 1))
    for seen in (picture, calibration_feed.decoded(turned)):
        assert whole and seen is not None and seen.shape == (360, 640) and seen[45, 80] > 200 > 50 > seen[300, 80]
