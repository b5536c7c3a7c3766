"""A foreign package's tags, as on the how-to page: from the field file through pictures and print to poses."""

import math
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.camera import pose
from drivers.camera.convert import stabilized_from_optical
from drivers.camera.dictionaries import black_cells, family_of
from drivers.camera.pipeline import Pipeline
from drivers.camera.settings import DetectorSettings, MarkerSettings, MountSettings, TagSettings
from groundstation import plug_ins
from groundstation.arrays import Array, Image
from groundstation.errors import SettingsError
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import base_from_tilted_optical
from groundstation.geometry.tag import DICTIONARIES, SquareTag
from groundstation.settings.load import load_field
from sim_bridge.render.renderer import Renderer
from sim_bridge.render.spec import BoardSpec, BodyShape, Mount, PictureQuality, RenderSpec

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "how-to" / "use-skein-as-a-library.md").read_text(encoding="utf-8")
LAB = ROOT / "tests" / "fixtures" / "field" / "lab.yaml"
FRONT = CameraIntrinsics(640, 360, 460.0, 460.0, 319.5, 179.5, (-0.30, 0.08, 0.0, 0.0, 0.0))
MOUNT = MountSettings(parent="drone_1", tilt_down_deg=45.0)
MORE = """torn = no_such_module:Tags
hollow = my_lab.tags:np
nothing = my_lab.none:Nothing
"""


@pytest.fixture(autouse=True)
def _installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    (text,) = re.findall(r"```python\n# my_lab/tags\.py\n(.*?)```", PAGE, re.DOTALL)
    (tmp_path / "my_lab").mkdir()
    (tmp_path / "my_lab" / "tags.py").write_text(text)
    (tmp_path / "my_lab" / "none.py").write_text("class Nothing:\n    count, bits, corner_std_px = 0, 5, 0.6\n")
    (entry,) = re.findall(r'\[project\.entry-points\."skein\.markers"\]\n(.*?)```', PAGE, re.DOTALL)
    info = tmp_path / "my_lab-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-lab\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[skein.markers]\n" + entry.replace('"', "") + MORE)
    monkeypatch.syspath_prepend(tmp_path)
    plug_ins.tag_family.cache_clear()
    yield
    plug_ins.tag_family.cache_clear()
    for name in ("my_lab", "my_lab.tags", "my_lab.none"):
        sys.modules.pop(name, None)


def options(dictionary: str, number: int = 3) -> list[str]:
    marker = f"kind: aruco, dictionary: {dictionary}, id: {number}, size_mm: 168, code: null"
    return [f"drones.drone_1.marker={{{marker}}}"]


def renderer_of(number: int) -> Renderer:
    mount = Mount(Pose(base_from_tilted_optical(math.radians(45)), np.zeros(3)), "drone_1")
    tag = SquareTag("LAB_TAGS", number, 168.0)
    board = BoardSpec("bot", 0, 0.0, (0.0, 0.0, 0.4), BodyShape.TURTLEBOT, tag)
    quality = PictureQuality(exposure_ms=0.0)
    return Renderer(RenderSpec("c", mount, FRONT, (board,), "t", ("drone_1", "bot"), "127.0.0.1", 0, quality))


@pytest.mark.parametrize("number", [0, 3, 7])
def test_a_tag_of_the_page_is_found_where_it_was_drawn(number: int) -> None:
    """Camera 45 deg down at 1.6 m; the tag 1.2 m ahead, 0.3 m to the left, 1.2 m below, turned left by 20 deg."""
    marker = MarkerSettings(entity="bot", tag=TagSettings(dictionary="LAB_TAGS", id=number, size_mm=168.0))
    pipeline = Pipeline(FRONT, (marker,), DetectorSettings(), search_rate_hz=2.0)
    yaw = math.radians(20)
    states = np.array([[0, 0, 1.6, *[0.0] * 10], [1.2, 0.3, 0.0, *[0.0] * 5, yaw, *[0.0] * 4]])
    picture = renderer_of(number).render(states)
    level = pose.Gravity(stabilized_from_optical(MOUNT, 0.0, 0.0), 0.0, 0.0, True)
    (sighting,) = pipeline.process(picture, 0, lambda _: level)
    optical = base_from_tilted_optical(math.radians(45)).T @ np.array([1.2, 0.3, -1.2])
    assert sighting.choice.best.position_m == pytest.approx(optical, abs=0.02)
    assert sighting.choice.best.yaw_rad == pytest.approx(yaw, abs=math.radians(3))
    assert pipeline.tracked == ("bot",)


def test_others_of_the_family_are_not_taken_for_it() -> None:
    marker = MarkerSettings(entity="bot", tag=TagSettings(dictionary="LAB_TAGS", id=4, size_mm=168.0))
    pipeline = Pipeline(FRONT, (marker,), DetectorSettings(), search_rate_hz=2.0)
    picture = renderer_of(3).render(np.array([[0, 0, 1.6, *[0.0] * 10], [1.2, 0.3, 0.0, *[0.0] * 10]]))
    assert pipeline.process(picture, 0, lambda _: pose.Gravity(np.eye(3), 0.0, 0.0, False)) == []


def test_a_field_may_have_it_and_print_it() -> None:
    field = load_field(LAB, options("LAB_TAGS"))
    printed = field.drones["drone_1"].marker.printed
    assert isinstance(printed, SquareTag) and printed.modules == 7
    cells = np.array(black_cells(printed))
    assert cells.shape == (7, 7) and cells[0].all() and cells[:, -1].all() and not cells.all()


def test_a_detector_that_fails_costs_the_picture_and_not_the_camera(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_: Image) -> list[tuple[int, Array]]:
        raise IndexError("out of tags")

    monkeypatch.setattr(plug_ins.tag_family("LAB_TAGS"), "finder", lambda: broken, raising=False)
    marker = MarkerSettings(entity="bot", tag=TagSettings(dictionary="LAB_TAGS", id=4, size_mm=168.0))
    pipeline = Pipeline(FRONT, (marker,), DetectorSettings(), search_rate_hz=2.0)
    # The driver counts a picture's ValueError, and goes on with the next.
    with pytest.raises(ValueError, match="tags LAB_TAGS: IndexError: out of tags"):
        pipeline.process(np.zeros((360, 640), np.uint8), 0, lambda _: pose.Gravity(np.eye(3), 0.0, 0.0, False))


REFUSED = [
    ("LAB_TAGS", 8, r"drones.drone_1.marker.id: must be in 0..7 of LAB_TAGS"),
    ("torn", 3, r"drones.drone_1.marker.dictionary: torn cannot be used: my-lab .*no_such_module"),
    ("hollow", 3, r"drones.drone_1.marker.dictionary: hollow cannot be used: my-lab .*TypeError"),
    ("nothing", 3, r"drones.drone_1.marker.dictionary: nothing cannot be used: .*without finder"),
    ("DICT_MINE", 3, r"drones.drone_1.marker.dictionary: must be one of .*LAB_TAGS"),
    ("DICT_APRILTAG_36h11", 3, r"must be one of .*; did you mean DICT_APRILTAG_36H11\?"),
]


@pytest.mark.parametrize(("dictionary", "number", "refused"), REFUSED)
def test_unusable_tags_are_named_at_their_line(dictionary: str, number: int, refused: str) -> None:
    with pytest.raises(SettingsError, match=refused):
        load_field(LAB, options(dictionary, number))


def test_others_work_beside_a_broken_one() -> None:
    assert load_field(LAB, options("DICT_4X4_50")).drones["drone_1"].marker.identity == "DICT_4X4_50 3"
    assert all(family_of(name).count == count for name, (count, _) in DICTIONARIES.items())
