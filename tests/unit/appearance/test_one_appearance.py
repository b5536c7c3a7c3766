"""Console, report, plots, pictures, Rerun and Foxglove show a name in the same colour."""

import struct

import msgspec
import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from groundstation.appearance.colours import Colour, colours_of, rgb
from groundstation.bus import messages as m
from groundstation.bus.topics import OBSERVATION
from groundstation.console.room import scene_from_field
from groundstation.field.resolved import ResolvedField
from groundstation.recording.capture import Entry
from groundstation.recording.derived import ViewerChannels
from groundstation.recording.protobuf import fields
from groundstation.recording.schemas import description_of
from groundstation.report.page.flight_charts import flight_charts
from groundstation.report.plot_map import draw_map
from groundstation.report.run_facts import RunFacts
from groundstation.report.tracks import EstimateTrack, RunData

NAMES = ("drone_2", "drone_1", "turtlebot")
HEADER = m.Header(0, "c", "team", "tracker", 1)


@pytest.fixture(scope="module")
def field(lab_field: ResolvedField) -> ResolvedField:
    """The shipped field with its drones in another order: no view may sort them."""
    return msgspec.structs.replace(lab_field, drones=dict(reversed(lab_field.drones.items())))


@pytest.fixture(scope="module")
def expected(field: ResolvedField) -> dict[str, Colour]:
    found = colours_of(field.drones, field.tracked)
    assert tuple(found) == NAMES
    return found


def estimate() -> m.Estimate:
    def entity(name: str) -> m.EntityEstimate:
        size = 2 if name == "turtlebot" else 4
        covariance = tuple(np.eye(size).flatten().tolist())
        kind = "target" if size == 2 else "robot"
        return m.EntityEstimate(name, kind, (0.0,) * size, covariance, (0.0,) * min(size, 3), True, 0.0)

    return m.Estimate(header=HEADER, entities=tuple(map(entity, NAMES)), epoch=0)


def inner(data: bytes, *path: int) -> bytes:
    """Return the first field at a path of numbers in a protobuf message."""
    for number in path:
        data = next(value for found, value in fields(data) if found == number and isinstance(value, bytes))
    return data


def shade_of(data: bytes) -> tuple[int, ...]:
    """Return red, green and blue of a foxglove.Color; zeros may be left out."""
    parts = {number: struct.unpack("<d", value)[0] for number, value in fields(data) if isinstance(value, bytes)}
    return tuple(round(255 * parts.get(number, 0.0)) for number in (1, 2, 3))


def test_the_console(field: ResolvedField, expected: dict[str, Colour]) -> None:
    assert scene_from_field(field, truth=False)["colours"] == msgspec.to_builtins(expected)


def test_the_report_and_its_plots(field: ResolvedField, expected: dict[str, Colour]) -> None:
    data = RunData(field, RunFacts(), end_s=1.0)
    for name in NAMES:
        size = 2 if name == "turtlebot" else 4
        places, covariance = np.zeros((2, size)), np.stack([np.eye(size)] * 2)
        data.estimates[name] = EstimateTrack("", np.array([0.0, 1.0]), places, covariance)
    (beliefs,) = (chart for chart in flight_charts(data, 0.0, 1.0) if chart.title == "Estimated uncertainty")
    assert {curve.label: curve.color for curve in beliefs.curves} == expected
    axes = Figure().add_subplot()
    draw_map(axes, data)
    legend = axes.get_legend()
    assert legend is not None
    drawn = {line.get_label(): to_hex(line.get_color()) for line in legend.get_lines()}
    assert {name: drawn[name] for name in NAMES} == {name: colour.light for name, colour in expected.items()}


def test_names_in_pictures(field: ResolvedField, expected: dict[str, Colour]) -> None:
    channels = ViewerChannels(field)
    for stamp_ns, name in enumerate(NAMES):
        header = msgspec.structs.replace(HEADER, stamp_ns=stamp_ns, entity="ceiling")
        sighting = m.RelativeObservation(
            header=header, observer="ceiling", subject=name, camera="ceiling", position_m=(0.0, 0.0, 3.0),
            yaw_rad=None, covariance=(0.0,) * 9,
        )  # fmt: skip
        facts = {"topic": OBSERVATION.name, "entity": "ceiling"}
        data, described = msgspec.json.encode(sighting), description_of(OBSERVATION)
        (made,) = channels.derived(Entry("gs/x", 7, 7, 0, data, described, facts))
        assert shade_of(inner(made.data, 1, 6)) == rgb(expected[name].dark)


def test_foxglove(field: ResolvedField, expected: dict[str, Colour]) -> None:
    pytest.importorskip("foxglove")
    from groundstation.engineering_views.foxglove_scene import FoxgloveScene

    update = FoxgloveScene(field).take(0, estimate())
    assert update is not None
    # WIRE (foxglove/schemas, proto): SceneUpdate.entities 2; SceneEntity.id 3, .cubes 8; CubePrimitive.color 3.
    bodies = [body for number, body in fields(update) if number == 2 and isinstance(body, bytes)]
    drawn = {inner(body, 3).decode(): body for body in bodies}
    found = {name: shade_of(inner(drawn[name], 8, 3)) for name in NAMES}
    assert found == {name: rgb(colour.dark) for name, colour in expected.items()}


def test_rerun(field: ResolvedField, expected: dict[str, Colour]) -> None:
    rr = pytest.importorskip("rerun")
    from groundstation.engineering_views.rerun_scene import RerunScene

    scene, boxes = RerunScene(rr.RecordingStream("test"), field, 0), {}
    scene._log = lambda path, *parts, static=False: boxes.update({path: parts[0]})  # type: ignore[method-assign]
    scene.take(0, estimate())
    for name, colour in expected.items():
        (packed,) = boxes[f"world/{name}/body"].colors.as_arrow_array().to_pylist()
        assert tuple(packed.to_bytes(4, "big")[:3]) == rgb(colour.dark)
