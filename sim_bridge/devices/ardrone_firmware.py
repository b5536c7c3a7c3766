"""Firmwares of emulated AR.Drones, and their differences on the wire."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from drivers.ardrone.wire.configuration import Scalar
from drivers.ardrone.wire.pave import HEADER_SIZE
from drivers.ardrone.wire.tags import OPTION_SIZES, Tag

DEFAULT = "ar2-2.3"
_LONG_HEADER, _FIRST_WITH_IT = 68, (2, 3)


@dataclass(frozen=True, slots=True)
class ArdroneFirmware:
    """One firmware: generation 1 or 2 of the drone, version as in version.txt, sizes of the navdata options by tag.

    values: settings that differ from those of an AR.Drone 2 with 2.3.3.
    """

    name: str
    generation: int
    version: str
    sizes: Mapping[int, int]
    multi_configuration: bool = True
    values: Mapping[str, Scalar] = field(default_factory=dict)

    @property
    def video_header_bytes(self) -> int:
        """Return the size of the header of its video frames."""
        # WIRE (docs/reference/ardrone.md 6): 64 bytes, 68 from newer firmwares.
        major, minor = map(int, self.version.split(".")[:2])
        return _LONG_HEADER if (major, minor) >= _FIRST_WITH_IT else HEADER_SIZE

    def without(self, tags: tuple[int, ...]) -> "ArdroneFirmware":
        """Return the same firmware with some options left out of navdata."""
        sizes = {tag: size for tag, size in self.sizes.items() if tag not in tags or tag == Tag.DEMO}
        return ArdroneFirmware(self.name, self.generation, self.version, sizes, self.multi_configuration, self.values)


# WIRE: configuration dumps of AR.Drone 1 (docs/reference/ardrone.md 5.4).
_FIRST_GENERATION: dict[str, Scalar] = {
    **{
        f"general:motor{motor}_{part}": value
        for motor in (1, 2, 3, 4)
        for part, value in (("soft", "1.20"), ("hard", "3.0"), ("supplier", "1.1"))
    },
    "general:num_version_mb": 17,
    "video:camif_fps": 15,
    "video:codec_fps": 15,
    "video:video_codec": 32,
    "video:bitrate": 20000,
    "control:control_level": 1,
    "network:ssid_single_player": "ardrone",
    "network:ssid_multi_player": "ardrone",
}


def _firmware(name: str, version: str) -> ArdroneFirmware:
    generation = int(name[2])
    values: dict[str, Scalar] = {"general:num_version_soft": version}
    if generation == 1:
        values |= _FIRST_GENERATION
    # WIRE: sessions, users and applications came with firmware 1.6.
    return ArdroneFirmware(name, generation, version, OPTION_SIZES[name], not version.startswith("1.5"), values)


FIRMWARES: dict[str, ArdroneFirmware] = {
    name: _firmware(name, version)
    for name, version in (
        ("ar1-1.5", "1.5.1"),
        ("ar1-1.7", "1.7.4"),
        ("ar2-2.2", "2.2.9"),
        ("ar2-2.3", "2.3.3"),
        ("ar2-2.3.3", "2.3.3"),
        ("ar2-2.4-beta", "2.4.1"),
        ("ar2-2.4.8", "2.4.8"),
    )
}
