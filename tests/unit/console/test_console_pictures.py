"""Pictures on the page: rate, size, and matching detections."""

import json

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.bus import messages as m
from groundstation.bus.jpeg import stated_size
from groundstation.console.pictures import PictureDesk, frame_of
from groundstation.console.room import lenses_of
from groundstation.field.resolved import ResolvedField
from groundstation.time_units import NS_PER_S

JPEG = bytes(cv2.imencode(".jpg", np.zeros((360, 640, 3), np.uint8))[1])


def header(entity: str, stamp_ns: int = NS_PER_S) -> m.Header:
    return m.Header(stamp_ns, "c", entity, "s", 0)


def test_detections_belong_to_their_picture(lab_field: ResolvedField) -> None:
    desk = PictureDesk(lenses_of(lab_field))

    def sight(stamp_ns: int) -> m.RelativeObservation:
        return m.RelativeObservation(
            header=header("drone_1", stamp_ns),
            observer="drone_1",
            subject="turtlebot",
            camera="drone_1_camera",
            position_m=(0.0, 0.0, 2.0),
            yaw_rad=None,
            covariance=(0.1,) * 9,
        )

    desk.take_detection(sight(5))  # before its picture
    assert desk.take_picture("drone_1_camera", header("drone_1_camera", 5), JPEG, NS_PER_S)
    desk.take_detection(sight(5))  # and after it
    desk.take_detection(sight(6))  # of another picture
    mark, later = desk.detections()["drone_1_camera"]["marks"]
    assert (mark["u"], mark["v"], mark["range_m"]) == (319.5, 179.5, 2.0) and later == mark
    assert not desk.take_picture("drone_1_camera", header("drone_1_camera", 7), JPEG, NS_PER_S + 50_000_000)
    size = int.from_bytes(desk.frames["drone_1_camera"][:2], "big")
    assert json.loads(desk.frames["drone_1_camera"][2 : 2 + size])["camera"] == "drone_1_camera"
    assert frame_of("a", 0, b"xyz").endswith(b"xyz")


def test_pictures_come_at_five_a_second_on_the_average() -> None:
    desk, jitter = PictureDesk({}), np.random.default_rng(1)
    # Five a second, polled every 50 ms; then fifteen.
    for rate_hz, at_most in ((5, 101), (15, 102)):
        stamps = [
            round(NS_PER_S * (10 + k / rate_hz + jitter.uniform(0, 0.03))) // 50_000_000 * 50_000_000
            for k in range(20 * rate_hz)
        ]
        taken = sum(desk.take_picture(f"at_{rate_hz}", header("c", stamp), JPEG, stamp) for stamp in stamps)
        assert 97 <= taken <= at_most


def jpeg_of(width: int, height: int) -> bytes:
    return (
        b"\xff\xd8\xff\xe0\x00\x04ab\xff\xc0\x00\x11\x08"
        + height.to_bytes(2, "big")
        + width.to_bytes(2, "big")
        + b"\x03\xff\xd9"
    )


@pytest.mark.parametrize(
    ("jpeg", "words"),
    [
        (b"GIF89a", "not a JPEG"),
        (b"", "not a JPEG"),
        (b"\xff\xd8" + b"\xff\xe0\x00\x00" * 9000, "not a JPEG"),
        (JPEG[:20], "not a JPEG"),
        (jpeg_of(65535, 65535), "65535 x 65535 pixels"),
        (jpeg_of(0, 480), "0 x 480 pixels"),
        (JPEG + b"\0" * 5_000_000, "5 MB"),
    ],
)
def test_absurd_pictures_are_refused_and_said_so(jpeg: bytes, words: str) -> None:
    desk = PictureDesk({})
    assert not desk.take_picture("c", header("c"), jpeg, NS_PER_S)
    assert words in desk.refused["c"] and "c" not in desk.frames
    assert desk.take_picture("c", header("c"), JPEG, 2 * NS_PER_S) and not desk.refused


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=200))
def test_the_size_of_any_bytes_can_be_asked_for(data: bytes) -> None:
    stated_size(b"\xff\xd8" + data)
    assert stated_size(JPEG) == (640, 360)
