"""A kind of vehicle that somebody began to add is refused by name; it is never met as another kind."""

from pathlib import Path
from typing import get_args

import pytest

from drivers import registry
from groundstation.errors import DriverError, SettingsError
from groundstation.flight.composition import process_table
from groundstation.settings.drones import VehicleKind
from groundstation.settings.load import load_field
from groundstation.settings.schema import Field
from groundstation.settings.sections import DriverKind, driver_sections, rerouted
from groundstation.supervisor.process_spec import FailsafeDatagrams

CONFIG = Path(__file__).parents[3] / "config"
REFUSED = r"kind: tello is not known; known: ardrone, mavlink"


@pytest.fixture
def field() -> Field:
    return load_field(CONFIG / "mixed-team.yaml")


@pytest.fixture
def third(field: Field) -> Field:
    """The field after `tello` was let into the settings, and nowhere else."""
    name, drone = next((n, d) for n, d in field.drones.items() if d.kind == "mavlink")
    other = drone.model_copy(update={"kind": "tello", "mavlink": None})
    return field.model_copy(update={"drones": field.drones | {name: other}})


def failsafe_datagrams(field: Field, tmp_path: Path) -> dict[str, FailsafeDatagrams | None]:
    table = process_table(field, "tcp/127.0.0.1:1", tmp_path, simulation=None, monitor=False)
    return {spec.name: spec.failsafe_datagrams for spec in table if spec.role == "driver"}


def test_each_kind_gets_last_words_of_its_own_protocol(field: Field, tmp_path: Path) -> None:
    spoken = {name: words for name, words in failsafe_datagrams(field, tmp_path).items() if words is not None}
    assert {field.drones[name].kind for name in spoken} == {"ardrone", "mavlink"}
    for name, words in spoken.items():
        begin = b"AT*" if field.drones[name].kind == "ardrone" else b"\xfd"
        assert words.hover.startswith(begin) and words.land.startswith(begin), name


def test_a_third_kind_gets_no_process_and_no_last_words(third: Field, tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match=REFUSED):
        failsafe_datagrams(third, tmp_path)


def test_a_third_kind_whose_driver_is_registered_gets_no_last_words_of_another(
    third: Field, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, field: Field
) -> None:
    monkeypatch.setattr("groundstation.flight.composition.driver_sections", lambda _: driver_sections(field))
    with pytest.raises(SettingsError, match=REFUSED):
        failsafe_datagrams(third, tmp_path)


def test_a_third_kind_has_no_section_and_no_place_in_a_simulation(third: Field) -> None:
    with pytest.raises(SettingsError, match=REFUSED):
        driver_sections(third)
    with pytest.raises(SettingsError, match=REFUSED):
        rerouted(third, dict.fromkeys(third.drones, "127.0.0.1"), {})


def test_a_mavlink_vehicle_without_its_section_is_refused_too(field: Field, tmp_path: Path) -> None:
    bare = {n: d.model_copy(update={"mavlink": None}) if d.kind == "mavlink" else d for n, d in field.drones.items()}
    with pytest.raises(SettingsError, match="kind: mavlink has no mavlink section"):
        failsafe_datagrams(field.model_copy(update={"drones": bare}), tmp_path)


def test_settings_drivers_and_registry_know_the_same_kinds() -> None:
    assert set(registry.ENTRY_POINTS) == set(DriverKind) == {*get_args(VehicleKind), "camera"}
    with pytest.raises(DriverError, match="kind: tello is not known; known: ardrone, mavlink, camera"):
        registry.entry_point("tello")
