"""World-fixed sensors in the engineering views."""

from pathlib import Path

import msgspec
import pytest

from groundstation.bus import codec, keys
from groundstation.bus import messages as m
from groundstation.bus.api import Sample
from groundstation.bus.topics import ESTIMATE, SEARCH_MAP, Topic
from groundstation.engineering_views.scene import ViewScene
from groundstation.field.room import RoomObstacle
from groundstation.recording.copies import messages_of
from groundstation.recording.run import open_run
from groundstation.recording.timeline import Timeline
from groundstation.recording.viewers import SCENE_CHANNEL
from groundstation.recording.writing import RunWriter
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field
from groundstation.time_units import NS_PER_S

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
    whole, fewer = (FoxgloveScene(one)._static for one in (FIELD, bare))  # content of every update
    assert len(whole) == len(fewer) + 6  # two rings and four edges


def test_obstacles_are_drawn_as_boxes() -> None:
    pytest.importorskip("foxglove")
    from groundstation.engineering_views.foxglove_scene import FoxgloveScene

    table = RoomObstacle(centre_m=(1.0, -0.5), size_m=(0.6, 0.4, 0.75))
    cluttered = msgspec.structs.replace(FIELD, room=msgspec.structs.replace(FIELD.room, obstacles={"table": table}))
    assert ViewScene(cluttered).obstacles == {"table": ((0.7, 1.3), (-0.7, -0.3), (0.0, 0.75))}
    whole, fewer = (FoxgloveScene(one)._static for one in (cluttered, FIELD))
    assert len(whole) == len(fewer) + 6


def search_map() -> m.SearchMap:
    header = m.Header(0, "c", "turtlebot", "tracker", 1)
    return m.SearchMap(header=header, first_m=(-1.0, 2.0), cell_m=0.5, columns=2, chances=(255, 0, 3, 51))


def test_the_likely_cells_of_a_search_are_drawn_where_they_are() -> None:
    scene = ViewScene(FIELD)
    height = FIELD.tracked["turtlebot"].marker.height_m
    best, other = scene.cells(search_map())
    assert (best.centre_m, best.side_m, best.share) == ((-1.0, 2.0, height), 0.5, 1.0)
    assert (other.centre_m, other.share) == ((-0.5, 2.5, height), 0.2)


def test_foxglove_shows_where_a_target_is_searched_while_it_is() -> None:
    pytest.importorskip("foxglove")
    from groundstation.engineering_views.foxglove_scene import FoxgloveScene

    scene, header = FoxgloveScene(FIELD), m.Header(0, "c", "team", "tracker", 1)
    search = m.TargetSearch("turtlebot", "SEARCH", 2.0, (0.4, 0.0), 0.1, None, "searched for 2 s")
    assert scene.take(0, search_map()) is None
    during, after = (
        scene.take(at, m.Estimate(header=header, entities=(), epoch=0, searches=searches))
        for at, searches in ((0, (search,)), (NS_PER_S, ()))
    )
    assert during is not None and after is not None
    assert len(during) > len(after) + 2 * 40  # two cubes


def test_a_copy_for_foxglove_shows_where_a_target_was_searched(tmp_path: Path) -> None:
    pytest.importorskip("foxglove")
    from groundstation.engineering_views.foxglove_file import write_with_scene

    def sample(topic: Topic, message: m.Message) -> Sample:
        head = message.header
        return Sample(keys.expression("lab", topic, head.entity, head.source), codec.encode(message))

    header = m.Header(NS_PER_S, "c", "team", "tracker", 1)
    search = m.TargetSearch("turtlebot", "SEARCH", 2.0, (0.4, 0.0), 0.1, None, "searched for 2 s")
    estimate = sample(ESTIMATE, m.Estimate(header=header, entities=(), epoch=0, searches=(search,)))
    scene_bytes = []
    for name, samples in (("mapped", [sample(SEARCH_MAP, search_map()), estimate]), ("bare", [estimate])):
        writer = RunWriter(tmp_path / name, msgspec.json.encode(FIELD), 1, Timeline("c", 0))
        writer.write(samples, writer.state, NS_PER_S)
        writer.close()
        write_with_scene(open_run(tmp_path / name), tmp_path / f"{name}.mcap")
        index = open_run(tmp_path / f"{name}.mcap").indexes[0]
        scene_bytes += [len(one.data) for one in messages_of(index) if one.channel.topic == SCENE_CHANNEL]
    assert scene_bytes[0] > scene_bytes[1] + 2 * 40  # two cubes


def test_rerun_shows_where_a_target_is_searched_while_it_is() -> None:
    rr = pytest.importorskip("rerun")
    from groundstation.engineering_views.rerun_scene import RerunScene

    stream, header = rr.RecordingStream("test"), m.Header(0, "c", "team", "tracker", 1)
    scene, logged = RerunScene(stream, FIELD, 0), []
    scene._log = lambda path, *parts, static=False: logged.append((path, type(parts[0]).__name__))  # type: ignore[method-assign]
    search = m.TargetSearch("turtlebot", "SEARCH", 2.0, (0.4, 0.0), 0.1, None, "searched for 2 s")
    scene.take(0, search_map())
    for at, searches in ((0, (search,)), (NS_PER_S, ()), (2 * NS_PER_S, ())):
        scene.take(at, m.Estimate(header=header, entities=(), epoch=0, searches=searches))
    assert logged == [("world/searched/turtlebot", "Boxes3D"), ("world/searched/turtlebot", "Clear")]
