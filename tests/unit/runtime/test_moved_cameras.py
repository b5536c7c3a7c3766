"""A tracker restarted in flight keeps distrusting a camera that was found to have moved."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from groundstation.bus.messages import Severity
from groundstation.estimation.mount_watch import MountWatch
from groundstation.field.resolved import ResolvedField
from groundstation.process.heartbeat import HeartbeatBlock
from groundstation.runtime.moved_cameras import MovedCameras
from groundstation.tracker import tracker_from_field

S = 1_000_000_000
SLOT = 2


class Heir:
    """A process's slot in the heartbeat block, which its successor gets."""

    def __init__(self, block: HeartbeatBlock) -> None:
        self._block = block
        block.clear(SLOT)

    @property
    def left(self) -> int:
        return self._block.left(SLOT)

    def leave(self, number: int) -> None:
        self._block.leave(SLOT, number)


@pytest.fixture
def block(tmp_path: Path) -> Iterator[HeartbeatBlock]:
    made = HeartbeatBlock(tmp_path / "block", SLOT + 1, create=True)
    yield made
    made.close(remove=True)


@pytest.fixture
def mounts(lab_field: ResolvedField) -> MountWatch:
    return tracker_from_field(lab_field, "here", 0).mounts


def test_a_restarted_tracker_recalls_the_moved_cameras(block: HeartbeatBlock, lab_field: ResolvedField) -> None:
    first = tracker_from_field(lab_field, "here", 0).mounts
    known = MovedCameras(Heir(block), first)
    assert known.recall(0) == []
    first.recall({"ceiling"}, 0)  # as if it had been bumped
    known.note()
    second = tracker_from_field(lab_field, "here", 0).mounts
    (notice,) = MovedCameras(Heir(block), second).recall(S)
    assert second.distrusts("ceiling") and second.is_rootless
    assert (notice.severity, notice.entity) == (Severity.ERROR, "ceiling")
    assert "still not believed; no other camera tells where the team is" in notice.text and notice.remedy


def test_it_is_forgotten_when_all_have_landed(block: HeartbeatBlock, mounts: MountWatch) -> None:
    heir = Heir(block)
    known = MovedCameras(heir, mounts)
    mounts.recall({"ceiling"}, 0)
    mounts.advance(1, {}, (), ())
    known.note()
    assert heir.left == 1, "nobody was heard to fly yet"
    mounts.advance(S, {}, (), ("drone_1",))
    assert mounts.distrusts("ceiling")
    mounts.advance(2 * S, {}, (), ())
    known.note()
    assert not mounts.distrusts("ceiling") and heir.left == 0


def test_it_is_forgotten_where_nobody_flies(mounts: MountWatch) -> None:
    mounts.recall({"ceiling"}, 0)
    mounts.advance(5 * S, {}, (), ())
    assert mounts.distrusts("ceiling")
    mounts.advance(6 * S, {}, (), ())
    assert not mounts.distrusts("ceiling")


def test_a_camera_that_is_not_watched_is_not_recalled(mounts: MountWatch) -> None:
    assert mounts.recall({"elsewhere"}, 0) == [] and mounts.moved == frozenset()
