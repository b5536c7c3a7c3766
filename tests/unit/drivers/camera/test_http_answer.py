"""Head and chunks of a camera's HTTP response, on bytes as sent by an ESP32, ffmpeg and others."""

import pytest

from drivers.camera.http_answer import (
    ChunkedBody,
    boundary_from_body,
    boundary_from_head,
    is_chunked,
    may_begin_with_boundary,
    split_answer,
)
from groundstation.errors import DriverError

PARTS = (b"--frame\r\n", b"Content-Type: image/jpeg\r\n\r\n", b"\xff\xd8\r\n0\r\n\xff\xd9", b"\r\n")


def chunked(*parts, end=b"\r\n"):
    return b"".join(b"%x" % len(part) + end + part + end for part in parts)


def test_boundaries_in_response_heads():
    head = b"HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=%s\r\n"
    assert boundary_from_head(head % b"frame") == b"frame"
    assert boundary_from_head(head % b'"--frame"') == b"frame"
    assert boundary_from_head(head % b"--myboundary") == b"myboundary"
    assert boundary_from_head(b"HTTP/1.0 200 OK\r\nContent-Type: text/html\r\n") is None


def test_a_head_ends_with_an_empty_line_of_any_kind():
    for end in (b"\r\n", b"\n"):
        head = end.join((b"HTTP/1.1 200 OK", b"Transfer-Encoding: chunked"))
        assert split_answer(head + end) is None
        assert split_answer(head + end + end + b"body") == (head, b"body")
        assert is_chunked(head)
    assert not is_chunked(b"HTTP/1.1 200 OK\r\nX-Note: transfer-encoding: chunked")


@pytest.mark.parametrize("end", [b"\r\n", b"\n"])
@pytest.mark.parametrize("step", [1, 3, 4096])
def test_chunks_are_joined(end, step):
    body, stream, found = ChunkedBody(), chunked(*PARTS, end=end) + b"0\r\n\r\n", b""
    for at in range(0, len(stream), step):
        found += body.feed(stream[at : at + step])
    assert found == b"".join(PARTS)
    assert body.ended


def test_sizes_have_capitals_zeros_and_extensions():
    assert ChunkedBody().feed(b"00A ; name=value\r\n0123456789\r\n") == b"0123456789"


@pytest.mark.parametrize("damage", [b"no size\r\n", b"-5\r\n", b"123456789\r\n", b"f" * 300])
def test_a_chunk_without_a_size_is_damage(damage):
    with pytest.raises(DriverError, match="damaged"):
        ChunkedBody().feed(chunked(PARTS[0]) + damage)


def test_the_boundary_with_which_a_body_begins():
    assert boundary_from_body(b"\r\n--frame\r\nContent-Type: image") == b"frame"
    assert boundary_from_body(b"----frame\nX: y") == b"frame"
    for begun in (b"", b"\r\n-", b"--fra", b"--frame\r\nCont"):
        assert may_begin_with_boundary(begun) and boundary_from_body(begun) is None
    for other in (b"<html>--frame\r\n", b"\xff\xd8--", b"--frame\r\n\r\n\xff\xd8", b"--" + b"y" * 300):
        assert not may_begin_with_boundary(other) and boundary_from_body(other) is None
