"""A field file from a few answers is valid for every room and team."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from groundstation.cli.new import new
from groundstation.errors import OperatorMistake, SettingsError
from groundstation.settings.load import cautions_of, load_field
from groundstation.settings.new_field import BASES, NewDrone, NewRoom, NewTarget, check_room, field_text, pads
from groundstation.settings.room_text import room_text

ARDRONE = NewDrone("ardrone", "192.168.1.11", "ardrone://192.168.1.11")
TURTLEBOT = NewTarget("turtlebot_2", 0.4)
SOURCE = "http://192.168.1.50:8080/video.mjpg"


@pytest.mark.parametrize(("size", "drones"), [((8, 6, 4.5), 3), ((6, 4, 3.2), 1), ((20, 15, 8), 9)])
def test_the_written_field_file_is_valid(tmp_path: Path, size: tuple[float, float, float], drones: int) -> None:
    answers = "\n".join([*map(str, size), "", str(drones), *(["", "", ""] * drones), "", "", "y", ""])
    result = CliRunner().invoke(new, [str(tmp_path / "hall")], input=answers)
    assert result.exit_code == 0, result.output
    field = load_field(tmp_path / "hall" / "hall.yaml")
    assert field.room.size_m == size and len(field.drones) == drones and field.site == "hall"


def test_each_lens_is_said_to_be_one_to_measure() -> None:
    text = field_text("lab", NewRoom(8, 6, 4.5, SOURCE), [NewDrone("px4", "192.168.1.11", SOURCE)], TURTLEBOT)
    lenses = [line for line in text.splitlines() if "calibration:" in line]
    assert len(lenses) == 2 and all("measure yours: groundstation calibrate camera" in line for line in lenses)


def test_kinds_may_be_mixed(tmp_path: Path) -> None:
    team = ["", "", "", "px4", "", "", "ardupilot", "", ""]
    result = CliRunner().invoke(
        new, [str(tmp_path / "hall")], input="\n".join(["", "", "", "", "3", *team, "", "", "y", ""])
    )
    assert result.exit_code == 0, result.output
    assert [drone.kind for drone in load_field(tmp_path / "hall" / "hall.yaml").drones.values()][1:] == ["mavlink"] * 2


def test_a_tello_is_met_at_its_access_point_and_shows_its_own_video(tmp_path: Path) -> None:
    answers = ["", "", "", "", "2", "tello", "", "", "", "", "", "", "", "y", ""]
    result = CliRunner().invoke(new, [str(tmp_path / "hall")], input="\n".join(answers))
    assert result.exit_code == 0, result.output
    path = tmp_path / "hall" / "hall.yaml"
    first, second = load_field(path).drones.values()
    assert (first.kind, first.address, first.camera.source) == ("tello", "192.168.10.1", "tello://192.168.10.1")
    assert (second.address, second.camera.source) == ("192.168.1.12", "tello://192.168.1.12")
    lens = first.camera.calibration
    assert (lens.width_px, lens.height_px) == (960, 720)
    assert [line for line in cautions_of(path) if "camera" in line] == []


def test_pads_are_a_metre_apart_in_the_cameras_view() -> None:
    room = NewRoom(8, 6, 4.5, SOURCE)
    places = pads(room, 4)
    apart = [((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2) ** 0.5 for a in places for b in places if a is not b]
    half = room.half_view_m(1.0)
    assert min(apart) >= 1.0 and all(abs(x) < half[0] and abs(y) < half[1] for x, y in places)
    with pytest.raises(OperatorMistake, match="room for"):
        pads(room, 40)


def test_pads_of_a_small_high_room_lie_inside_its_fence() -> None:
    """There the ceiling camera sees more than the floor."""
    room = NewRoom(4, 4, 10, SOURCE)
    assert all(max(abs(x), abs(y)) <= 1.4 for x, y in pads(room, 4))
    with pytest.raises(OperatorMistake, match="room for 9 pads, not for 10, inside the fence"):
        pads(room, 10)


def test_a_low_room_is_refused_with_the_reason() -> None:
    with pytest.raises(OperatorMistake, match="too low"):
        check_room(NewRoom(8, 6, 2.3, SOURCE))
    with pytest.raises(OperatorMistake, match="too low"):
        field_text("lab", NewRoom(8, 6, 2.3, SOURCE), [ARDRONE], TURTLEBOT)


@pytest.mark.parametrize(("height_m", "drones"), [(2.4, 1), (2.5, 2), (2.8, 2), (3.0, 2), (3.2, 2)])
def test_the_field_of_an_ordinary_room_has_no_warnings_of_its_own(tmp_path: Path, height_m: float, drones: int) -> None:
    answers = "\n".join(["7", "5", str(height_m), "", str(drones), *(["", "", ""] * drones), "", "", "y", ""])
    result = CliRunner().invoke(new, [str(tmp_path / "home")], input=answers)
    assert result.exit_code == 0, result.output
    file = tmp_path / "home" / "home.yaml"
    assert cautions_of(file) == []
    assert load_field(file).room.fence.z_m[1] == max(1.3, round(height_m - 1.7, 2))


def test_a_ceiling_out_of_bounds_is_asked_again_with_the_bound_and_another_way(tmp_path: Path) -> None:
    answers = ["7", "5", "2", "21", "2.5", "", "3", "2", *["", "", ""] * 2, "", "", "y", ""]
    result = CliRunner().invoke(new, [str(tmp_path / "home")], input="\n".join(answers))
    assert result.exit_code == 0, result.output
    by_hand = "groundstation config init writes a field file to edit). Once more:"
    assert f"a room 2 m high is too low: 2.4 m at least (for a lower one, {by_hand}" in result.output
    assert "a room 21 m high is too high: 20 m at most. Once more:" in result.output
    assert "there is room for 2 pads, not for 3, inside the fence where the ceiling camera sees them" in result.output
    assert f"take 2 drones (for a wider lens or more cameras, {by_hand}" in result.output


def test_the_drawing_shows_each_pad_within_the_view() -> None:
    drawing = room_text(NewRoom(8, 6, 4.5, SOURCE), 2)
    assert all(f".{number}." in drawing for number in (1, 2)) and len(set(map(len, drawing.splitlines()))) == 1


def test_an_existing_field_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "hall").mkdir()
    (tmp_path / "hall" / "hall.yaml").write_text("mine")
    result = CliRunner().invoke(new, [str(tmp_path / "hall")])
    assert isinstance(result.exception, OperatorMistake) and (tmp_path / "hall" / "hall.yaml").read_text() == "mine"


def test_a_refused_room_writes_nothing(tmp_path: Path) -> None:
    result = CliRunner().invoke(
        new, [str(tmp_path / "hall")], input="\n".join(["", "", "", "", "1", "", "", "", "", "", "n", ""])
    )
    assert isinstance(result.exception, OperatorMistake) and not (tmp_path / "hall").exists()


def test_the_target_says_what_it_is(tmp_path: Path) -> None:
    answers = ["", "", "", "", "1", "", "", "", "person", "", "y", ""]
    result = CliRunner().invoke(new, [str(tmp_path / "hall")], input="\n".join(answers))
    assert result.exit_code == 0, result.output
    target = load_field(tmp_path / "hall" / "hall.yaml").tracked["person"]
    assert (target.base, target.marker.height_m, target.max_speed_m_s) == ("person", BASES["person"], 1.5)


def test_impossible_answers_are_asked_again_and_the_others_kept(tmp_path: Path) -> None:
    """More pads than the camera can see, and a board that no camera looks down on."""
    room = ["8", "6", "4.5", "http://10.0.0.5/mjpg"]
    team = ["9", "1", "", "", "", "turtlebot_2", "3", "turtlebot_2", "0.4", "y", ""]
    result = CliRunner().invoke(new, [str(tmp_path / "hall")], input="\n".join([*room, *team]))
    assert result.exit_code == 0, result.output
    assert result.output.count("Once more:") == 2
    assert "http://10.0.0.5/mjpg" in (tmp_path / "hall" / "hall.yaml").read_text()


def test_a_board_too_high_to_look_down_on_is_refused() -> None:
    with pytest.raises(OperatorMistake, match=r"2 m above the floor .* 4\.5 m high: 1\.9"):
        field_text("lab", NewRoom(8, 6, 4.5, SOURCE), [ARDRONE], NewTarget("person", 2.0))


@pytest.mark.parametrize(
    ("folder", "site"),
    [("My Lab", "my_lab"), ("9lab", "lab_9lab"), ("été", "ete"), ("日本", "lab"), ("a-b", "a_b"), ("x" * 60, "x" * 40)],
)
def test_a_folder_of_any_name_makes_a_site(tmp_path: Path, folder: str, site: str) -> None:
    result = CliRunner().invoke(new, [str(tmp_path / folder)], input="\n" * 14)
    assert result.exit_code == 0, result.output
    assert load_field(tmp_path / folder / f"{folder}.yaml").site == site


def test_an_answer_that_cannot_be_is_asked_again(tmp_path: Path) -> None:
    room = ["nan", "8", "inf", "6", "4.5", "webcam", ""]
    drone = ["", "drone.local", "192.168.1.300", "192.168.1.11", "pictures", ""]
    result = CliRunner().invoke(
        new, [str(tmp_path / "hall")], input="\n".join([*room, "1", *drone, "", "nan", "0.4", "y", ""])
    )
    assert result.exit_code == 0, result.output
    assert load_field(tmp_path / "hall" / "hall.yaml").drones["drone_1"].address == "192.168.1.11"
    assert "must be an IPv4 address such as 192.168.1.11 (got 'drone.local')" in result.output


def test_a_drone_with_the_address_or_pictures_of_another_is_asked_for_again(tmp_path: Path) -> None:
    one, same_pictures = ["px4", "192.168.1.11", ""], ["", "192.168.1.12", "http://192.168.1.11:8080/video.mjpg"]
    answers = ["", "", "", "", "2", *one, *one, *same_pictures, "", "192.168.1.12", "", "", "", "y", ""]
    result = CliRunner().invoke(new, [str(tmp_path / "hall")], input="\n".join(answers))
    assert result.exit_code == 0, result.output
    assert "\naddress 192.168.1.11 is already that of drone_1; behind an adapter each" in result.output
    assert "\ncamera source http://192.168.1.11:8080/video.mjpg is already that of drone_1. Once" in result.output
    field = load_field(tmp_path / "hall" / "hall.yaml")
    assert [drone.address for drone in field.drones.values()] == ["192.168.1.11", "192.168.1.12"]


def test_answers_that_contradict_each_other_are_not_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("groundstation.cli.new._require_apart", lambda room, drones: None)
    one = ["", "192.168.1.11", ""]
    result = CliRunner().invoke(
        new, [str(tmp_path / "hall")], input="\n".join(["", "", "", "", "2", *one, *one, "", "", "y", ""])
    )
    assert isinstance(result.exception, SettingsError)
    assert "address 192.168.1.11 is already that of drone_1" in str(result.exception)
    assert str(result.exception).startswith("hall.yaml:") and not (tmp_path / "hall").exists()


def test_a_room_that_is_no_number_is_refused() -> None:
    with pytest.raises(OperatorMistake, match="must be numbers"):
        check_room(NewRoom(float("nan"), 6, 4.5, SOURCE))


def test_a_place_that_cannot_be_is_told_before_the_first_question(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("")
    result = CliRunner().invoke(new, [str(tmp_path / "taken" / "hall")], standalone_mode=False)
    assert isinstance(result.exception, OperatorMistake) and "taken is not a folder of yours" in str(result.exception)
    assert "Length" not in result.output


def test_the_next_command_can_be_copied_into_a_shell(tmp_path: Path) -> None:
    result = CliRunner().invoke(new, [str(tmp_path / "My Lab")], input="\n" * 40)
    assert f"groundstation config check '{tmp_path}/My Lab/My Lab.yaml'," in result.output
