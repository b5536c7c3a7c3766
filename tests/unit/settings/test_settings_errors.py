"""A catalogue of broken field files: each with the exact lines shown to the operator."""

import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from groundstation.errors import SettingsError
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field

FIXTURE = Path(__file__).parents[2] / "fixtures" / "field"
OTHER_VERSION = "lab.yaml:1: schema_version: must be 1, the version that this program reads"
GOOD = (FIXTURE / "lab.yaml").read_text(encoding="utf-8")


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder with a valid `lab.yaml` in it, as working directory."""
    shutil.copytree(FIXTURE / "cameras", tmp_path / "cameras")
    (tmp_path / "lab.yaml").write_text(GOOD, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    yield tmp_path


def line_of(text: str, needle: str) -> int:
    return text[: text.index(needle)].count("\n") + 1


def problems(*options: str, name: str = "lab.yaml") -> list[str]:
    with pytest.raises(SettingsError) as caught:
        load_field(name, options)
    return caught.value.problems


def broken(old: str, new: str, at: str = "") -> list[str]:
    """Return the problems after one replacement, with `@` for the line of `at` (or of the new text)."""
    assert GOOD.count(old) >= 1, old
    text = GOOD.replace(old, new, 1)
    Path("lab.yaml").write_text(text, encoding="utf-8")
    line = line_of(text, at or new)
    return [problem.replace(f"lab.yaml:{line}: ", "@ ", 1) for problem in problems()]


def catalogue() -> list[tuple[str, ...]]:
    text = (Path(__file__).parents[2] / "fixtures" / "broken_fields.txt").read_text(encoding="utf-8")
    entries = [block.splitlines() for block in text.split("\n\n") if not block.startswith("#")]
    assert all([line[:2] for line in entry] == ["- ", "+ ", "= "] for entry in entries)
    return [tuple(line[2:].replace("\\n", "\n") for line in entry) for entry in entries]


@pytest.mark.parametrize(("old", "new", "expected"), catalogue())
@pytest.mark.usefixtures("lab")
def test_one_mistake_gives_one_line(old: str, new: str, expected: str) -> None:
    assert broken(old, new, at=new.split("\n")[-1]) == [expected]


@pytest.mark.usefixtures("lab")
@pytest.mark.parametrize(
    ("box", "words"),
    [
        ("{centre_m: [3.8, 0], size_m: [1, 1, 1]}", "box: must stand inside the room, x -4 to 4 (got 3.3 to 4.3)"),
        ("{centre_m: [0, -3], size_m: [1, 1, 1]}", "box: must stand inside the room, y -3 to 3 (got -3.5 to -2.5)"),
        ("{centre_m: [0, 0], size_m: [1, 1, 5]}", "room.obstacles.box: must be no higher than the room, 4.5 m (got 5)"),
        ("{centre_m: [-0.9, 0.45], size_m: [0.6, 0.6, 1]}", "drones.drone_1.pad_m: lies in room.obstacles.box"),
        ("{centre_m: [0, 0], size_m: [1, 0, 1]}", "room.obstacles.box.size_m[1]: must be > 0 (got 0)"),
    ],
)
def test_an_obstacle_stands_in_the_room_and_on_no_pad(box: str, words: str) -> None:
    assert any(words in line for line in problems(f"room.obstacles={{box: {box}}}"))


@pytest.mark.usefixtures("lab")
def test_all_mistakes_are_named_at_once_in_the_order_of_lines() -> None:
    changes = {
        "site: lab": "site: Lab",
        "battery_min": "batery_min",
        "tilt_down_deg: 45": "tilt_down_deg: steep",
        "pad_m: [-0.9, -0.45]": "pad_m: [-0.9, 0.25]\n    max_speed_m_s: 30",
        "address: 192.168.1.12": "address: 192.168.1.11",
        "discount: 0.9": "discount: 2",
        "x_m: [-3.7, 3.7]": "x_m: [-5, 3.7]",
        "type: ardrone_2\n    address: 192.168.1.11": "type: ardrone_1\n    address: 192.168.1.11",
    }
    text = GOOD
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new, 1)
    Path("lab.yaml").write_text(text, encoding="utf-8")
    found = problems()
    assert [problem.split(": ")[1] for problem in found] == [
        "site",
        "room.fence.x_m",
        "defaults.limits.batery_min",
        "types.ardrone_2.camera.tilt_down_deg",
        "drones.drone_1.type",
        "drones.drone_2.max_speed_m_s",
        "planner.discount",
    ]
    lines = [int(problem.split(":")[1]) for problem in found]
    assert lines == sorted(lines)


@pytest.mark.usefixtures("lab")
def test_a_file_without_any_section_names_all_that_are_missing() -> None:
    Path("lab.yaml").write_text("schema_version: 1\n", encoding="utf-8")
    assert {problem.split(": ")[1] for problem in problems()} >= {"room", "drones"}


@pytest.mark.usefixtures("lab")
def test_a_fault_of_one_drone_does_not_hide_those_between_drones() -> None:
    text = GOOD.replace("pad_m: [-0.9, -0.45]", "pad_m: [-0.9, 0.25]\n    colour: red")
    Path("lab.yaml").write_text(text.replace("battery_min: 0.15", "battery_min: 15"), encoding="utf-8")
    assert [problem.split(": ", 1)[1] for problem in problems()] == [
        "defaults.limits.battery_min: must be <= 0.9 (got 15)",
        "drones.drone_2.pad_m: is 0.20 m from the pad of drone_1: must be >= 0.6 (safety.min_separation_m)",
        "drones.drone_2.colour: unknown key; known here: kind, enabled, address, interface, host, serial_number,"
        " limits, marker, camera, odometry, pad_m, pad_yaw_deg, video, ardrone, mavlink, ros2, tello, type",
    ]


@pytest.mark.usefixtures("lab")
def test_a_missing_key_is_reported_at_its_place() -> None:
    Path("lab.yaml").write_text(GOOD.replace("    marker: {code: 1}\n", ""), encoding="utf-8")
    line = line_of(GOOD, "  drone_1:")
    assert problems() == [f"lab.yaml:{line}: drones.drone_1.marker.code: is required"]
    Path("lab.yaml").write_text(GOOD.replace("room:\n", "rooom:\n"), encoding="utf-8")
    found = problems()
    assert [problem.split(": ", 1)[1] for problem in found] == [
        "room: is required",
        "rooom: unknown key, did you mean room?",
    ]


@pytest.mark.usefixtures("lab")
def test_a_key_missing_in_a_calibration_is_reported_in_its_file() -> None:
    for name in ("ceiling", "ardrone_front"):
        place = Path("cameras") / f"{name}.yaml"
        kept = place.read_text(encoding="utf-8")
        place.write_text("".join(one for one in kept.splitlines(keepends=True) if not one.startswith("cy_px")))
        found = problems()
        place.write_text(kept, encoding="utf-8")
        assert found and all(re.fullmatch(rf"cameras/{name}\.yaml:\d+: cy_px: is required", one) for one in found)


@pytest.mark.usefixtures("lab")
def test_a_wrong_type_is_wrong_although_no_drone_uses_it() -> None:
    unused = "  spare:\n    kind: ardrone\n    camera: {tilt_down_deg: 95}\n    wings: 2\n"
    Path("lab.yaml").write_text(GOOD.replace("drones:\n", f"{unused}drones:\n", 1), encoding="utf-8")
    assert [problem.split(": ", 2)[1] for problem in problems()] == [
        "types.spare.camera.tilt_down_deg",
        "types.spare.wings",
    ]


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", "lab.yaml: is empty"),
        (b"# nothing\n", "lab.yaml: is empty"),
        (b"- a\n- b\n", "lab.yaml:1: must be a mapping with schema_version, room, drones, ..."),
        (b"just text", "lab.yaml:1: must be a mapping with schema_version, room, drones, ..."),
        (b"a: 1\n\tb: 2\n", "lab.yaml:2: a tab stands where YAML wants spaces: indent with spaces"),
        (b"a: 1\nb: \xff\n", "lab.yaml:2: is not UTF-8 text"),
        (b"a: 1\n---\nb: 2\n", "lab.yaml:2: holds more than one document: one file, one field"),
        (b"a: [1, 2\nb: 3\n", None),
        (b"a: 'open\n", None),
        (b"a: !!python/object:os.system x\n", None),
        (b"a: !!bool maybe\n", "lab.yaml:1: a: 'maybe' is not a bool"),
        (b"a: !!int ''\n", "lab.yaml:1: a: '' is not a number"),
        (b"a: &x [*x]\n", None),
        (b"a: \x00\n", None),
        (b'a: "b\\nc"\n', "lab.yaml:1: a: holds a character that cannot be printed"),
        (b'"a\\e": 1\n', "lab.yaml:1: 'a\\x1b': holds a character that cannot be printed"),
        (b"site: lab\n", "lab.yaml:1: schema_version: is required, 1 here"),
        (
            b"schema_version: 2\nwings: 4\n",
            "lab.yaml:1: schema_version: must be 1, the version that this program reads (got 2)",
        ),
        (
            b"schema_version: one\n",
            'lab.yaml:1: schema_version: must be 1, the version that this program reads (got "one")',
        ),
        (
            b"schema_version: true\n",
            "lab.yaml:1: schema_version: must be 1, the version that this program reads (got true)",
        ),
        (b"#" * 1_000_001, "lab.yaml: is larger than 1000000 bytes: not a settings file"),
    ],
)
def test_unreadable_files(lab: Path, content: bytes, expected: str | None) -> None:
    (lab / "lab.yaml").write_bytes(content)
    found = problems()
    assert all(problem.startswith("lab.yaml") for problem in found)
    if expected is not None:
        assert found == [expected]


def test_an_alias_bomb_is_refused(lab: Path) -> None:
    lines = ["schema_version: 1", "a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 9)]
    (lab / "lab.yaml").write_text("\n".join(lines), encoding="utf-8")
    assert "too many values" in problems()[0]


def test_files_that_are_not_there(lab: Path) -> None:
    assert problems(name="lab.yml") == ["lab.yml: no such file, did you mean lab.yaml?"]
    assert problems(name="nowhere/lab.yaml") == ["nowhere/lab.yaml: no such file"]
    assert problems(name=".") == [".: cannot be read (Is a directory)"]


def test_calibrations(lab: Path) -> None:
    assert broken("cameras/ceiling.yaml", "cameras/ceilng.yaml") == [
        "@ cameras.ceiling.calibration: cameras/ceilng.yaml: no such file, did you mean cameras/ceiling.yaml?"
    ]
    assert broken("cameras/ceiling.yaml", "ceiling.yaml") == [
        "@ cameras.ceiling.calibration: ceiling.yaml: no such file, did you mean cameras/ceiling.yaml?"
    ]
    assert broken("cameras/ceiling.yaml", "lap.yaml") == ["@ cameras.ceiling.calibration: lap.yaml: no such file"]
    (lab / "lab.yaml").write_text(GOOD, encoding="utf-8")
    lens = lab / "cameras" / "ardrone_front.yaml"
    text = lens.read_text(encoding="utf-8")
    lens.write_text(text.replace("fx_px: 460.0", "fx_px: -460.0\nzoom: 2"), encoding="utf-8")
    assert [problem.split(": ", 1)[1] for problem in problems()] == [
        "fx_px: must be > 0 (got -460.0)",
        "zoom: unknown key; known here: schema_version, model, width_px, height_px, fx_px, fy_px, cx_px, cy_px,"
        " distortion, residual_px, date, views, std",
    ]
    assert all(problem.startswith("cameras/ardrone_front.yaml:") for problem in problems())
    lens.write_text(text.replace("cx_px: 319.5", "cx_px: 20"), encoding="utf-8")
    assert problems() == [
        "cameras/ardrone_front.yaml:7: cx_px: must lie near the middle of the picture, 640 wide or high (got 20)"
    ]


OPTIONS = [
    ("safety.min_separation=2", "safety.min_separation: unknown key, did you mean min_separation_m?"),
    ("drones.drone_1.limits.max_speed_m_s=30", "drones.drone_1.limits.max_speed_m_s: must be <= 3 (got 30)"),
    ("drones.drone_3.pad_m=[0, 0]", "there is no drones.drone_3, did you mean drones.drone_2?"),
    ("drones.x.pad_m=[0, 0]", "there is no drones.x, there are drone_1, drone_2"),
    ("site.name=a", "site is a single value, nothing lies below it"),
    ("room.fence.x_m.0=-9", "room.fence.x_m: must lie inside the room, -4 to 4 (got -9 to 3.7)"),
    ("drones.drone_1.camera.position_m=[30, 0, 0]", "drones.drone_1.camera.position_m[0]: must be <= 2 (got 30)"),
    ("cameras.ceiling.position_m=[0, 5, 4]", "cameras.ceiling.position_m: must lie inside the room, y -3 to 3 (got 5)"),
    ("room.fence.x_m.2=-9", "room.fence.x_m is a list of 2, '2' is not in it"),
    ("planner", "must look like path.to.key=value"),
    ("=3", "must look like path.to.key=value"),
    ("planner..discount=3", "must look like path.to.key=value"),
    ("planner.discount=", 'planner.discount: must be a number (got "")'),
    ("planner.discount=[", "is not YAML: expected the node content, but found '<stream end>'"),
    ("schema_version=3", "schema_version: must be 1, the version that this program reads (got 3)"),
]


@pytest.mark.parametrize(("option", "expected"), OPTIONS)
@pytest.mark.usefixtures("lab")
def test_wrong_options_are_named_as_options(option: str, expected: str) -> None:
    assert problems(option) == [f"--set {option}: {expected}"]


@pytest.mark.usefixtures("lab")
def test_a_file_without_end_is_given_up() -> None:
    expected = "/dev/zero: is larger than 1000000 bytes: not a settings file"
    assert problems(name="/dev/zero") == [expected]
    assert expected in problems("cameras.ceiling.calibration=/dev/zero")[0]


@pytest.mark.timeout(20)
def test_a_pipe_that_nobody_writes_to_is_not_waited_for(lab: Path) -> None:
    os.mkfifo(lab / "pipe.yaml")
    assert problems(name="pipe.yaml") == ["pipe.yaml: is empty"]


@pytest.mark.usefixtures("lab")
def test_a_field_may_come_out_of_a_pipe() -> None:
    read, write = os.pipe()
    os.write(write, GOOD.replace("discount: 0.9", "discount: 2").encode())
    os.close(write)
    assert any("planner.discount" in problem for problem in problems(name=f"/dev/fd/{read}"))
    os.close(read)


@pytest.mark.usefixtures("lab")
def test_wrong_options_and_wrong_lines_are_named_together() -> None:
    Path("lab.yaml").write_text(GOOD.replace("discount: 0.9", "discount: 2"), encoding="utf-8")
    found = problems("site=Lab", "drones.drone_7=null")
    assert [problem.split(":")[0] for problem in found] == [
        "--set drones.drone_7=null",
        "--set site=Lab",
        "lab.yaml",
    ]


@pytest.mark.parametrize("index", ["²", "①", "9" * 5000, "-1", "2"])
def test_an_index_that_is_none_is_refused_with_the_length_of_the_list(index: str) -> None:
    with pytest.raises(SettingsError, match=r"is a list of 2, .* is not in it"):
        load_field(find_field("lab"), [f"drones.drone_1.pad_m.{index}=1"])


def test_dictionaries_that_begin_alike_share_their_tags() -> None:
    """OpenCV's DICT_4X4_50 is the first half of DICT_4X4_100: one print would be seen as both."""
    tags = {"drone_1": ("DICT_4X4_50", 7), "drone_2": ("DICT_4X4_100", 7)}
    options = [
        f"drones.{name}.marker={{kind: aruco, dictionary: {dictionary}, id: {number}, size_mm: 168}}"
        for name, (dictionary, number) in tags.items()
    ]
    with pytest.raises(SettingsError, match="marker code DICT_4X4 7 is already that of drone_1"):
        load_field(find_field("lab"), ["defaults.marker=null", *options])
