"""Trajectories for viewers: the last ten seconds of each body, once a second, and nothing older."""

from pathlib import Path

from mcap.reader import make_reader

from groundstation.recording.synthetic import write_run
from groundstation.recording.trajectories import Trajectories
from groundstation.recording.viewers import Transform, is_for_viewers
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.time_units import NS_PER_S

STEP_NS = NS_PER_S // 10


def body(name: str, x: float) -> Transform:
    return Transform("world", name, (x, 0.0, 1.0), (1.0, 0.0, 0.0, 0.0))


def lived(trajectories: Trajectories, from_step: int, to_step: int, *names: str) -> list[dict[str, list[float]]]:
    """Return the published trajectories, as the x of their poses: each body is at its step number."""
    found = []
    for step in range(from_step, to_step):
        given = trajectories.take(step * STEP_NS, [body(name, float(step)) for name in names])
        if given:
            found.append({name: [pose.position_m[0] for pose in poses] for name, poses in given.items()})
    return found


def test_the_last_ten_seconds_are_handed_out_once_a_second() -> None:
    found = lived(Trajectories(), 0, 151, "drone_1")
    assert len(found) == 16
    assert found[1]["drone_1"] == [0.0, 2.0, 4.0, 6.0, 8.0, 10.0], "five a second"
    assert found[15]["drone_1"] == [float(step) for step in range(50, 151, 2)]


def test_the_trajectory_of_a_body_no_longer_estimated_fades() -> None:
    trajectories = Trajectories()
    lived(trajectories, 0, 50, "drone_1", "drone_2")
    found = lived(trajectories, 50, 200, "drone_1")
    lengths = [len(one["drone_2"]) for one in found if "drone_2" in one]
    assert lengths == sorted(lengths, reverse=True) and lengths[-1] == 0
    assert "drone_2" not in found[-1] and len(found[-1]["drone_1"]) == 51


def test_a_clock_that_goes_back_begins_anew() -> None:
    trajectories = Trajectories()
    lived(trajectories, 100, 131, "drone_1")
    assert lived(trajectories, 50, 61, "drone_1") == [
        {"drone_1": [50.0]},
        {"drone_1": [50.0, 52.0, 54.0, 56.0, 58.0, 60.0]},
    ]


def test_a_recording_has_one_of_each_body(tmp_path: Path) -> None:
    write_run(tmp_path, load_field(find_field("lab"), ()).model_dump_json().encode(), 2.5)
    with (tmp_path / "state.mcap").open("rb") as stream:
        said = [
            (channel.topic, schema.name)
            for schema, channel, _ in make_reader(stream).iter_messages()
            if schema is not None and channel.topic.startswith("/trajectory/")
        ]
    names = {f"/trajectory/{name}" for name in ("drone_1", "drone_2", "turtlebot")}
    assert set(said) == {(name, "foxglove.PosesInFrame") for name in names}
    assert len(said) == 3 * 3 and all(map(is_for_viewers, names))
