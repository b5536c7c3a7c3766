"""The multipart reader finds the same frames however the stream is cut; garbage never raises."""

from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.camera.multipart import MultipartParser

_jpeg = st.binary(max_size=200).map(lambda body: b"\xff\xd8" + body + b"\xff\xd9")


def sized(jpeg):
    return b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n%s\r\n" % (len(jpeg), jpeg)


@settings(max_examples=60, deadline=None)
@given(frames=st.lists(_jpeg, max_size=5), cuts=st.lists(st.integers(1, 97), min_size=1, max_size=8))
def test_any_cutting_gives_the_same_frames(frames, cuts):
    stream, parser, found, at, turn = b"".join(map(sized, frames)), MultipartParser(b"frame"), [], 0, 0
    while at < len(stream):
        found += parser.feed(stream[at : at + cuts[turn % len(cuts)]])
        at += cuts[turn % len(cuts)]
        turn += 1
    assert found == frames


@settings(max_examples=60, deadline=None)
@given(
    pieces=st.lists(st.one_of(st.binary(max_size=60), st.sampled_from([b"--frame", b"\r\n\r\n", b"Content-Length: 9"])))
)
def test_garbage_is_only_counted(pieces):
    parser = MultipartParser(b"frame")
    for piece in pieces:
        assert all(frame.startswith(b"\xff\xd8") for frame in parser.feed(piece))
    assert parser.feed(b"\r\n\r\n" + b"x" * 5000 + b"\r\n" + sized(b"\xff\xd8a\xff\xd9") * 3)[-1:] == [
        b"\xff\xd8a\xff\xd9"
    ]
