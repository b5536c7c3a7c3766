"""The multipart reader on hand-made bytes of several camera types, and on invalid streams."""

import cv2
import numpy as np
import pytest

from drivers.camera.multipart import MAX_FRAME_BYTES, MultipartParser

JPEG = b"\xff\xd8 first picture \xff\xd9"
OTHER = b"\xff\xd8 second\r\n--picture \xff\xd9"


def sized(jpeg, boundary=b"frame"):
    return b"--%s\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n%s\r\n" % (boundary, len(jpeg), jpeg)


def test_parts_with_content_length():
    assert MultipartParser(b"frame").feed(sized(JPEG) + sized(OTHER)) == [JPEG, OTHER]


def test_parts_without_content_length():
    stream = b"--frame\r\nContent-Type: image/jpeg\r\n\r\n" + JPEG + b"\r\n--frame\r\nContent-Type: image/jpeg\r\n\r\n"
    assert MultipartParser(b"frame").feed(stream) == [JPEG]


def test_heads_with_bare_line_feeds():
    stream = (sized(JPEG) + sized(OTHER)).replace(b"\r\n\r\n", b"\n\n").replace(b"jpeg\r\n", b"jpeg\n")
    assert MultipartParser(b"frame").feed(stream) == [JPEG, OTHER]


def test_a_picture_without_a_length_does_not_wait_for_the_next_one():
    """As sent by a few lines of Python on a small computer: each boundary comes with the picture after it."""
    _, coded = cv2.imencode(".jpg", np.arange(64 * 64, dtype=np.uint8).reshape(64, 64))
    thumbnail = b"Exif\0\0" + JPEG
    jpeg = coded.tobytes()
    jpeg = jpeg[:2] + b"\xff\xe1" + (len(thumbnail) + 2).to_bytes(2) + thumbnail + jpeg[2:]
    for step in (1, 7, 4096):
        parser, found = MultipartParser(b"frame"), []
        for number in range(3):
            part = b"--frame\r\nContent-Type: image/jpeg\r\n\r\n" + jpeg + b"\r\n"
            for at in range(0, len(part), step):
                found += parser.feed(part[at : at + step])
            assert found == [jpeg] * (number + 1), "and its thumbnail is no picture"
        assert not parser.rejected


def whole_jpeg(seed):
    noise = np.random.default_rng(seed).integers(0, 255, (120, 160), dtype=np.uint8)
    return cv2.imencode(".jpg", noise)[1].tobytes()


PICTURES = [whole_jpeg(seed) for seed in range(8)]


@pytest.mark.parametrize("step", [300, 1 << 16])
@pytest.mark.parametrize(
    "stated",
    [lambda n: n - 1, lambda n: n - 10, lambda n: n + 2, lambda n: n + 4, lambda n: n + 10]
    + [lambda n, fixed=fixed: fixed for fixed in (0, 5000, 100_000, 8 << 20, 9 << 20)],
)
def test_a_wrong_length_costs_no_picture(stated, step):
    """Each was refused, or every second swallowed, or all, for as long as the camera ran."""
    stream = b"".join(sized(jpeg).replace(b"%d" % len(jpeg), b"%d" % stated(len(jpeg)), 1) for jpeg in PICTURES)
    parser, found = MultipartParser(b"frame"), []
    for at in range(0, len(stream), step):
        found += parser.feed(stream[at : at + step])
        if at > len(stream) // 2:
            assert len(found) >= stream[: at + step - 2].count(b"\xff\xd9\r\n--frame"), "none waits for the next"
    assert [jpeg.rstrip(b"\r\n") for jpeg in found] == PICTURES
    assert not parser.rejected


def test_a_right_length_of_pictures_that_are_padded_is_used():
    padded = [jpeg + b"\0" * 7 for jpeg in PICTURES]
    parser, found = MultipartParser(b"frame"), []
    for number, jpeg in enumerate(padded):
        found += parser.feed(sized(jpeg))
        assert len(found) == (number + 1 if number else 0), "only the first waits for a boundary"
    assert found == padded


def test_blank_lines_before_the_picture():
    for blank in (b"\r\n", b"\n", b"\r\n\r\n"):
        parser = MultipartParser(b"frame")
        not_counted, counted = sized(JPEG).replace(JPEG, blank + JPEG), sized(blank + JPEG)
        without_length = b"--frame\r\nContent-Type: image/jpeg\r\n\r\n" + blank + JPEG + b"\r\n"
        assert parser.feed(counted + without_length + sized(OTHER)) == [JPEG, JPEG, OTHER]
        assert not parser.rejected
        assert parser.feed(not_counted + sized(OTHER)) == [JPEG, OTHER]


def test_byte_by_byte():
    parser, frames = MultipartParser(b"frame"), []
    for byte in sized(JPEG) + sized(OTHER):
        frames += parser.feed(bytes([byte]))
    assert frames == [JPEG, OTHER]


def test_lower_case_headers_and_noise_between_parts():
    stream = b"junk\r\n\r\n--frame\r\ncontent-length:%d\r\n\r\n" % len(JPEG) + JPEG + b"\r\n\r\n\r\n" + sized(OTHER)
    assert MultipartParser(b"frame").feed(stream) == [JPEG, OTHER]


def test_a_part_without_jpeg_is_rejected_and_the_next_one_found():
    parser = MultipartParser(b"frame")
    assert parser.feed(sized(b"<html>no</html>") + sized(JPEG)) == [JPEG]
    assert parser.rejected == 1


def test_an_absurd_length_does_not_swallow_the_stream():
    parser = MultipartParser(b"frame")
    absurd = b"--frame\r\nContent-Length: %d\r\n\r\n" % (MAX_FRAME_BYTES + 1)
    assert parser.feed(absurd + sized(JPEG)) == [JPEG]
    assert parser.rejected == 1


def test_an_endless_header_does_not_swallow_the_stream():
    parser = MultipartParser(b"frame")
    parser.feed(b"--frame\r\n" + b"X-Long: y\r\n" * 1000)
    assert parser.feed(sized(JPEG)) == [JPEG]


def test_memory_stays_bounded_without_any_boundary():
    parser = MultipartParser(b"frame")
    for _ in range(40):
        assert parser.feed(b"\x00" * (1 << 20)) == []
    assert len(parser._buffer) < 100


def test_memory_stays_bounded_in_a_part_without_end():
    parser = MultipartParser(b"frame")
    parser.feed(b"--frame\r\nContent-Type: image/jpeg\r\n\r\n")
    for _ in range(20):
        parser.feed(b"\xff" * (1 << 20))
    assert len(parser._buffer) <= MAX_FRAME_BYTES + (2 << 20)
    assert parser.feed(b"\r\n" + sized(JPEG))[-1:] == [JPEG]


def test_a_body_has_the_boundary_with_which_it_begins():
    """Cameras announce one boundary and send another, or no dashes before the first part."""
    for announced in (b"frame", b"other"):
        for step in (1, 5, 4096):
            parser, found, stream = MultipartParser(announced), [], b"\r\n" + sized(JPEG) + sized(OTHER)
            for at in range(0, len(stream), step):
                found += parser.feed(stream[at : at + step])
            assert found == [JPEG, OTHER]


def test_a_stream_without_its_first_boundary_begins_with_the_second_picture():
    stream = sized(JPEG).removeprefix(b"--frame\r\n") + sized(OTHER)
    assert MultipartParser(b"frame").feed(stream) == [OTHER]
