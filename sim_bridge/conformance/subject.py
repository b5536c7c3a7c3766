"""The vehicle under test: one of a kind, as a field file would describe it."""

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from pydantic import ValidationError

from groundstation.errors import SettingsError
from groundstation.field.behaviour import SafetyValues
from groundstation.field.drones import DroneLimits, FieldDrone, OdometryErrors, OnboardCamera
from groundstation.field.room import LensCalibration
from groundstation.field.targets import DroneMarker
from groundstation.process.child import ChildSpec
from groundstation.vehicles import KindSection, VehicleKind, VehicleOrder, kind_named
from sim_bridge.fault_kinds import Fault
from sim_bridge.launch_spec import LaunchSpec
from sim_bridge.scenario import Scenario, describe_problems
from sim_bridge.site import Site

NAME, SITE = "subject", "conformance"
PAD_M, PAD_YAW_DEG = (0.5, -0.3), 30.0
TOP_M = 2.5
LIMITS = DroneLimits()
_ROOM_M = (14.0, 14.0, 5.0)
_LENS = LensCalibration(
    model="plumb_bob", width_px=640, height_px=360, fx_px=560.0, fy_px=560.0, cx_px=320.0, cy_px=180.0,
    distortion=(0.0, 0.0, 0.0, 0.0, 0.0),
)  # fmt: skip
_SQUARE_MM = 44.0


@dataclass(frozen=True, slots=True)
class Subject:
    """One vehicle of a kind at a loopback address; sections: keys of the field file that only its kind has."""

    kind: VehicleKind
    address: str
    sections: Mapping[str, KindSection]
    limits: DroneLimits = LIMITS

    @property
    def local_address(self) -> str:
        """Return this computer's address in the vehicle's network."""
        return self.address.rpartition(".")[0] + ".1"

    def order(self, name: str = NAME, index: int = 0) -> VehicleOrder:
        """Return the order that the kind gets for the vehicle; others of a team have other names and numbers."""
        drone = FieldDrone(
            kind=self.kind.name,
            address=self.address,
            limits=self.limits,
            marker=DroneMarker(code=1, square_mm=_SQUARE_MM),
            camera=OnboardCamera(source="", calibration=_LENS),
            odometry=OdometryErrors(),
            pad_m=PAD_M,
            pad_yaw_deg=PAD_YAW_DEG,
        )
        return VehicleOrder(name, index, drone, SafetyValues(), TOP_M, True, self.sections)

    def launch(self, faults: Iterable[Fault] = ()) -> LaunchSpec:
        """Return the simulator's order for a room with this vehicle alone."""
        drone = {
            "kind": self.kind.name,
            "pad_m": PAD_M,
            "pad_yaw_deg": PAD_YAW_DEG,
            "marker": {"code": 1, "square_mm": _SQUARE_MM, "position_m": (0.0, 0.0, 0.08)},
            **{key: section.model_dump(mode="json") for key, section in self.sections.items()},
        }
        site = Site.model_validate(
            {
                "site": SITE,
                "room": {"size_m": _ROOM_M},
                "drones": {NAME: drone},
                "target": {"name": "target", "marker": {"code": 5, "height_m": 0.4, "square_mm": _SQUARE_MM}},
            }
        )
        child = ChildSpec("kit", "sim_bridge", "", SITE)
        return LaunchSpec(child, site, Scenario(faults=tuple(faults)), {NAME: self.address}, {}, 1)


def subject_of(name: str, options: Iterable[str] = ()) -> Subject:
    """Return a vehicle of a kind, described as the kind's own example with some keys set otherwise (A.B=C).

    Raises SettingsError for an unknown kind or key.
    """
    kind = kind_named(name)
    written: dict[str, Any] = {key: dict(values) for key, values in kind.example.items()}
    for option in options:
        path, equals, value = option.partition("=")
        section, dot, key = path.partition(".")
        if not (equals and dot):
            raise SettingsError([f"{option}: must be SECTION.KEY=VALUE"])
        written.setdefault(section, {})[key] = _value(value)
    unknown = sorted(set(written) - set(kind.sections))
    missing = sorted(kind.required - set(written))
    if unknown or missing:
        words = [f"{name} has no section {key}" for key in unknown]
        raise SettingsError([*words, *(f"{name} needs a section {key}: give its example" for key in missing)])
    pid = os.getpid()
    address = f"127.{60 + pid % 180}.{pid // 180 % 250}.11"
    return _moved(Subject(kind, address, {key: _section(kind, key, values) for key, values in written.items()}))


def stranger_to(address: str) -> str:
    """Return an unused address in a vehicle's network."""
    network, _, host = address.rpartition(".")
    return f"{network}.{int(host) + 100}"


def _value(text: str) -> object:
    try:
        return json.loads(text)
    except ValueError:
        return text


def _section(kind: VehicleKind, key: str, values: Mapping[str, object]) -> KindSection:
    try:
        return kind.sections[key].model_validate_json(json.dumps(values))
    except ValidationError as error:
        raise SettingsError(describe_problems(f"{kind.name}: {key}", error)) from None


def _moved(subject: Subject) -> Subject:
    changes = subject.kind.moved(subject.local_address, subject.sections)
    moved = {key: one.model_copy(update=changes.get(key, {})) for key, one in subject.sections.items()}
    return replace(subject, sections=moved)
