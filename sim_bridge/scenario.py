"""Scenario files: target path, errors of the emulated sensors, faults, seed.

The file format of `config/scenarios/*.yaml`. The ground station passes a scenario on unread, as JSON; it is validated
here. Units are in the key names; a pair of numbers is a range that each drone draws its own value from.
"""

import math
from collections.abc import Iterable
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar, assert_never

from pydantic import AfterValidator, BeforeValidator, Field, ValidationError, create_model
from pydantic_core import PydanticCustomError

from groundstation.errors import SettingsError
from groundstation.vehicles import VehicleKind, all_kinds
from sim_bridge.fault_kinds import Fault
from sim_bridge.section import Section
from sim_bridge.surroundings import FloorZone, LinkBursts, Obstacle, ScenarioExpectation
from sim_bridge.target_paths import (
    AlongWalls,
    Anywhere,
    FigureEight,
    Kidnap,
    Path,
    RandomWalk,
    Sprint,
    Standstill,
    Waypoints,
    rising,
)

# Between targets of which the scenario says nothing by name.
_APART_TURNS, _APART_M = 0.15, 1.0
_Figures = TypeVar("_Figures", bound=Section)
Gain = Annotated[float, Field(ge=0.3, le=1.5)]
Delay = Annotated[float, Field(ge=0, le=500)]
Jump = Annotated[float, Field(ge=0, le=180)]
Share = Annotated[float, Field(ge=0, le=1)]


class TargetScenario(Section):
    """A simulated target, by default a TurtleBot."""

    path: Annotated[Path, Field(discriminator="shape")] = FigureEight()
    """Path of the target."""
    base: Literal["turtlebot_2", "person", "rc_car"] = "turtlebot_2"
    """Limits of its motion. turtlebot_2: 0.7 m/s, 0.5 m/s^2, 180 deg/s; person: 1.5 m/s, 2 m/s^2, 360 deg/s;
    rc_car: 3 m/s, 4 m/s^2, 180 deg/s."""
    kidnaps: tuple[Kidnap, ...] = ()
    """Times at which somebody carries it away."""
    departs_after_team_s: Annotated[float, Field(ge=0, le=86_400)] | None = 3.0
    """The target stays parked at the start of its path until this long after all drones took off [s]; none: it drives
    from the beginning."""
    max_speed_m_s: Annotated[float, Field(gt=0, le=3)] = 0.7
    """Top speed of the target [m/s]; never more than its base's."""
    slip: Annotated[float, Field(ge=0, le=0.5)] = 0.05
    """Standard deviation of its wheel slip, as a share of the speed."""


def _beside(scenario: TargetScenario, rank: int) -> TargetScenario:
    """Return the scenario of the rank-th target (0: the first) from the one given for all, so that none meet.

    On an eight each is some way ahead of the one before (half a turn ahead, they would meet where the path crosses
    itself); those that wait or walk at random start 1 m apart; along walls each starts in a corner of its own, and
    anywhere each has a place of its own.
    """
    path = scenario.path
    moved: dict[str, object] = {}
    match path:
        case FigureEight():
            moved = {"start_phase": math.fmod(path.start_phase + rank * _APART_TURNS, 1.0)}
        case Standstill():
            moved = {"position_m": (path.position_m[0] + rank * _APART_M, path.position_m[1])}
        case RandomWalk() | Sprint():
            moved = {"start_m": (path.start_m[0] + rank * _APART_M, path.start_m[1])}
        case AlongWalls():
            moved = {"start_corner": (path.start_corner + rank) % 4}
        case Anywhere():
            pass
        case Waypoints():
            moved = {"points_m": tuple((x, y + rank * _APART_M) for x, y in path.points_m)}
        case other:
            assert_never(other)
    return scenario.model_copy(update={"path": path.model_copy(update=moved)})


def _known_firmware(name: str) -> str:
    known = [firmware for kind in all_kinds().values() for firmware in kind.emulated_firmwares]
    if name not in known:
        raise PydanticCustomError("firmware", f"known firmwares: {', '.join(known)}")
    return name


Firmware = Annotated[str, AfterValidator(_known_firmware)]


class DroneScenario(Section):
    """Every emulated AR.Drone: firmware, errors of its navdata, battery, disturbances.

    Tellos and vehicles behind ROS 2, which have not been measured, get the same errors: velocity (its gain about 1),
    height, tilt, heading, rates; their battery and the unrest of the air are set here, too.
    """

    firmware: Firmware = "ar2-2.3"
    """Firmware that the drones emulate: version, size of the navdata packets, options and settings that exist."""
    firmware_by_drone: dict[str, Firmware] = Field(default={})
    """Firmware of single drones, by name, where it differs."""
    omit_options: tuple[Annotated[int, Field(ge=1, le=27)], ...] = ()
    """Numbers of navdata options that are never sent, for clients that expect something else there."""
    navdata_hz: Annotated[float, Field(ge=1, le=200)] = 200.0
    """Rate of full navdata packets [Hz]."""
    velocity_gain: Annotated[tuple[Gain, Gain], AfterValidator(rising)] = (0.80, 0.90)
    """Reported velocity divided by true velocity."""
    velocity_delay_ms: Annotated[tuple[Delay, Delay], AfterValidator(rising)] = (20.0, 40.0)
    """Age of the reported velocity [ms]."""
    velocity_noise_m_s: Annotated[float, Field(ge=0, le=1)] = 0.03
    """Noise of the reported velocity, one sigma [m/s]."""
    height_noise_m: Annotated[float, Field(ge=0, le=1)] = 0.034
    """Noise of the reported height, one sigma [m]."""
    height_delay_ms: Annotated[float, Field(ge=0, le=500)] = 85.0
    """Age of the reported height [ms]."""
    attitude_bias_deg: Annotated[float, Field(ge=0, le=10)] = 0.8
    """Constant error of roll and pitch before the flat trim, one sigma [deg]."""
    attitude_noise_deg: Annotated[float, Field(ge=0, le=20)] = 1.0
    """Slow error of roll and pitch, one sigma [deg]."""
    attitude_correlation_s: Annotated[float, Field(gt=0, le=1000)] = 5.0
    """Correlation time of that error [s]."""
    yaw_wander_deg: Annotated[float, Field(ge=0, le=90)] = 3.0
    """Slow error of the heading, one sigma [deg]."""
    yaw_wander_correlation_s: Annotated[float, Field(gt=0, le=1000)] = 30.0
    """Correlation time of that error [s]."""
    yaw_jump_at_lift_off_deg: Annotated[tuple[Jump, Jump], AfterValidator(rising)] = (60.0, 143.0)
    """Size of the heading's jump when the motors start [deg], as the magnetometer causes it; either direction."""
    battery: Annotated[tuple[Share, Share], AfterValidator(rising)] = (0.85, 1.0)
    """Charge at the start, 0 to 1."""
    battery_drain_per_min: Annotated[float, Field(ge=0, le=10)] = 0.06
    """Charge that a minute of flight costs, as a share of the full charge."""
    air_unrest_m_s2: Annotated[float, Field(ge=0, le=5)] = 0.08
    """Random acceleration of a hovering drone by the air of the room, one sigma [m/s^2]."""
    moving_air_lean_deg: Annotated[float, Field(ge=0, le=20)] = 0.0
    """Largest lean of a drone that holds its place in the room's moving air [deg]; as on a real one, its reported tilt
    does not show it."""
    moving_air_correlation_s: Annotated[float, Field(gt=0, le=1000)] = 10.0
    """Correlation time of that air's speed and direction [s]."""
    downwash: bool = True
    """Whether drones disturb those below them."""
    echoes_of_bodies: bool = False
    """Whether the ultrasound measures to the top of targets and obstacles below the drone, not to the floor."""
    ultrasound_crosstalk: bool = True
    """Whether drones near each other with the same ultrasound rate (pic:ultrasound_freq) hear each other's echoes."""

    def firmware_of(self, name: str) -> str:
        """Return the firmware of one drone."""
        return self.firmware_by_drone.get(name, self.firmware)


class CameraScenario(Section):
    """Every emulated camera: its stream and the errors of its pictures."""

    fps: Annotated[float, Field(ge=0.1, le=60)] = 15.0
    """Pictures per second."""
    video_delay_ms: Annotated[float, Field(ge=0, le=1000)] = 120.0
    """Mean time from exposure to arrival [ms]."""
    video_jitter_ms: Annotated[float, Field(ge=0, le=500)] = 20.0
    """Half width of the uniform spread about that delay [ms]."""
    mounting_errors: bool = True
    """Whether cameras, in the room and on drones, have errors of mounting (attitude_std_deg, position_std_m) and lens
    (the calibration's std) with the field's deviations, drawn from the seed; false: each is exactly as the field
    says."""
    frame_loss: Annotated[float, Field(ge=0, le=1)] = 0.05
    """Share of pictures that are lost; over TCP, that come 200 ms late."""
    corner_noise_px: Annotated[float, Field(ge=0, le=5)] = 0.2
    """Displacement of a corner's image, one sigma per axis [px]."""
    pixel_noise: Annotated[float, Field(ge=0, le=100)] = 2.0
    """Noise of a pixel, one sigma [grey levels]."""
    blur_px: Annotated[float, Field(ge=0, le=10)] = 0.7
    """Defocus, one sigma [px]."""
    exposure_ms: Annotated[float, Field(ge=0, le=60)] = 4.0
    """Exposure time, which causes motion blur [ms]."""
    rolling_shutter_ms: Annotated[float, Field(ge=0, le=60)] = 0.0
    """Time from the exposure of the first row to that of the last [ms]."""
    light: Annotated[float, Field(ge=0.02, le=1)] = 1.0
    """Share of a full exposure."""
    shot_noise: Annotated[float, Field(ge=0, le=30)] = 0.0
    """Photon noise at white, one sigma [grey levels]."""
    jpeg_quality: Annotated[int, Field(ge=5, le=100)] = 85
    """Quality of the JPEGs."""
    floor: Literal["carpet", "wood", "concrete", "tiles"] = "carpet"
    """Kind of floor."""


class CommonScenario(Section):
    """A scenario file without the sections that kinds of vehicles bring."""

    schema_version: Literal[1] = 1
    """Version of the file format."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of all random figures; --seed overrides it."""
    target: TargetScenario = TargetScenario()
    """Behaviour of the target; of several, of those that `targets` leaves out: one behind the other on the path,
    or 1 m apart."""
    targets: dict[str, TargetScenario] = Field(default={})
    """Behaviour of single targets, by name."""
    drones: DroneScenario = DroneScenario()
    """Every emulated AR.Drone. Errors common to vehicles with optical flow apply to Tellos and ROS 2 vehicles as
    well."""
    cameras: CameraScenario = CameraScenario()
    """Every emulated camera."""
    faults: tuple[Fault, ...] = ()
    """Faults and their times."""
    obstacles: tuple[Obstacle, ...] = ()
    """People and things that hide markers behind them."""
    floor_zones: tuple[FloorZone, ...] = ()
    """Parts of the floor over which optical flow is off."""
    link_bursts: LinkBursts = LinkBursts()
    """Random times without a radio link, for each vehicle."""
    natnet_multicast: bool = False
    """Whether emulated NatNet systems send frames to Motive's multicast group, on this host only, instead of to each
    client. Not while a program here follows a real Motive."""
    expected: ScenarioExpectation | None = None
    """How `groundstation experiment scenarios` flies it, and the results it must have; the simulator does not read
    it."""

    def of_targets(self, names: Iterable[str]) -> dict[str, TargetScenario]:
        """Return the scenario of each target of a field."""
        return {name: self.targets.get(name) or _beside(self.target, rank) for rank, name in enumerate(names)}

    def of_kind(self, key: str, model: type[_Figures]) -> _Figures:
        """Return the section that a kind of vehicle brings."""
        section = getattr(self, key)
        assert isinstance(section, model), f"{key} is no {model.__name__}"
        return section


def _section_of_kind(kind: VehicleKind, reference: str) -> tuple[Any, Any]:
    """Return type and default of a section; for an unusable one, a type that refuses every scenario with it."""
    try:
        model = resolve_name(reference)
        return model, Field(default=model(), description=str(model.__doc__))
    except Exception as error:  # noqa: BLE001 - a plug-in is foreign code: its failure is reported where it is used
        told = {"kind": kind.name, "why": f"{type(error).__name__}: {error}"}

    def refuse(_: object) -> None:
        raise PydanticCustomError("kind", "the figures of {kind} cannot be used: {why}", told)

    return Annotated[None, BeforeValidator(refuse)], Field(default=None, description=f"Of {kind.name}.")


def _with_kinds() -> Any:
    brought: dict[str, Any] = {
        key: _section_of_kind(kind, reference)
        for kind in all_kinds().values()
        for key, reference in kind.scenario.items()
        if key not in CommonScenario.model_fields
    }
    text = "A scenario file; the defaults are the figures measured on real drones."
    return create_model("Scenario", __base__=CommonScenario, __module__=__name__, __doc__=text, **brought)


if TYPE_CHECKING:
    Scenario = CommonScenario
else:
    Scenario = _with_kinds()


def parse_scenario(text: str | bytes) -> Scenario:
    """Return the scenario in a JSON text; raises SettingsError naming every wrong key at once."""
    try:
        return Scenario.model_validate_json(text)
    except ValidationError as error:
        raise SettingsError(describe_problems("scenario", error)) from None


def describe_problems(what: str, error: ValidationError) -> list[str]:
    """Return one line for each wrong key: where, what is wrong, and what was found."""
    lines = []
    for problem in error.errors(include_url=False):
        where = ".".join(str(part) for part in problem["loc"]) or "(all of it)"
        lines.append(f"{what}: {where}: {problem['msg']} (got {problem['input']!r})")
    return lines
