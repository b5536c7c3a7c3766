"""Vehicles with one address: distinguished by network adapter, or refused with the remedy."""

import json
from pathlib import Path

import pytest

from groundstation.errors import SettingsError
from groundstation.flight.composition import process_table
from groundstation.settings.load import cautions_of, load_field
from groundstation.settings.schema import Field
from groundstation.settings.sections import driver_sections, rerouted

LAB = Path(__file__).parents[2] / "fixtures" / "field" / "lab.yaml"
SAME = tuple(
    f"drones.{name}.{what}"
    for name in ("drone_1", "drone_2")
    for what in ("address=192.168.1.1", "camera.source=ardrone://192.168.1.1")
)
APART = (*SAME, "drones.drone_1.interface=wlan1", "drones.drone_2.interface=wlan2")


def sections(field: Field) -> dict[str, dict[str, object]]:
    return {section.name: json.loads(section.section) for section in driver_sections(field)}


def test_two_vehicles_may_have_one_address_behind_an_adapter_each(tmp_path: Path) -> None:
    field = load_field(LAB, APART)
    handed = sections(field)
    assert [handed[name]["interface"] for name in ("drone_1", "drone_2")] == ["wlan1", "wlan2"]
    sources = [handed[f"{name}_camera"]["source"] for name in ("drone_1", "drone_2")]
    assert sources == ["ardrone://192.168.1.1%wlan1", "ardrone://192.168.1.1%wlan2"]
    table = process_table(field, "tcp/127.0.0.1:1", tmp_path, simulation=None, monitor=False)
    words = {spec.name: spec.failsafe_datagrams for spec in table if spec.failsafe_datagrams is not None}
    assert {name: (one.address, one.interface) for name, one in words.items()} == {
        "drone_1": ("192.168.1.1", "wlan1"),
        "drone_2": ("192.168.1.1", "wlan2"),
    }


@pytest.mark.parametrize("given", [(), ("drone_1",), ("drone_2",)])
def test_without_an_adapter_for_both_they_are_refused_with_the_remedy(given: tuple[str, ...]) -> None:
    with pytest.raises(SettingsError, match=r"address 192.168.1.1 is already that of drone_1; .* need an interface"):
        load_field(LAB, (*SAME, *(f"drones.{name}.interface=wlan1" for name in given)))


def test_behind_one_adapter_they_are_refused_too() -> None:
    with pytest.raises(SettingsError, match="both need an interface"):
        load_field(LAB, (*APART, "drones.drone_2.interface=wlan1"))


@pytest.mark.parametrize(
    ("source", "refused"),
    [
        ("rtsp://192.168.1.1/stream", r"camera.source: cannot be used with interface: what opens rtsp:// chooses no"),
        ("http://192.168.1.1%wlan3/v.mjpg", r"must come through the vehicle's interface wlan2 \(got wlan3\)"),
    ],
)
def test_a_video_that_would_come_through_another_adapter_is_refused(source: str, refused: str) -> None:
    with pytest.raises(SettingsError, match=refused):
        load_field(LAB, (*APART, f"drones.drone_2.camera.source={source}"))


def test_a_camera_elsewhere_is_reached_as_the_routes_say() -> None:
    field = load_field(LAB, (*APART, "drones.drone_2.camera.source=rtsp://192.168.7.7/stream"))
    assert sections(field)["drone_2_camera"]["source"] == "rtsp://192.168.7.7/stream"


def test_mavlink_vehicles_share_a_port_behind_an_adapter_each() -> None:
    options = [f"drones.{name}.{what}" for name in ("drone_2", "drone_3")
               for what in ("address=192.168.10.1", "mavlink.listen=true", "mavlink.port=14550")]  # fmt: skip
    options += ["drones.drone_2.interface=wlan1", "drones.drone_3.interface=wlan2"]
    options += ["drones.drone_2.mavlink.link=pymavlink", "drones.drone_3.mavlink.link=pymavlink"]
    handed = sections(load_field("config/mixed-team.yaml", options))
    links = [handed[name]["link"] for name in ("drone_2", "drone_3")]
    assert [link["target"] for link in links if isinstance(link, dict)] == [
        "udpin:0.0.0.0%wlan1:14550",
        "udpin:0.0.0.0%wlan2:14550",
    ]
    with pytest.raises(SettingsError, match=r"drone_3.interface: has no meaning on a serial line"):
        load_field(
            "config/mixed-team.yaml",
            [*options, "drones.drone_3.mavlink.listen=false", "drones.drone_3.mavlink.serial=/dev/ttyUSB0:57600"],
        )


def test_emulated_vehicles_are_behind_no_adapter() -> None:
    field = rerouted(load_field(LAB, APART), {"drone_1": "127.3.7.11", "drone_2": "127.3.7.12"},
                     {"drone_1": ("127.3.7.11", 5555), "drone_2": ("127.3.7.12", 5555)})  # fmt: skip
    assert [drone.interface for drone in field.drones.values()] == ["", ""]
    assert sections(field)["drone_1_camera"]["source"] == "ardrone://127.3.7.11:5555"


def test_an_adapter_that_this_machine_lacks_is_told() -> None:
    found = [line for line in cautions_of(LAB, APART) if "interface" in line]
    assert len(found) == 2 and "is no network adapter of this machine (got wlan1); it has" in found[0]
    ours = (*SAME, "drones.drone_1.interface=lo", "drones.drone_2.interface=wlan2")
    assert sum("no network adapter" in line for line in cautions_of(LAB, ours)) == 1


def test_a_kind_that_chooses_no_adapter_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    from dataclasses import replace

    from groundstation.vehicles import registry

    kinds, refused = registry._found()
    bare = {**kinds, "ardrone": replace(kinds["ardrone"], has_interface=False)}
    monkeypatch.setattr(registry, "_found", lambda: (bare, refused))
    with pytest.raises(
        SettingsError, match=r"drone_1.interface: cannot be used: the driver of ardrone does not choose"
    ):
        load_field(LAB, APART)
