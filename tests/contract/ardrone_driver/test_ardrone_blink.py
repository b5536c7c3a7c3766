"""`groundstation vehicle blink` shows on the ground which drone has which name."""

import shutil

import pytest

from drivers.ardrone.wire.at import bits_from_float
from groundstation.cli.main import run
from groundstation.settings.files import find_field

FLY = 1 << 0


@pytest.fixture
def field_of(tmp_path):
    """Write the lab's field with these addresses; returns its path."""

    def write(one, other="127.0.0.250"):
        shipped = find_field("lab")
        shutil.copytree(shipped.parent / "cameras", tmp_path / "cameras", dirs_exist_ok=True)
        text = shipped.read_text().replace("192.168.1.11", one).replace("192.168.1.12", other)
        (tmp_path / "lab.yaml").write_text(text)
        return str(tmp_path / "lab.yaml")

    return write


def test_the_named_drone_blinks_and_hears_nothing_else(drone_alone, field_of, capsys, monkeypatch):
    monkeypatch.setattr("drivers.ardrone.blink._LASTS_S", 0)
    drone = drone_alone("2.4.8")
    assert run(["vehicle", "blink", field_of(drone.address), "drone_1"]) == 0
    out = capsys.readouterr().out
    assert f"drone_1 ({drone.address}): its lights blinked orange" in out and "drone_2" not in out
    said = drone.said("LED")
    assert len(said) == 3 and {name for name, _, _ in drone.lines} == {"LED"}
    assert said[0].split(",")[:2] == ["3", str(bits_from_float(4.0))]


def test_one_that_flies_is_left_alone_and_one_that_is_silent_is_named(drone_alone, field_of, capsys):
    drone = drone_alone("2.4.8", state=FLY)
    assert run(["vehicle", "blink", field_of(drone.address)]) == 4
    err = capsys.readouterr().err
    assert "drone_1: " in err and "land it first" in err and drone.lines == []
    assert "drone_2: 127.0.0.250 does not answer" in err or "drone_2: " in err
    assert run(["vehicle", "blink", field_of(drone.address), "drone_9"]) == 2
    assert "no drone drone_9" in capsys.readouterr().err
