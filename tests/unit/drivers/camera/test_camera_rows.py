"""A rolling shutter exposes the rows above the picture's middle before it, and those below after it."""

import numpy as np
import pytest

from drivers.camera.convert import row_ns
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.settings.sections import driver_sections


@pytest.mark.parametrize(
    ("row", "readout_ms", "later_ns"), [(0.0, 30.0, -15e6), (180.0, 30.0, 0.0), (360.0, 30.0, 15e6), (360.0, 0.0, 0.0)]
)
def test_a_row_is_later_by_its_share_of_the_readout(row: float, readout_ms: float, later_ns: float) -> None:
    corners = np.array([[10.0, row - 5.0], [700.0, row + 5.0]])
    assert row_ns(corners, 360, readout_ms) == later_ns


def test_the_setting_reaches_the_drivers_of_both_kinds_of_cameras() -> None:
    changes = ("cameras.ceiling.readout_ms=20", "drones.drone_1.camera.readout_ms=28")
    sections = {one.name: one.section for one in driver_sections(load_field(find_field("lab"), changes))}
    assert '"readout_ms":20.0' in sections["ceiling"] and '"readout_ms":28.0' in sections["drone_1_camera"]
    assert '"readout_ms":0.0' in sections["drone_2_camera"]
