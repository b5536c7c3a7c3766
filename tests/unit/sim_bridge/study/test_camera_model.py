"""At message level a fixed camera observes what its settings say, as at the wire."""

import msgspec
import pytest

from groundstation.field.resolved import ResolvedField
from sim_bridge.scenario import parse_scenario
from sim_bridge.site import parse_site
from sim_bridge.study.camera_model import eyes_of
from sim_bridge.world.world import World


@pytest.mark.parametrize(
    ("observes", "seen"),
    [
        (("robots",), {"drone_1"}),
        (("robots", "targets"), {"drone_1", "turtlebot"}),
        (("targets",), {"turtlebot"}),
    ],
)
def test_a_fixed_camera_reports_what_it_observes(
    lab_field: ResolvedField, observes: tuple[str, ...], seen: set[str]
) -> None:
    ceiling = msgspec.structs.replace(lab_field.cameras["ceiling"], observes=observes)
    field = msgspec.structs.replace(lab_field, cameras={"ceiling": ceiling})
    site = parse_site(msgspec.to_builtins(field))
    scenario = parse_scenario('{"schema_version": 1, "cameras": {"frame_loss": 0.0, "mounting_errors": false}}')
    world = World(site, scenario, 1)
    drone = world.drones["drone_1"].airframe
    (drone.x, drone.y), drone.z = ceiling.position_m[:2], 1.3
    world.drones["drone_2"].airframe.x = 9.0
    world.targets["turtlebot"].place(ceiling.position_m[0] + 0.5, ceiling.position_m[1])
    eye = eyes_of(site, scenario.cameras, 0.0, 1)[0]
    assert {sighting.subject for sighting in eye.look(world, 0, "c")} == seen
