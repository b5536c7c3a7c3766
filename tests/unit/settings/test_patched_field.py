"""A field file with some settings changed: comments stay, what was looked up becomes content, and it can be read."""

from pathlib import Path

import pytest

from groundstation.errors import OperatorMistake
from groundstation.settings.load import load_field
from groundstation.settings.patched import fragment, write_patched

CONFIG = Path(__file__).parents[3] / "config"


def test_changed_settings_are_read_back_and_comments_stay(tmp_path: Path) -> None:
    text = (CONFIG / "lab.yaml").read_text(encoding="utf-8").replace("cameras/", f"{CONFIG}/cameras/")
    resolved = load_field(CONFIG / "lab.yaml").model_dump(mode="json")
    changes = {
        ("drones", "drone_1", "camera", "tilt_down_deg"): 48.1,
        ("cameras", "ceiling", "calibration", "fx_px"): 1000.0,
        ("cameras", "ceiling", "position_m"): [0.2, 0.0, 4.2],
    }
    written = tmp_path / "lab-new.yaml"
    write_patched(written, text, changes, resolved)
    field = load_field(written)
    assert field.drones["drone_1"].camera.tilt_down_deg == 48.1
    assert field.drones["drone_2"].camera.tilt_down_deg == 45.0
    assert field.cameras["ceiling"].calibration.fx_px == 1000.0
    assert field.cameras["ceiling"].position_m == (0.2, 0.0, 4.2)
    assert "# toward the parked target" in written.read_text(encoding="utf-8")


def test_a_patch_that_loses_its_calibrations_is_told_with_the_remedy(tmp_path: Path) -> None:
    text = (CONFIG / "lab.yaml").read_text(encoding="utf-8")
    with pytest.raises(OperatorMistake, match="beside the field file"):
        write_patched(tmp_path / "lab-new.yaml", text, {("drones", "drone_1", "pad_yaw_deg"): 1.0}, {})


def test_the_patch_alone_is_short() -> None:
    assert fragment({("drones", "drone_1", "camera", "pan_left_deg"): 2.9}).split() == [
        "drones:",
        "drone_1:",
        "camera:",
        "pan_left_deg:",
        "2.9",
    ]
