"""Delay calibration in a field without a fixed camera: it names the delays that cannot be measured, with the reason."""

from pathlib import Path

import pytest

from groundstation.bus.messages import Header, RelativeObservation
from groundstation.calibration.delay import delays
from groundstation.calibration.flown import Flown
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

CONFIG = Path(__file__).parents[3] / "config"


@pytest.mark.parametrize("name", ["mocap-lab", "uwb-lab"])
def test_a_field_without_a_fixed_camera_is_told_what_cannot_be_measured(name: str) -> None:
    field = resolved_field(load_field(CONFIG / f"{name}.yaml", ()))
    seen = RelativeObservation(
        header=Header(10**9, "here", "mocap", "mocap", 1),
        observer="mocap",
        subject="drone_1",
        camera="mocap",
        position_m=(0.0, 0.0, 1.0),
        yaw_rad=None,
        covariance=(1e-4, 0.0, 0.0, 0.0, 1e-4, 0.0, 0.0, 0.0, 1e-4),
    )
    found = delays(Flown(((10**9, (("key", seen),)),), "here"), field)
    told = {one.sensor: one.reason for one in found}
    assert told["drone_1 velocity"] == told["drone_1 height"] == "no fixed camera saw it long enough"
    assert told["drone_1 camera"] == "it saw too little"
