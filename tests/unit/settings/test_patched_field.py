"""A field file with some settings changed: comments stay, looked-up files become content, and it can be read."""

from pathlib import Path

import pytest

from groundstation.errors import OperatorMistake
from groundstation.settings.load import load_field
from groundstation.settings.patched import Changes, fragment, write_patched

CONFIG = Path(__file__).parents[3] / "config"


def test_changed_settings_are_read_back_and_comments_stay(tmp_path: Path) -> None:
    text = (CONFIG / "lab.yaml").read_text(encoding="utf-8").replace("cameras/", f"{CONFIG}/cameras/")
    resolved = load_field(CONFIG / "lab.yaml").model_dump(mode="json")
    changes = {
        ("drones", "drone_1", "camera", "tilt_down_deg"): 48.1,
        ("cameras", "ceiling", "calibration", "fx_px"): 1000.0,
        ("cameras", "ceiling", "calibration", "fy_px"): 1001.0,
        ("cameras", "ceiling", "position_m"): [0.2, 0.0, 4.2],
    }
    written = tmp_path / "lab-new.yaml"
    write_patched(written, text, changes, resolved)
    field = load_field(written)
    assert field.drones["drone_1"].camera.tilt_down_deg == 48.1
    assert field.drones["drone_2"].camera.tilt_down_deg == 45.0
    assert field.cameras["ceiling"].calibration.fx_px == 1000.0
    assert field.cameras["ceiling"].position_m == (0.2, 0.0, 4.2)
    assert "# towards the parked target" in written.read_text(encoding="utf-8")


def test_a_patch_that_loses_its_calibrations_is_told_with_the_remedy(tmp_path: Path) -> None:
    text = (CONFIG / "lab.yaml").read_text(encoding="utf-8")
    with pytest.raises(OperatorMistake, match="beside the field file"):
        write_patched(tmp_path / "lab-new.yaml", text, {("drones", "drone_1", "pad_yaw_deg"): 1.0}, {})


def test_a_value_that_the_field_refuses_is_told_without_a_remedy_for_something_else(tmp_path: Path) -> None:
    text = (CONFIG / "lab.yaml").read_text(encoding="utf-8").replace("cameras/", f"{CONFIG}/cameras/")
    with pytest.raises(OperatorMistake, match="must be <= 180") as refused:
        write_patched(tmp_path / "new.yaml", text, {("drones", "drone_1", "camera", "pan_left_deg"): 182.0}, {})
    assert "beside" not in str(refused.value)


def test_a_field_file_with_the_mark_of_its_end_can_be_patched(tmp_path: Path) -> None:
    text = (CONFIG / "lab.yaml").read_text(encoding="utf-8").replace("cameras/", f"{CONFIG}/cameras/") + "---\n"
    write_patched(tmp_path / "new.yaml", text, {("drones", "drone_1", "camera", "pan_left_deg"): 2.0}, {})
    assert load_field(tmp_path / "new.yaml").drones["drone_1"].camera.pan_left_deg == 2.0


def test_the_patch_alone_is_short() -> None:
    assert fragment({("drones", "drone_1", "camera", "pan_left_deg"): 2.9}).split() == [
        "drones:",
        "drone_1:",
        "camera:",
        "pan_left_deg:",
        "2.9",
    ]


def test_an_alias_elsewhere_keeps_what_it_says(tmp_path: Path) -> None:
    """Two drones share a mounting by a YAML alias: only the measured one is changed."""
    text = (CONFIG / "lab.yaml").read_text(encoding="utf-8").replace("cameras/", f"{CONFIG}/cameras/")
    resolved = load_field(CONFIG / "lab.yaml")
    first, second = (f'camera: {{source: "{resolved.drones[name].camera.source}"}}' for name in ("drone_1", "drone_2"))
    assert first in text and second in text
    text = text.replace(first, "camera: &mount {tilt_down_deg: 40.0, source: /dev/video8}")
    text = text.replace(second, "camera: *mount").replace(
        "source: http://192.168.1.50:8080/video.mjpg", "source: /dev/video9"
    )
    written = tmp_path / "lab-new.yaml"
    changes: Changes = {
        ("drones", "drone_2", "camera", "source"): "/dev/video7",
        ("drones", "drone_1", "camera", "tilt_down_deg"): 48.1,
    }
    write_patched(written, text, changes, resolved.model_dump(mode="json"))
    field = load_field(written)
    assert (field.drones["drone_1"].camera.tilt_down_deg, field.drones["drone_1"].camera.source) == (
        48.1,
        "/dev/video8",
    )
    assert (field.drones["drone_2"].camera.tilt_down_deg, field.drones["drone_2"].camera.source) == (
        40.0,
        "/dev/video7",
    )


def test_a_patch_that_cannot_be_used_leaves_the_file_that_stands_there(tmp_path: Path) -> None:
    own = tmp_path / "lab.yaml"
    own.write_text("mine\n", encoding="utf-8")
    with pytest.raises(OperatorMistake, match=r"lab.yaml: is not written, it could not be used \(.*lab.yaml"):
        write_patched(own, (CONFIG / "lab.yaml").read_text(encoding="utf-8"), {("site",): "no site"}, {})
    assert own.read_text(encoding="utf-8") == "mine\n"
    assert list(tmp_path.iterdir()) == [own]
