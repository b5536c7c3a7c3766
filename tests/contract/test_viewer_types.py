"""Our hand-written well-known types equal those of Foxglove's own library."""

from typing import Any

import pytest

from groundstation.recording import viewers
from groundstation.recording.protobuf import fields
from groundstation.recording.viewers import Transform, viewer_descriptor

pytest.importorskip("foxglove", reason="the extra [foxglove] is not installed")
from foxglove import messages as fm

pytestmark = [pytest.mark.slow, pytest.mark.study]  # the library is large: make test does without it

TIME_NS = 1_700_000_001_250_000_000
STAMP = fm.Timestamp(1_700_000_001, 250_000_000)


def _named(data: bytes, number: int) -> list[bytes]:
    return [value for found, value in fields(data) if found == number and isinstance(value, bytes)]


def _types(descriptor_set: bytes) -> dict[str, dict[int, tuple[Any, ...]]]:
    """Return message -> field number -> (name, type, label, type name) of a FileDescriptorSet."""
    found: dict[str, dict[int, tuple[Any, ...]]] = {}
    for file in _named(descriptor_set, 1):
        (package,) = _named(file, 2)
        for message in _named(file, 4):
            name = f"{package.decode()}.{_named(message, 1)[0].decode()}"
            parts = [dict[int, Any](fields(field)) for field in _named(message, 2)]
            found[name] = {part[3]: (part[1], part[5], part[4], part.get(6)) for part in parts}
    return found


def _tree(data: bytes, inner: tuple[int, ...]) -> dict[int, Any]:
    """Return a message as number -> value, with the named fields decoded once more."""
    return {
        number: sorted(fields(value)) if number in inner and isinstance(value, bytes) else value
        for number, value in fields(data)
    }


@pytest.mark.parametrize("name", ["CompressedImage", "CompressedVideo", "Log", "FrameTransforms", "PosesInFrame"])
def test_descriptors_agree(name: str) -> None:
    ours = _types(viewer_descriptor(f"foxglove.{name}"))
    theirs = _types(getattr(fm, name).get_schema().data)
    assert set(ours) == set(theirs)
    for message, listed in theirs.items():
        assert {number: field for number, field in ours[message].items() if number < 1000} == listed


def test_pictures_agree() -> None:
    header = b'{"seq":1}'
    theirs = fm.CompressedImage(timestamp=STAMP, frame_id="ceiling", data=b"\xff\xd8", format="jpeg").encode()
    ours = _tree(viewers.image(TIME_NS, "ceiling", "jpeg", header, b"\xff\xd8"), (1,))
    assert ours.pop(1000) == header
    assert ours == _tree(theirs, (1,))
    theirs = fm.CompressedVideo(timestamp=STAMP, frame_id="drone_1_camera", data=b"\0\0\0\1", format="h264").encode()
    ours = _tree(viewers.video(TIME_NS, "drone_1_camera", "h264", header, b"\0\0\0\1"), (1,))
    assert ours.pop(1000) == header
    assert ours == _tree(theirs, (1,))


def test_log_lines_agree() -> None:
    theirs = fm.Log(timestamp=STAMP, level=fm.LogLevel.Warning, message="battery low", name="drone_1").encode()
    assert _tree(viewers.log_line(TIME_NS, "WARNING", "drone_1", "battery low"), (1,)) == _tree(theirs, (1,))


def test_transforms_agree() -> None:
    ours = viewers.frame_transforms(TIME_NS, (Transform("world", "drone_1", (1.0, -2.0, 1.5), (0.8, 0.0, 0.0, 0.6)),))
    pose = fm.FrameTransform(
        timestamp=STAMP,
        parent_frame_id="world",
        child_frame_id="drone_1",
        translation=fm.Vector3(x=1.0, y=-2.0, z=1.5),
        rotation=fm.Quaternion(x=0.0, y=0.0, z=0.6, w=0.8),
    )
    (mine,) = _named(ours, 1)
    (other,) = _named(fm.FrameTransforms(transforms=[pose]).encode(), 1)
    rotation = {number: value for number, value in fields(_named(mine, 5)[0]) if value != bytes(8)}
    assert rotation == dict(fields(_named(other, 5)[0]))  # theirs leaves zeros out
    assert _tree(mine, (1, 4)) | {5: None} == _tree(other, (1, 4)) | {5: None}


def test_poses_agree() -> None:
    poses = [Transform("world", "drone_1", (float(x), -2.0, 1.5), (0.8, 0.1, 0.1, 0.6)) for x in (1, 2)]
    theirs = fm.PosesInFrame(
        timestamp=STAMP,
        frame_id="world",
        poses=[
            fm.Pose(
                position=fm.Vector3(x=float(x), y=-2.0, z=1.5), orientation=fm.Quaternion(x=0.1, y=0.1, z=0.6, w=0.8)
            )
            for x in (1, 2)
        ],
    )
    ours = viewers.poses_in_frame(TIME_NS, "world", poses)
    assert _tree(ours, (1,)) == _tree(theirs.encode(), (1,))
    assert [_tree(one, (1, 2)) for one in _named(ours, 3)] == [_tree(one, (1, 2)) for one in _named(theirs.encode(), 3)]
