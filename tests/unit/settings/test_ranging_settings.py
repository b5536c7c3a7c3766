"""Ranging in a field file: refusals, values for driver, estimator and planner, and listings."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from drivers.ranging.settings import RangingSection
from groundstation.errors import SettingsError
from groundstation.estimation.models import Anchor, RangeSensor
from groundstation.estimation.parameters import parameters_from_field
from groundstation.field.room import Ranging
from groundstation.flight.composition import process_table
from groundstation.flight.flight_plan import plan_of
from groundstation.sensing.from_field import sensors_from_field
from groundstation.settings.cautions import cautions
from groundstation.settings.load import load_field
from groundstation.settings.ranging import RangingSettings
from groundstation.settings.ranging_checks import findings_of_lines
from groundstation.settings.resolved import resolved_field, summary_of
from groundstation.settings.sections import driver_sections, rerouted

FIELD = Path(__file__).parents[3] / "config" / "uwb-lab.yaml"


@pytest.mark.parametrize(
    ("option", "told"),
    [
        ("ranging.uwb.source=udp://1.2.3.4", "ranging.uwb.source: must be the address of a gateway"),
        ("ranging.uwb.anchors={a1: [0.0, 0.0, 1.0]}", "ranging.uwb.anchors"),
        ("ranging.uwb.anchors.a1=[9.0, 0.0, 1.0]", "ranging.uwb.anchors.a1: must be inside the room"),
        (
            "ranging.uwb.anchors={a: [-3, -2, 2], b: [-3, -2, 2.05], c: [3, 2, 0.5], d: [-3, 2, 3]}",
            "ranging.uwb.anchors.b: is where a is",
        ),
        (
            "ranging.uwb.anchors={a: [-3, 0, 2.6], b: [-1, 0.1, 2.6], c: [1, 0, 2.5], d: [3, 0, 2.6]}",
            "ranging.uwb.anchors: lie nearly in one line: ranges tell a circle around it, no place, and nothing else",
        ),
        ("ranging.uwb.transponders.ghost={}", "ghost is no drone of the field"),
        ("ranging.uwb.transponders={drone_1: {name: a}, drone_2: {name: a}}", "the transponder's name a is already"),
        ("ranging.uwb.transponders={drone_1: {name: drone_2}}", "name drone_2 is already that of drone_2"),
        ("truth.from=uwb", "truth.from: must name a motion capture system of the field"),
        ("target.name=uwb_a1_drone_1", "the name uwb_a1_drone_1 is already"),
        ("ranging.uwb.host=uwb", "must not be called as a device of the field"),
    ],
)
def test_a_wrong_system_is_refused_with_its_place(option: str, told: str) -> None:
    with pytest.raises(SettingsError) as refused:
        load_field(FIELD, (option,))
    assert told in str(refused.value)


@pytest.mark.parametrize(
    ("option", "place", "words"),
    [
        ("ranging.uwb.anchors={a: [-3, -2, 2], b: [3, -2, 2], c: [3, 2, 2], d: [-3, 2, 2]}", "anchors", "along z"),
        ("ranging.uwb.anchors={a: [-3, 0, 0.2], b: [3, 0, 2], c: [3, 0, 4], d: [-3, 0, 2]}", "anchors", "along y"),
        ("ranging.uwb.volume_m.x_m=[-3500, 3500]", "volume_m.x_m", "is this in metres?"),
        ("ranging.uwb.volume_m.z_m=[0, 0.5]", "volume_m.z_m", "leaves out 1.1 m (got 0 to 0.5), where drones fly"),
        ("ranging.uwb.volume_m.z_m=[1, 3]", "volume_m.z_m", "leaves out 0.14 m (got 1 to 3), where drones stand"),
        ("ranging.uwb.range_std_m=1e-12", "range_std_m", "no radio measures so well"),
    ],
)
def test_anchors_and_boxes_that_fly_badly_are_warned_of(option: str, place: str, words: str) -> None:
    found = [(".".join(map(str, path)), text) for path, text in cautions(load_field(FIELD, (option,)))]
    assert [path for path, _ in found] == [f"ranging.uwb.{place}"] and words in found[0][1]


LINE = "ranging.uwb.anchors={a: [-3, 0, 2.6], b: [-1, 0, 2.6], c: [1, 0, 2.6], d: [3, 0, 2.6]}"
CEILING = (
    "{source: 'http://192.168.1.50:8080/', calibration: cameras/ceiling.yaml, position_m: [0, 0, 4.2], "
    "looking: down, video_delay_ms: 120, observes: [%s]}"
)


@pytest.mark.parametrize(("observes", "flies"), [("robots", True), ("targets", False)])
def test_anchors_in_one_line_fly_only_beside_another_sensor_that_locates_drones(observes: str, flies: bool) -> None:
    options = (LINE, f"cameras.ceiling={CEILING % observes}")
    if flies:
        found = [text for path, text in cautions(load_field(FIELD, options)) if path == ("ranging", "uwb", "anchors")]
        assert found == ["lie nearly in one line: ranges tell a circle around it, and no place"]
    else:
        with pytest.raises(SettingsError, match="nothing else fixed locates drones"):
            load_field(FIELD, options)


def test_a_second_system_may_tell_what_anchors_in_one_line_do_not() -> None:
    beside = (LINE, f"cameras.ceiling={CEILING % 'robots'}")
    whole, line = load_field(FIELD).ranging["uwb"], load_field(FIELD, beside).ranging["uwb"]
    assert list(findings_of_lines({"uwb": line, "radio": whole})) == []
    assert [path for path, _ in findings_of_lines({"uwb": line, "radio": line})] == [
        ("ranging", "uwb", "anchors"),
        ("ranging", "radio", "anchors"),
    ]


def test_a_transponder_of_a_drone_that_does_not_fly_is_free_for_another() -> None:
    assert load_field(FIELD, ("drones.drone_2.enabled=false", "ranging.uwb.transponders={drone_1: {name: drone_2}}"))


def test_a_field_may_be_rooted_in_it_and_its_driver_gets_its_part(tmp_path: Path) -> None:
    field = load_field(FIELD, ("ranging.uwb.transponders.drone_1.name=deck_85",))
    assert not list(cautions(field))
    moved = rerouted(field, {}, {}, captures={"uwb": ("127.64.1.60", 8080)})
    table = {one.name: one for one in process_table(moved, "tcp/127.0.0.1:1", tmp_path, simulation=None, monitor=False)}
    assert table["uwb"].entry == "drivers.ranging.driver:run" and table["uwb"].role == "camera"
    own = RangingSection.model_validate_json(table["uwb"].section)
    assert own.source == "ranges://127.64.1.60:8080" and len(own.anchors) == 6
    assert [(one.entity, one.name) for one in own.transponders] == [("drone_1", "deck_85"), ("drone_2", "drone_2")]
    assert "uwb" in plan_of(field, None, asks=False).cameras
    assert "ranging uwb: ranges://192.168.1.6, 6 anchors, observes drones" in summary_of(field)
    assert [one.host for one in driver_sections(field) if one.name == "uwb"] == [""]


def test_the_estimator_has_a_bias_and_a_sensor_for_each_pair() -> None:
    parameters = parameters_from_field(resolved_field(load_field(FIELD)))
    anchors = {name: one for name, one in parameters.entities.items() if isinstance(one, Anchor)}
    assert anchors["uwb_a5_drone_1"].place_m == (0.0, -2.9, 0.2) and len(anchors) == 12
    sensors = [one for one in parameters.sensors.values() if isinstance(one, RangeSensor)]
    assert len(sensors) == 12 and {one.transponder_m for one in sensors} == {(-0.05, 0.0, 0.05)}
    assert parameters.ranging["uwb"]["drone_2"].pad_yaw_rad == pytest.approx(math.radians(48))


@pytest.mark.parametrize(
    ("worse", "by"), [("range_std_m=0.3", 2.0), ("bias_std_m=0.3", 2.0), ("rate_hz=1", 2.0), ("reach_m=7", 1.2)]
)
def test_plans_count_on_its_box_and_on_less_where_it_measures_less(worse: str, by: float) -> None:
    def model(*options: str):
        return sensors_from_field(resolved_field(load_field(FIELD, options))).world["uwb"]

    usual = model()
    assert usual.view.margin(usual.optical(np.array([3.3, 2.4, 1.0]))) > 0.0
    assert usual.view.margin(usual.optical(np.array([3.6, 0.0, 1.0]))) < 0.0
    assert not usual.observes_targets and usual.noise.yaw_rad > 3.0
    assert 0.04 < usual.noise.position_std_m(1.0) < model(f"ranging.uwb.{worse}").noise.position_std_m(1.0) / by


def test_field_and_settings_have_the_same_defaults() -> None:
    anchors = {f"a{i}": [0, 0, 0] for i in range(4)}
    box = {"x_m": [0, 1], "y_m": [0, 1], "z_m": [0, 1]}
    text = json.dumps({"source": "ranges://1.2.3.4", "anchors": anchors, "volume_m": box})
    written = RangingSettings.model_validate_json(text).model_dump()
    names = Ranging.__struct_fields__[3:]
    for name in set(names) - {"transponders"}:
        assert written[name] == Ranging.__struct_defaults__[names.index(name)], name
