"""What the simulator does: target path, figures of the emulated sensors, faults, seed.

The file format of `config/scenarios/*.yaml`. The ground station passes a scenario on unread, as JSON; it is validated
here. Units are in the key names; a pair of numbers is a range that each drone draws its own value from.
"""

import math
from collections.abc import Callable, Iterable
from enum import StrEnum
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic_core import PydanticCustomError

from drivers.ardrone.wire.tags import OPTION_SIZES
from groundstation.errors import SettingsError


class _Section(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def _rising(interval: tuple[float, float]) -> tuple[float, float]:
    if interval[0] > interval[1]:
        raise PydanticCustomError("rising", "the first number of a range must not exceed the second")
    return interval


# Between targets of which the scenario says nothing by name.
_APART_TURNS, _APART_M = 0.15, 1.0
Gain = Annotated[float, Field(ge=0.3, le=1.5)]
Delay = Annotated[float, Field(ge=0, le=500)]
Jump = Annotated[float, Field(ge=0, le=180)]
Share = Annotated[float, Field(ge=0, le=1)]
Place = Annotated[float, Field(ge=-100, le=100)]


class FigureEight(_Section):
    """A lemniscate along world x, at constant speed; `start_phase` in turns (0: centre, heading to +x +y)."""

    shape: Literal["figure_eight"] = "figure_eight"
    half_length_m: Annotated[float, Field(gt=0, le=50)] = 3.2
    half_width_m: Annotated[float, Field(gt=0, le=50)] = 0.8
    speed_m_s: Annotated[float, Field(gt=0, le=0.7)] = 0.2
    start_phase: Annotated[float, Field(ge=0, le=1)] = 0.0
    centre_m: tuple[Place, Place] = (0.0, 0.0)


class Standstill(_Section):
    """A target that waits where it is until it is steered over `@sim`."""

    shape: Literal["none"] = "none"
    position_m: tuple[Place, Place] = (0.0, 0.0)
    yaw_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0


class TargetScenario(_Section):
    """The TurtleBot: its path, its top speed, and the standard deviation of its wheel slip (share of the speed).

    departs_after_team_s: it stays parked at the start of its path until so long after all drones took off; without
    it, it drives from the beginning.
    """

    path: Annotated[FigureEight | Standstill, Field(discriminator="shape")] = FigureEight()
    departs_after_team_s: Annotated[float, Field(ge=0, le=86_400)] | None = 3.0
    max_speed_m_s: Annotated[float, Field(gt=0, le=0.7)] = 0.7
    slip: Annotated[float, Field(ge=0, le=0.5)] = 0.05


def _beside(scenario: TargetScenario, rank: int) -> TargetScenario:
    """Return the scenario of the rank-th target (0: the first) where one is told for all, so that none meet.

    On an eight each is some way ahead of the one before (half a turn ahead, they would meet where the path crosses
    itself); those that wait stand 1 m apart.
    """
    path = scenario.path
    moved: dict[str, object]
    if isinstance(path, FigureEight):
        moved = {"start_phase": math.fmod(path.start_phase + rank * _APART_TURNS, 1.0)}
    else:
        moved = {"position_m": (path.position_m[0] + rank * _APART_M, path.position_m[1])}
    return scenario.model_copy(update={"path": path.model_copy(update=moved)})


def _known_firmware(name: str) -> str:
    if name not in OPTION_SIZES:
        raise PydanticCustomError("firmware", f"known firmwares: {', '.join(OPTION_SIZES)}")
    return name


Firmware = Annotated[str, AfterValidator(_known_firmware)]


class DroneScenario(_Section):
    """Every emulated AR.Drone: firmware, rate and errors of its navdata, battery, unrest of the air, the others' wake.

    firmware_by_drone: of those that differ; omit_options: numbers of navdata options that are never sent;
    attitude_bias_deg: before the flat trim, one sigma; ultrasound_crosstalk: drones near each other with the same
    `pic:ultrasound_freq` hear each other's echoes.
    """

    firmware: Firmware = "ar2-2.3"
    firmware_by_drone: dict[str, Firmware] = {}
    omit_options: tuple[Annotated[int, Field(ge=1, le=27)], ...] = ()
    navdata_hz: Annotated[float, Field(ge=1, le=200)] = 200.0
    velocity_gain: Annotated[tuple[Gain, Gain], AfterValidator(_rising)] = (0.80, 0.90)
    velocity_delay_ms: Annotated[tuple[Delay, Delay], AfterValidator(_rising)] = (20.0, 40.0)
    velocity_noise_m_s: Annotated[float, Field(ge=0, le=1)] = 0.03
    height_noise_m: Annotated[float, Field(ge=0, le=1)] = 0.034
    height_delay_ms: Annotated[float, Field(ge=0, le=500)] = 85.0
    attitude_bias_deg: Annotated[float, Field(ge=0, le=10)] = 0.8
    attitude_noise_deg: Annotated[float, Field(ge=0, le=20)] = 1.0
    attitude_correlation_s: Annotated[float, Field(gt=0, le=1000)] = 5.0
    yaw_wander_deg: Annotated[float, Field(ge=0, le=90)] = 3.0
    yaw_wander_correlation_s: Annotated[float, Field(gt=0, le=1000)] = 30.0
    yaw_jump_at_lift_off_deg: Annotated[tuple[Jump, Jump], AfterValidator(_rising)] = (60.0, 143.0)
    battery: Annotated[tuple[Share, Share], AfterValidator(_rising)] = (0.85, 1.0)
    battery_drain_per_min: Annotated[float, Field(ge=0, le=10)] = 0.06
    air_unrest_m_s2: Annotated[float, Field(ge=0, le=5)] = 0.08
    downwash: bool = True
    ultrasound_crosstalk: bool = True

    def firmware_of(self, name: str) -> str:
        """Return the firmware of one drone."""
        return self.firmware_by_drone.get(name, self.firmware)


class CopterScenario(_Section):
    """Every emulated MAVLink vehicle: errors of its inertial sensors, battery, unrest of the air.

    configured: it comes with the parameters that indoor flight needs, not with the factory's.
    """

    configured: bool = True
    attitude_noise_deg: Annotated[float, Field(ge=0, le=5)] = 0.3
    gyro_bias_deg_s: Annotated[float, Field(ge=0, le=5)] = 0.05
    battery: Annotated[tuple[Share, Share], AfterValidator(_rising)] = (0.85, 1.0)
    battery_drain_per_min: Annotated[float, Field(ge=0, le=10)] = 0.05
    air_unrest_m_s2: Annotated[float, Field(ge=0, le=5)] = 0.08


class CameraScenario(_Section):
    """Every emulated camera: its stream and the errors of its picture.

    video_jitter_ms: half width of the uniform spread about the delay; corner_noise_px: displacement of a corner's
    image, one sigma per axis; pixel_noise: one sigma in grey levels; blur_px: sigma of the defocus; exposure_ms: of
    which motion blur comes; rolling_shutter_ms: from the first row to the last; light: share of a full exposure;
    shot_noise: photon noise at white, one sigma in grey levels; floor: what lies under the scene.
    """

    fps: Annotated[float, Field(ge=0.1, le=60)] = 15.0
    video_delay_ms: Annotated[float, Field(ge=0, le=1000)] = 120.0
    video_jitter_ms: Annotated[float, Field(ge=0, le=500)] = 20.0
    frame_loss: Annotated[float, Field(ge=0, le=1)] = 0.05
    corner_noise_px: Annotated[float, Field(ge=0, le=5)] = 0.2
    pixel_noise: Annotated[float, Field(ge=0, le=100)] = 2.0
    blur_px: Annotated[float, Field(ge=0, le=10)] = 0.7
    exposure_ms: Annotated[float, Field(ge=0, le=60)] = 4.0
    rolling_shutter_ms: Annotated[float, Field(ge=0, le=60)] = 0.0
    light: Annotated[float, Field(ge=0.02, le=1)] = 1.0
    shot_noise: Annotated[float, Field(ge=0, le=30)] = 0.0
    jpeg_quality: Annotated[int, Field(ge=5, le=100)] = 85
    floor: Literal["carpet", "wood", "concrete", "tiles"] = "carpet"


class FaultKind(StrEnum):
    """What a scenario can break."""

    NAVDATA_SILENT = "navdata_silent"
    AT_DEAF = "at_deaf"
    CAMERA_CUT = "camera_cut"
    CAMERA_STALL = "camera_stall"
    BATTERY_DROP = "battery_drop"
    PROPELLER_BLOCKED = "propeller_blocked"


class Fault(_Section):
    """One thing that breaks at `start_s` and, if it says so, heals at `end_s` [s after the simulator is ready].

    entity: drone or camera; value: new battery charge (0..1) for a drop.
    """

    kind: FaultKind
    entity: str
    start_s: Annotated[float, Field(ge=0)]
    end_s: Annotated[float, Field(ge=0)] | None = None
    value: Annotated[float, Field(ge=0, le=1)] | None = None

    @model_validator(mode="after")
    def _complete(self) -> "Fault":
        if self.end_s is not None and self.end_s <= self.start_s:
            raise PydanticCustomError("order", "end_s must be after start_s")
        if (self.kind is FaultKind.BATTERY_DROP) != (self.value is not None):
            raise PydanticCustomError("value", "value belongs to battery_drop, and only there")
        return self


class Scenario(_Section):
    """A scenario file; every key has the honest figure as its default.

    targets: what some targets do, by name, where a field has several; `target` says what all others do.
    """

    schema_version: Literal[1] = 1
    seed: Annotated[int, Field(ge=0)] = 1
    target: TargetScenario = TargetScenario()
    targets: dict[str, TargetScenario] = {}
    drones: DroneScenario = DroneScenario()
    mavlink: CopterScenario = CopterScenario()
    cameras: CameraScenario = CameraScenario()
    faults: tuple[Fault, ...] = ()

    def of_targets(self, names: Iterable[str]) -> dict[str, TargetScenario]:
        """Return what each target of a field does."""
        return {name: self.targets.get(name) or _beside(self.target, rank) for rank, name in enumerate(names)}


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


# What the default scenario promises: a weaker value would make a run look better than a flight.
_HONEST: tuple[tuple[str, Callable[[Scenario], bool]], ...] = (
    ("drones.navdata_hz: 200", lambda s: s.drones.navdata_hz == 200),
    (
        "drones.velocity_gain: reaching down to 0.80, at most 0.90",
        lambda s: _within(s.drones.velocity_gain, 0.80, 0.90),
    ),
    ("drones.velocity_delay_ms: from 20 up to 40", lambda s: _at_least(s.drones.velocity_delay_ms, 20, 40)),
    ("drones.velocity_noise_m_s: >= 0.03", lambda s: s.drones.velocity_noise_m_s >= 0.03),
    ("drones.height_noise_m: >= 0.034", lambda s: s.drones.height_noise_m >= 0.034),
    ("drones.height_delay_ms: >= 85", lambda s: s.drones.height_delay_ms >= 85),
    ("drones.attitude_noise_deg: >= 1", lambda s: s.drones.attitude_noise_deg >= 1),
    ("drones.attitude_correlation_s: >= 5", lambda s: s.drones.attitude_correlation_s >= 5),
    ("drones.yaw_wander_deg: >= 3", lambda s: s.drones.yaw_wander_deg >= 3),
    (
        "drones.yaw_jump_at_lift_off_deg: from 60 up to 143",
        lambda s: _at_least(s.drones.yaw_jump_at_lift_off_deg, 60, 143),
    ),
    ("drones.downwash: true", lambda s: s.drones.downwash),
    ("drones.ultrasound_crosstalk: true", lambda s: s.drones.ultrasound_crosstalk),
    ("drones.attitude_bias_deg: >= 0.8", lambda s: s.drones.attitude_bias_deg >= 0.8),
    ("cameras.fps: <= 15", lambda s: s.cameras.fps <= 15),
    ("cameras.video_delay_ms: >= 120", lambda s: s.cameras.video_delay_ms >= 120),
    ("cameras.video_jitter_ms: >= 20", lambda s: s.cameras.video_jitter_ms >= 20),
    ("cameras.frame_loss: >= 0.05", lambda s: s.cameras.frame_loss >= 0.05),
    ("cameras.corner_noise_px: >= 0.2", lambda s: s.cameras.corner_noise_px >= 0.2),
    (
        "target.path: a figure eight at >= 0.2 m/s",
        lambda s: all(_is_honest_path(target.path) for target in (s.target, *s.targets.values())),
    ),
    ("target.slip: > 0", lambda s: all(target.slip > 0 for target in (s.target, *s.targets.values()))),
)


def _within(interval: tuple[float, float], low: float, high: float) -> bool:
    return interval[0] <= low and interval[1] <= high


def _at_least(interval: tuple[float, float], low: float, high: float) -> bool:
    return interval[0] >= low and interval[1] >= high


def _is_honest_path(path: FigureEight | Standstill) -> bool:
    return isinstance(path, FigureEight) and path.speed_m_s >= 0.2


def weaker_than_reality(scenario: Scenario) -> list[str]:
    """Return what a scenario claims that real drones and cameras do not keep; empty for an honest one."""
    return [promise for promise, keeps in _HONEST if not keeps(scenario)]
