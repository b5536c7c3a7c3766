"""The table of fault kinds, with the parts that each can break; one fault of a scenario."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum, StrEnum, auto
from typing import Annotated

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from sim_bridge.section import Section


class FaultKind(StrEnum):
    """Faults that a scenario can have; `Fault.kind` explains each."""

    NAVDATA_SILENT = "navdata_silent"
    AT_DEAF = "at_deaf"
    CAMERA_CUT = "camera_cut"
    CAMERA_STALL = "camera_stall"
    CAMERA_HELD_BACK = "camera_held_back"
    BATTERY_DROP = "battery_drop"
    PROPELLER_BLOCKED = "propeller_blocked"
    TELEMETRY_FROZEN = "telemetry_frozen"
    TELEMETRY_DELAYED = "telemetry_delayed"
    VELOCITY_STUCK = "velocity_stuck"
    VELOCITY_SCALED = "velocity_scaled"
    VELOCITY_DRIFTING = "velocity_drifting"
    VELOCITY_JUMPING = "velocity_jumping"
    HEADING_DRIFTING = "heading_drifting"
    HEADING_JUMPING = "heading_jumping"
    BATTERY_STUCK = "battery_stuck"
    UNIFORM_FLOOR = "uniform_floor"
    OBSTACLE_BELOW = "obstacle_below"
    WIND = "wind"
    IDS_SWAPPED = "ids_swapped"
    CAMERA_BUMPED = "camera_bumped"
    PICTURE_FROZEN = "picture_frozen"
    PICTURE_BLACK = "picture_black"
    WRONG_BOARD = "wrong_board"
    CAPTURE_SILENT = "capture_silent"
    CAPTURE_FROZEN = "capture_frozen"
    BODY_JUMPED = "body_jumped"
    BODY_TURNED = "body_turned"
    BODIES_SWAPPED = "bodies_swapped"
    RANGES_SILENT = "ranges_silent"
    RANGES_FROZEN = "ranges_frozen"
    RANGES_LONG = "ranges_long"
    ANCHOR_FROZEN = "anchor_frozen"
    ODOMETRY_SILENT = "odometry_silent"
    ODOMETRY_FROZEN = "odometry_frozen"
    ODOMETRY_SCALED = "odometry_scaled"


class Part(Enum):
    """Parts that can have a fault: any vehicle, one whose emulator has it (`VehicleKind.emulated_faults`), a camera,
    the marker of a drone or target, a motion capture system, its body on a drone or target, a ranging system, a
    drone's radio for it, or a target that reports its odometry."""

    VEHICLE = auto()
    ABLE_VEHICLE = auto()
    CAMERA = auto()
    MARKER = auto()
    CAPTURE = auto()
    BODY = auto()
    RANGING = auto()
    TRANSPONDER = auto()
    ODOMETRY = auto()


@dataclass(frozen=True, slots=True)
class KindRules:
    """The part that a kind of fault breaks; value: its least and greatest figure, None if it has none.

    usual: the default figure, None: the scenario must give one. other: the fault names a second entity.
    """

    part: Part
    value: tuple[float, float] | None = None
    usual: float | None = None
    other: bool = False


RULES: dict[FaultKind, KindRules] = {
    FaultKind.NAVDATA_SILENT: KindRules(Part.VEHICLE),
    FaultKind.AT_DEAF: KindRules(Part.VEHICLE),
    FaultKind.CAMERA_CUT: KindRules(Part.CAMERA),
    FaultKind.CAMERA_STALL: KindRules(Part.CAMERA),
    FaultKind.CAMERA_HELD_BACK: KindRules(Part.CAMERA),
    FaultKind.BATTERY_DROP: KindRules(Part.VEHICLE, (0.0, 1.0)),
    FaultKind.PROPELLER_BLOCKED: KindRules(Part.ABLE_VEHICLE),
    FaultKind.TELEMETRY_FROZEN: KindRules(Part.VEHICLE),
    FaultKind.TELEMETRY_DELAYED: KindRules(Part.VEHICLE, (0.0, 10.0), 0.5),
    FaultKind.VELOCITY_STUCK: KindRules(Part.VEHICLE, (-5.0, 5.0), 0.0),
    FaultKind.VELOCITY_SCALED: KindRules(Part.VEHICLE, (-5.0, 5.0), 0.5),
    FaultKind.VELOCITY_DRIFTING: KindRules(Part.VEHICLE, (-5.0, 5.0), 0.1),
    FaultKind.VELOCITY_JUMPING: KindRules(Part.VEHICLE, (-5.0, 5.0), 0.5),
    FaultKind.HEADING_DRIFTING: KindRules(Part.VEHICLE, (-90.0, 90.0), 1.0),
    FaultKind.HEADING_JUMPING: KindRules(Part.VEHICLE, (-180.0, 180.0), 30.0),
    FaultKind.BATTERY_STUCK: KindRules(Part.VEHICLE, (0.0, 1.0), 1.0),
    FaultKind.UNIFORM_FLOOR: KindRules(Part.ABLE_VEHICLE, (0.0, 2.0), 0.0),
    FaultKind.OBSTACLE_BELOW: KindRules(Part.ABLE_VEHICLE, (0.0, 2.0), 0.4),
    FaultKind.WIND: KindRules(Part.VEHICLE, (0.0, 5.0), 1.0),
    FaultKind.IDS_SWAPPED: KindRules(Part.VEHICLE, other=True),
    FaultKind.CAMERA_BUMPED: KindRules(Part.CAMERA, (-90.0, 90.0), 5.0),
    FaultKind.PICTURE_FROZEN: KindRules(Part.CAMERA),
    FaultKind.PICTURE_BLACK: KindRules(Part.CAMERA),
    FaultKind.WRONG_BOARD: KindRules(Part.MARKER, other=True),
    FaultKind.CAPTURE_SILENT: KindRules(Part.CAPTURE),
    FaultKind.CAPTURE_FROZEN: KindRules(Part.CAPTURE),
    FaultKind.BODY_JUMPED: KindRules(Part.BODY, (-5.0, 5.0), 0.5),
    FaultKind.BODY_TURNED: KindRules(Part.BODY, (-180.0, 180.0), 180.0),
    FaultKind.BODIES_SWAPPED: KindRules(Part.BODY, other=True),
    FaultKind.RANGES_SILENT: KindRules(Part.RANGING),
    FaultKind.RANGES_FROZEN: KindRules(Part.RANGING),
    FaultKind.RANGES_LONG: KindRules(Part.TRANSPONDER, (-5.0, 5.0), 0.5),
    FaultKind.ANCHOR_FROZEN: KindRules(Part.RANGING, other=True),
    FaultKind.ODOMETRY_SILENT: KindRules(Part.ODOMETRY),
    FaultKind.ODOMETRY_FROZEN: KindRules(Part.ODOMETRY),
    FaultKind.ODOMETRY_SCALED: KindRules(Part.ODOMETRY, (-5.0, 5.0), 0.5),
}


class Fault(Section):
    """One fault of a drone, camera or marker."""

    kind: FaultKind
    """navdata_silent: a vehicle sends nothing; at_deaf: it receives nothing; camera_cut: a camera's connection is
    closed and refused; camera_stall: it stays open, without pictures; camera_held_back: they come together at the end,
    if that is within 2 s: later the driver has hung up, as in a camera_stall; battery_drop: the charge falls to value;
    propeller_blocked: an AR.Drone's cut-out stops its motors, an emergency until it is free; telemetry_frozen: a
    vehicle's telemetry repeats its contents; telemetry_delayed: it is value old [s]; velocity_stuck,
    velocity_scaled, velocity_drifting, velocity_jumping: the reported horizontal velocity is value [m/s], value times
    the correct one, grows by value [m/s^2], is off by value [m/s]; heading_drifting, heading_jumping: the reported
    heading turns by value [deg/s], is off by value [deg]; battery_stuck: the reported charge is value;
    uniform_floor: an AR.Drone's optical flow finds nothing, neither for its reports nor for its hover, and its reported
    velocity is 0 (value 0), noise about 0 (1), or the leaking integral of its tilts (2): what a real one reports is
    unmeasured; obstacle_below: something value high [m] stands under its ultrasound; wind: air pushes by value [m/s^2],
    and an AR.Drone's reported tilt does not show how far it leans against it; ids_swapped: two vehicles have each
    other's address or id, from the start; camera_bumped: a camera is turned by value [deg]; picture_frozen,
    picture_black: its pictures come, and repeat the last one, are black; wrong_board: the entity carries the board of
    the other; capture_silent, capture_frozen: a motion capture system sends nothing, repeats its last frame;
    body_jumped: all systems have the entity's body value [m] aside; body_turned: they have it turned by value [deg] in
    its place, as one whose markers look the same from two sides; bodies_swapped: they name two bodies for each other;
    ranges_silent, ranges_frozen: a ranging system sends nothing, repeats each drone's last round; ranges_long:
    those of a drone are value [m] too long, as behind a wall; anchor_frozen: an anchor of the system holds its last
    range to each drone; odometry_silent, odometry_frozen, odometry_scaled: a target's own odometry ends, repeats its
    contents, reports value times the speed of its wheels."""
    entity: str
    """The drone, camera (of a drone's camera: the drone), motion capture or ranging system; for boards and bodies a
    drone or target; for odometry a target that reports its own."""
    start_s: Annotated[float, Field(ge=0)]
    """When it breaks [s after the simulator is ready]."""
    end_s: Annotated[float, Field(ge=0)] | None = None
    """When it heals [s after the simulator is ready]; none: it does not."""
    value: Annotated[float, Field(ge=-1000, le=1000)] | None = None
    """Size of the fault, as `kind` explains; none (uniform_floor: 0): 0.5 s, 0 m/s, 0.5 times, 0.1 m/s^2, 0.5 m/s, 1
    deg/s, 30 deg, a charge of 1, 0.4 m (body_jumped, ranges_long: 0.5 m), 1 m/s^2, 5 deg (body_turned: 180), each for
    the kind of that unit; battery_drop needs a value."""
    direction_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0
    """Direction of value: velocities counter-clockwise from forward, wind from world x; the axis that a camera turns
    about counter-clockwise from its image's right."""
    other: str | None = None
    """ids_swapped, wrong_board, bodies_swapped: the other vehicle; the drone or target whose board or body it is;
    anchor_frozen: the anchor."""

    @property
    def amount(self) -> float:
        """Return the value, or the usual one if none is given."""
        usual = RULES[self.kind].usual
        return self.value if self.value is not None else 0.0 if usual is None else usual

    def covers(self, now_s: float) -> bool:
        """Return whether it is active at a time."""
        return self.start_s <= now_s and (self.end_s is None or now_s < self.end_s)

    @model_validator(mode="after")
    def _complete(self) -> "Fault":
        rules = RULES[self.kind]
        if self.end_s is not None and self.end_s <= self.start_s:
            raise PydanticCustomError("order", "end_s must be after start_s")
        if rules.value is None and self.value is not None:
            raise PydanticCustomError("value", "{kind} has no value", {"kind": str(self.kind)})
        if rules.value is not None and self.value is None and rules.usual is None:
            raise PydanticCustomError("value", "{kind} needs a value", {"kind": str(self.kind)})
        if rules.value is not None and not rules.value[0] <= self.amount <= rules.value[1]:
            ends = {"kind": str(self.kind), "least": rules.value[0], "most": rules.value[1]}
            raise PydanticCustomError("value", "value of {kind} must be from {least} to {most}", ends)
        if rules.other != (self.other is not None) or self.other == self.entity:
            text = "{kind} needs another entity in other" if rules.other else "{kind} has no other"
            raise PydanticCustomError("other", text, {"kind": str(self.kind)})
        if self.kind is FaultKind.IDS_SWAPPED and (self.start_s or self.end_s is not None):
            raise PydanticCustomError("order", "ids are swapped from the start (start_s: 0) to the end")
        return self


def of_part(faults: Iterable[Fault], *parts: Part) -> tuple[Fault, ...]:
    """Return the faults of some kinds of parts."""
    return tuple(fault for fault in faults if RULES[fault.kind].part in parts)


def standing(faults: Iterable[Fault], kind: FaultKind, now_s: float, entity: str | None = None) -> Fault | None:
    """Return the first fault of a kind that is active at a time, of one entity or of any."""
    found = (f for f in faults if f.kind is kind and entity in (None, f.entity) and f.covers(now_s))
    return next(found, None)


def exchanged(faults: Iterable[Fault]) -> dict[str, str]:
    """Return, for each vehicle whose address leads to another one's body, the name of that body."""
    pairs = [(f.entity, f.other) for f in faults if f.kind is FaultKind.IDS_SWAPPED and f.other is not None]
    return {a: b for pair in pairs for a, b in (pair, pair[::-1])}
