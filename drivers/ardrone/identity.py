"""Identifies an AR.Drone: generation and firmware, from version.txt, the configuration or navdata. Pure."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from drivers.ardrone.wire.navdata import Navdata
from drivers.ardrone.wire.tags import Tag

# WIRE (docs/reference/ardrone.md 5.3): session, user and application ids exist since firmware 1.6.0.
_FIRST_WITH_IDS = (1, 6, 0)
_VERSION = re.compile(r"(\d{1,3})\.(\d{1,3})(?:\.(\d{1,5}))?")
# WIRE (docs/reference/ardrone.md 5.4): general:num_version_mb of the two generations.
_BOARDS = {"17": 1, "33": 2, "34": 2}
_AR1_VISION_DETECT = 120


class Model(StrEnum):
    """Generation of the vehicle."""

    AR1 = "AR.Drone 1.0"
    AR2 = "AR.Drone 2.0"
    UNKNOWN = "AR.Drone"


@dataclass(frozen=True, slots=True)
class Identity:
    """The identity of a drone; firmware and serial are "" while unknown."""

    model: Model = Model.UNKNOWN
    firmware: str = ""
    serial: str = ""

    @property
    def has_ids(self) -> bool:
        """Return whether it keeps sets of settings by ids.

        Assumed of an unknown firmware (all but a few early AR1 do).
        """
        version = _parse(self.firmware)
        return version is None or version >= _FIRST_WITH_IDS

    @property
    def text(self) -> str:
        """Return model, firmware and serial number in words."""
        parts = [self.model.value, f"firmware {self.firmware}" if self.firmware else "firmware unknown"]
        return ", ".join(parts + ([f"serial {self.serial}"] if self.serial else []))


def _parse(text: str) -> tuple[int, int, int] | None:
    match = _VERSION.search(text)
    return None if match is None else (int(match[1]), int(match[2]), int(match[3] or 0))


def _model(major: int | None) -> Model:
    return {1: Model.AR1, 2: Model.AR2}.get(major or 0, Model.UNKNOWN)


def identity_from_version(text: str) -> Identity:
    """Return the version in version.txt, such as "2.3.3"; unknown from any other text."""
    version = _parse(text)
    return Identity() if version is None else Identity(_model(version[0]), ".".join(map(str, version)))


def identity_from_dump(values: Mapping[str, str]) -> Identity:
    """Return the identity in a configuration dump (key -> text)."""
    firmware = values.get("general:num_version_soft", "")
    version = _parse(firmware)
    major = version[0] if version else _BOARDS.get(values.get("general:num_version_mb", ""))
    return Identity(_model(major), firmware, values.get("general:drone_serial", ""))


def model_from_navdata(packet: Navdata) -> Model:
    """Return the generation by the options of a packet: pressure exists on AR2 only, AR1's detections are shorter."""
    sizes = {tag: len(payload) + 4 for tag, payload in packet.options}
    if Tag.PRESSURE_RAW in sizes or sizes.get(Tag.VISION_DETECT, 0) > _AR1_VISION_DETECT:
        return Model.AR2
    return Model.AR1 if Tag.VISION_DETECT in sizes else Model.UNKNOWN
