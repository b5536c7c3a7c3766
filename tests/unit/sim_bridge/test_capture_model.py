"""Motion capture at message level: poses of bodies in the system's axes, and only inside its box."""

import math
from typing import Any

import numpy as np

from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.site import SiteCapture
from sim_bridge.study.capture_model import CaptureEye

BOX = {"x_m": (-1.0, 1.0), "y_m": (-1.0, 1.0), "z_m": (-0.1, 2.0)}


class Room:
    """A sensor model's view of a world: one drone inside of the box, one outside, a target."""

    bodies = ("drone_1", "drone_2", "cart")
    time_s = 5.0

    def states(self) -> np.ndarray:
        rows = np.zeros((3, 13))
        rows[0, [0, 2, 8]], rows[1, 0], rows[2, 1] = (0.5, 1.5, 0.4), 1.2, 0.3
        return rows


class Layout:
    """A sensor model's view of a site."""

    def __init__(self, **system: object) -> None:
        self.motion_capture = {"mocap": SiteCapture.model_validate({"volume_m": BOX, "pose_std_m": 1e-6} | system)}
        self.truth: dict[str, str] = {}
        marker = type("Marker", (), {"position_m": (0.0, 0.0, 0.1), "height_m": 0.4})
        carrier = type("Carrier", (), {"marker": marker})
        self.drones = {"drone_1": carrier, "drone_2": carrier}
        self.tracked = {"cart": carrier}


ROOM: Any = Room()


def eye_of(layout: Any, *, errors: bool) -> CaptureEye:
    return CaptureEye("mocap", layout, errors, np.random.default_rng(1))


def test_bodies_in_the_box_are_reported_at_their_markers() -> None:
    eye = eye_of(Layout(heading_std_deg=1e-3), errors=False)
    (seen,) = eye.look(ROOM, 10, "c")
    assert (seen.observer, seen.subject, seen.header.stamp_ns) == ("mocap", "drone_1", 10)
    assert np.allclose(seen.position_m, (0.5, 0.0, 1.6), atol=1e-3) and seen.yaw_rad is not None
    assert abs(seen.yaw_rad - 0.4) < 1e-3
    assert math.isclose(eye.period_s, 1 / 30) and eye.searched([seen], 10, "c") is None


def test_targets_are_reported_where_it_observes_them_and_axes_may_be_off() -> None:
    layout = Layout(observes=("robots", "targets"), position_std_m=0.1, attitude_std_deg=1.0)
    straight = eye_of(layout, errors=False).look(ROOM, 10, "c")
    assert [one.subject for one in straight] == ["drone_1", "cart"]
    assert np.allclose(straight[1].position_m, (0.0, 0.3, 0.4), atol=0.05)
    off = eye_of(layout, errors=True).look(ROOM, 10, "c")
    assert 0.01 < math.dist(off[0].position_m, straight[0].position_m) < 0.5


def test_a_turned_body_has_another_heading_in_its_place_while_the_fault_lasts() -> None:
    layout: Any = Layout(heading_std_deg=1e-3)
    yaws = []
    for start_s in (4.0, 6.0):
        faults = [Fault(kind=FaultKind.BODY_TURNED, entity="drone_1", start_s=start_s, value=90.0)]
        (seen,) = CaptureEye("mocap", layout, False, np.random.default_rng(1), faults).look(ROOM, 10, "c")
        assert np.allclose(seen.position_m, (0.5, 0.0, 1.6), atol=1e-3) and seen.yaw_rad is not None
        yaws.append(seen.yaw_rad)
    assert np.allclose(yaws, (0.4 + math.pi / 2, 0.4), atol=1e-3)
