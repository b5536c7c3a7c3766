"""A field file from a few answers: room, ceiling camera, drones, target."""

import json
import math
import re
import unicodedata
from collections.abc import Mapping
from typing import NamedTuple

from groundstation.errors import OperatorMistake
from groundstation.settings.cautions import PAD_TO_FENCE_M, RISEN_MARKER_M, RISEN_ROOM_M
from groundstation.settings.level_heights import FENCE_MARGIN_M, LEAST_BAND_M, OVER_TARGET_M
from groundstation.vehicles import Offer, VehicleKind, all_kinds

Place = tuple[float, float]

# Lens of config/cameras/ceiling.yaml: half a picture over its focal length.
_HALF_VIEW = (640.0 / 1179.0, 360.0 / 1179.0)
_WALL_M, _CEILING_M, _CAMERA_BELOW_CEILING_M = 0.3, 1.7, 0.3
# Under a low ceiling the fence comes nearer to the camera: below this, drones could not fly over a board of 0.4 m.
_LOWEST_FENCE_TOP_M = 1.3
_LOWEST_CEILING_M, _HIGHEST_CEILING_M = 2.4, 20.0
_BY_HAND = "groundstation config init writes a field file to edit"
_PAD_GAP_M = 1.0
_TARGET_CODE = 5
_LONGEST_SITE = 40
_PLAIN = re.compile(r"[a-z0-9][\w.:/@?=&%+-]*[\w/]", re.ASCII)

BASES = {"turtlebot_2": 0.4, "person": 1.4, "rc_car": 0.2}
"""Kinds of targets (`target.base`), each with a likely height of the board on it [m]."""


class NewDrone(NamedTuple):
    """One drone: its kind (of `offers`), its address, and where its camera's pictures come from."""

    kind: str
    address: str
    camera: str


class NewTarget(NamedTuple):
    """The target: its kind (of BASES), and the height of the board on it above the floor [m]."""

    base: str = "turtlebot_2"
    board_m: float = BASES["turtlebot_2"]


class NewRoom(NamedTuple):
    """Length, width and height of the room [m]; source: the ceiling camera's pictures."""

    length_m: float
    width_m: float
    height_m: float
    source: str

    @property
    def camera_height_m(self) -> float:
        """Height of the ceiling camera's lens [m]."""
        return round(self.height_m - _CAMERA_BELOW_CEILING_M, 2)

    @property
    def fence_top_m(self) -> float:
        """Height of the fence's top [m]."""
        return max(_LOWEST_FENCE_TOP_M, round(self.height_m - _CEILING_M, 2))

    def half_view_m(self, height_m: float) -> Place:
        """Return half the length and width of the ceiling camera's view at a height [m]."""
        below = self.camera_height_m - height_m
        return below * _HALF_VIEW[0], below * _HALF_VIEW[1]


def site_of(folder: str) -> str:
    """Return a site's name like that of a folder: small letters, digits and _, a letter first."""
    plain = unicodedata.normalize("NFKD", folder).encode("ascii", "ignore").decode().lower()
    name = re.sub(r"[^a-z0-9]+", "_", plain).strip("_")[:_LONGEST_SITE].rstrip("_")
    return name if name[:1].isalpha() else f"lab_{name}".rstrip("_")


def check_target(room: NewRoom, target: NewTarget) -> None:
    """Raise OperatorMistake for a board that no drone can look down on."""
    most = round(room.fence_top_m - FENCE_MARGIN_M - LEAST_BAND_M - OVER_TARGET_M, 2)
    if not 0.0 <= target.board_m <= most:
        raise OperatorMistake(
            f"no drone looks down on a board {target.board_m:g} m above the floor in a room {room.height_m:g} m high: "
            f"{most:g} m at most"
        )


def check_room(room: NewRoom) -> None:
    """Raise OperatorMistake for a room in which no team can fly."""
    if not all(map(math.isfinite, room[:3])):
        raise OperatorMistake("a room's length, width and height must be numbers")
    check_height(room.height_m)
    if min(room.length_m, room.width_m) < 3.0:
        raise OperatorMistake(f"a room of {room.length_m:g} x {room.width_m:g} m is too small: 3 x 3 m at least")
    if max(room.length_m, room.width_m) > 60.0:
        raise OperatorMistake(f"a room of {room.length_m:g} x {room.width_m:g} m is too large: 60 x 60 m at most")


def check_height(height_m: float) -> None:
    """Raise OperatorMistake for a ceiling under which, or a height from which, no ceiling camera serves."""
    if not height_m >= _LOWEST_CEILING_M:
        raise OperatorMistake(
            f"a room {height_m:g} m high is too low: {_LOWEST_CEILING_M:g} m at least (for a lower one, {_BY_HAND})"
        )
    if height_m > _HIGHEST_CEILING_M:
        raise OperatorMistake(f"a room {height_m:g} m high is too high: {_HIGHEST_CEILING_M:g} m at most")


def pads(room: NewRoom, count: int) -> list[Place]:
    """Return pads [m; world], one metre apart, in the ceiling camera's view and the fence; raises OperatorMistake."""
    inside = (0.5 * side - _WALL_M - PAD_TO_FENCE_M for side in room[:2])
    half = [min(seen - RISEN_ROOM_M, most) for seen, most in zip(room.half_view_m(RISEN_MARKER_M), inside, strict=True)]
    columns, rows = (1 + int(2 * side / _PAD_GAP_M) for side in half)
    if count > (most := columns * rows):
        raise OperatorMistake(
            f"there is room for {most} pad{'s' * (most > 1)}, not for {count}, inside the fence where the ceiling "
            f"camera sees them: take {most} drone{'s' * (most > 1)} (for a wider lens or more cameras, {_BY_HAND})"
        )
    used = math.ceil(count / rows)
    column = [(index - (used - 1) / 2) * _PAD_GAP_M for index in range(used)]
    row = [(index - (min(rows, count) - 1) / 2) * _PAD_GAP_M for index in range(min(rows, count))]
    return [(round(x, 2), round(y, 2)) for x in column for y in row][:count]


def offers() -> dict[str, tuple[str, Offer]]:
    """Return the types of new drones by name: kind of vehicle, and the texts of the type."""
    return {name: (kind.name, offer) for kind in all_kinds().values() for name, offer in _offers_of(kind).items()}


def _offers_of(kind: VehicleKind) -> Mapping[str, Offer]:
    own = "".join(f"    {key}: {json.dumps(dict(section))}\n" for key, section in kind.example.items())
    return kind.offers or {kind.name: Offer(of_type=own)}


def _type(name: str, kind: str, offer: Offer) -> str:
    return f"  {name}:\n    kind: {kind}\n{offer.of_type}"


def field_text(site: str, room: NewRoom, drones: list[NewDrone], target: NewTarget) -> str:
    """Return the field file; raises OperatorMistake for a room, a team or a target that does not fit."""
    check_room(room)
    check_target(room, target)
    known = offers()
    types = "".join(_type(name, *known[name]) for name in dict.fromkeys(drone.kind for drone in drones))
    parts = [_room(site, room), _DEFAULTS, f"types:\n{types}"]
    parts.append("drones:\n" + "".join(map(_drone, range(1, 1 + len(drones)), drones, pads(room, len(drones)))))
    return "\n".join([*parts, _target(target), _REST])


def _text(answer: str) -> str:
    """Return an answer as YAML: an address as it is, all else in quotes."""
    return answer if _PLAIN.fullmatch(answer) else json.dumps(answer)


def _room(site: str, room: NewRoom) -> str:
    x, y = room.length_m / 2 - _WALL_M, room.width_m / 2 - _WALL_M
    return f"""\
# Frame: origin on the floor in the middle of the room, x along the long side, z up. Units are in the key names.
schema_version: 1
site: {site_of(site)}

room:
  size_m: [{room.length_m:g}, {room.width_m:g}, {room.height_m:g}]
  fence:                         # drones are stopped before they leave this box; an arm's length from walls and lamps
    x_m: [{-x:g}, {x:g}]
    y_m: [{-y:g}, {y:g}]
    z_m: [0.0, {room.fence_top_m:g}]

cameras:                         # fixed in the world; they observe drones only
  ceiling:
    source: {_text(room.source)}
    calibration: cameras/ceiling.yaml      # measure yours: groundstation calibrate camera
    position_m: [0.0, 0.0, {room.camera_height_m:g}]   # survey it: groundstation calibrate extrinsics
    looking: down                # picture x axis along world x, picture y axis along world -y
    video_delay_ms: 120          # measure it: groundstation calibrate delay
    attitude_std_deg: 0.2
    position_std_m: 0.01
"""


def _drone(number: int, drone: NewDrone, pad: Place) -> str:
    own = offers()[drone.kind][1].of_drone.replace("{id}", str(10 + number)).replace("{address}", drone.address)
    heading = math.degrees(math.atan2(-pad[1], -pad[0])) if any(pad) else 0.0
    return f"""\
  drone_{number}:
    type: {drone.kind}
    address: {_text(drone.address)}
{own}    camera: {{source: {json.dumps(drone.camera)}}}
    marker: {{code: {number if number < _TARGET_CODE else number + 1}}}   # print it: groundstation markers print
    pad_m: [{pad[0]:g}, {pad[1]:g}]          # where it stands before take-off, in the ceiling camera's view
    pad_yaw_deg: {heading:.0f}              # towards the middle of the room
"""


def _target(target: NewTarget) -> str:
    return f"""\
target:
  name: {target.base}
  base: {target.base}            # its limits of motion; for another target: max_speed_m_s and its like
  marker: {{code: {_TARGET_CODE}, height_m: {target.board_m:g}, square_mm: 44}}
"""


_DEFAULTS = """\
defaults:                        # for every drone; its type and its own entry override them
  limits: {max_speed_m_s: 0.6, max_climb_m_s: 0.4, max_yaw_rate_deg_s: 60, battery_min: 0.15}
  marker: {position_m: [0.0, 0.0, 0.08], square_mm: 44}
  camera:
    calibration: cameras/ardrone_front.yaml   # an AR.Drone's; measure yours: groundstation calibrate camera
    position_m: [0.09, 0.0, 0.0]
    tilt_down_deg: 45
    video_delay_ms: 120
"""
_REST = """\
recording: {directory: runs}
"""
