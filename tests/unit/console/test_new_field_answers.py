"""The new-field form: the field that its answers make, and answers that no form sends."""

import json
from pathlib import Path
from typing import Any

import pytest

from groundstation.console.new_field.answers import decode, offers_script, reply_to
from groundstation.errors import MessageError
from groundstation.settings.load import load_field

FORM: dict[str, Any] = {
    "number": 3,
    "order": "draw",
    "room": [8, 6, 4.5, "http://192.168.1.50:8080/video.mjpg"],
    "drones": [["ardrone", "192.168.1.11", "ardrone://192.168.1.11"]],
    "target": ["turtlebot_2", 0.4],
}


def form(**changes: Any) -> bytes:
    return json.dumps(FORM | changes).encode()


def test_answers_are_drawn_and_nothing_is_written(tmp_path: Path) -> None:
    reply = reply_to(decode(form()), tmp_path / "hall.yaml")
    assert reply.number == 3 and reply.problem == "" and reply.written == ""
    assert "<svg" in reply.svg and "site: hall" in reply.text
    assert list(tmp_path.iterdir()) == []


def test_the_page_offers_every_kind_there_is() -> None:
    told = json.loads(offers_script().decode().partition("=")[2].rstrip().rstrip(";"))
    assert told["px4"] == {"title": "PX4", "pictures": "http://{address}:8080/video.mjpg", "address": ""}
    assert told["ardrone"]["pictures"] == "ardrone://{address}"
    assert told["tello"] == {"title": "Tello", "pictures": "tello://{address}", "address": "192.168.10.1"}


def test_the_button_writes_a_good_field_once(tmp_path: Path) -> None:
    path = tmp_path / "hall" / "hall.yaml"
    path.parent.mkdir()
    reply = reply_to(decode(form(order="write")), path)
    assert reply.written == str(path) and load_field(path).room.size_m == (8, 6, 4.5)
    assert "is there already" in reply_to(decode(form(order="write")), path).problem


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"room": [8, 6, 2, "http://192.168.1.50/"]}, "too low"),
        ({"room": [8, 6, 4.5, "'\"; {x: y} # \n}"]}, "cameras.ceiling.source: holds a character"),
        ({"drones": [["ardrone", "192.168.1.11", '"}, {x: "y']]}, "drones.drone_1.camera.source: must be an address"),
        ({"room": [800, 6, 5, "http://192.168.1.50/"]}, "too large"),
        ({"drones": [["ardrone", "192.168.1.11", "ardrone://192.168.1.11"]] * 2}, "192.168.1.11"),
        ({"drones": [["ardrone", "no address: {", "x"]]}, "hall.yaml"),
        ({"target": ["bicycle", 0.4]}, "base"),
    ],
)
def test_a_mistake_is_named(tmp_path: Path, changes: dict[str, Any], problem: str) -> None:
    reply = reply_to(decode(form(order="write", **changes)), tmp_path / "hall.yaml")
    assert problem in reply.problem and "/tmp/" not in reply.problem and reply.written == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("frame", [b"", b"[]", b"\xff", form(order="erase"), form(drones=[["balloon", "a", "b"]])])
def test_answers_that_no_form_sends_are_refused(frame: bytes) -> None:
    with pytest.raises(MessageError):
        decode(frame)
