"""What engineering views draw of sensors that are fixed in the world."""

from pathlib import Path

import msgspec
import pytest

from groundstation.bus import messages as m
from groundstation.engineering_views.scene import ViewScene
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

FIELD = resolved_field(load_field(Path(__file__).parents[3] / "config/mocap-lab.yaml"))
BOX = FIELD.motion_capture["mocap"].volume_m


def test_motion_capture_has_its_volume_and_its_links_come_from_the_top_of_it() -> None:
    scene = ViewScene(FIELD)
    assert scene.volumes == {"mocap": (BOX.x_m, BOX.y_m, BOX.z_m)}
    mean, covariance = (0.5, 0.2, 1.6, 0.0), tuple(0.01 * (row == column) for row in range(4) for column in range(4))
    header = m.Header(0, "c", "team", "tracker", 1)
    drone = m.EntityEstimate("drone_1", "robot", mean, covariance, (0.0, 0.0, 0.0), converged=True, age_s=0.0)
    scene.take_estimate(m.Estimate(header=header, entities=(drone,), epoch=0))
    edge = m.Edge("mocap", "drone_1", 100.0)
    solver = m.SolverReport("OK", 1, 0.01, 1, 1)
    plan = m.Plan(
        header=header, topology="drone_1", cost=0.0, controls=(), edges=(edge,), alternatives=(), solver=solver, mode=""
    )
    (link,) = scene.links(plan)
    assert link.begin_m == (0.0, 0.0, BOX.z_m[1]) and link.end_m == mean[:3]


def test_foxglove_draws_the_volume_beside_room_and_fence() -> None:
    pytest.importorskip("foxglove")
    from groundstation.engineering_views.foxglove_scene import FoxgloveScene

    bare = msgspec.structs.replace(FIELD, motion_capture={})
    whole, fewer = (FoxgloveScene(one)._static for one in (FIELD, bare))  # what is in every update
    assert len(whole) == len(fewer) + 6  # two rings and four edges
