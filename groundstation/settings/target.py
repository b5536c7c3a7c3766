"""Settings of the targets: marker and motion model."""

from typing import Annotated, Any, Literal, Self, get_args

from pydantic import Field, ValidationError, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from drivers.target_odometry.settings import parse_source
from groundstation.settings.marker import MarkerSettings
from groundstation.settings.values import Name, SettingsSection, Vector3, read_by

# The motion models to which each of these keys belongs.
_TURNING, _SWITCHING = ("coordinated_turn", "manoeuvring"), ("manoeuvring",)
_BELONGS_TO = {
    "turn_rate_std_deg_s": _TURNING,
    "turn_rate_correlation_s": _TURNING,
    "straight_s": _SWITCHING,
    "turning_s": _SWITCHING,
}
Duration = Annotated[float, Field(ge=0.1, le=600)]
Base = Literal["turtlebot_2", "person", "rc_car"]
# Limits of each base: speed [m/s], acceleration [m/s^2], turn rate [deg/s]. A Kobuki's own figures; people walk
# briskly, and turn about within half a second; a model car of 1:10, indoors.
_MEANS: dict[str, tuple[float, float, float]] = {
    "turtlebot_2": (0.7, 0.5, 180.0),
    "person": (1.5, 2.0, 360.0),
    "rc_car": (3.0, 4.0, 180.0),
}
_MEANS_KEYS = ("max_speed_m_s", "max_acceleration_m_s2", "max_turn_rate_deg_s")
# Deviation of the acceleration in a manoeuvre, as a multiple of the base's limit.
_BRISK = 2.4


class TargetMarkerSettings(MarkerSettings):
    """The marker flat on top of the target, over its centre, `height_m` above the floor."""

    height_m: Annotated[float, Field(ge=0, le=3)] = 0.4
    """Height [m] of the marker above the floor."""

    @property
    def position_m(self) -> Vector3:
        """Return the centre of the board [base of the target, on the floor]."""
        return (0.0, 0.0, self.height_m)


class TargetOdometrySettings(SettingsSection):
    """A target's report of its own motion: a sensor besides the cameras, which overrule it."""

    source: Annotated[str, read_by(parse_source)]
    """The topic of its nav_msgs/Odometry behind a ROS 2 Zenoh router: ros2://192.168.1.20/odom?domain=0 (port 7447 and
    domain 0 unless given). Only its velocity in its own frame is used."""
    speed_std_m_s: Annotated[float, Field(gt=0, le=1)] = 0.05
    """Standard deviation [m/s] of the reported velocity, slip of the wheels included."""
    delay_ms: Annotated[float, Field(ge=0, le=500)] = 20.0
    """Time [ms] from a measurement to its arrival."""
    silent_after_s: Annotated[float, Field(ge=0.2, le=10)] = 1.0
    """Without odometry for so long [s] the operator is told; the target is tracked by cameras alone."""


class TrackedBody(SettingsSection):
    """A ground robot that is tracked: its marker and its motion model."""

    marker: TargetMarkerSettings
    """The marker on top of the target, over its centre."""
    model: Literal["constant_velocity", "coordinated_turn", "manoeuvring"] = "constant_velocity"
    """Motion model. constant_velocity: straight ahead with white accelerations; coordinated_turn: arcs; manoeuvring:
    switches between the two, with a belief for each."""
    base: Base = "turtlebot_2"
    """What kind of target it is, which says what it can do at most: turtlebot_2: 0.7 m/s, 0.5 m/s^2, 180 deg/s;
    person: 1.5 m/s, 2 m/s^2, 360 deg/s; rc_car: 3 m/s, 4 m/s^2, 180 deg/s. For any other, the next three keys."""
    max_speed_m_s: Annotated[float, Field(gt=0, le=10)] | None = None
    """Highest speed [m/s]; none: the base's."""
    max_acceleration_m_s2: Annotated[float, Field(gt=0, le=20)] | None = None
    """Highest acceleration along its way that it keeps up [m/s^2]; none: the base's."""
    max_turn_rate_deg_s: Annotated[float, Field(gt=0, le=720)] | None = None
    """Highest turn rate [deg/s]; none: the base's."""
    acceleration_std_m_s2: Annotated[float, Field(gt=0, le=50)] | None = None
    """Standard deviation [m/s^2] of each component of the target's acceleration while it manoeuvres, which is assumed
    for 7 % of the time and 0.12 s at a time; none: 2.4 times `max_acceleration_m_s2` (turtlebot_2 1.2, person 4.8,
    rc_car 9.6). Too small: turns are taken for errors and the target is lost; too large costs little."""
    turn_rate_std_deg_s: Annotated[float, Field(gt=0, le=360)] | None = None
    """Models that turn: standard deviation [deg/s] of the turn rate; none: 0.16 of `max_turn_rate_deg_s`
    (turtlebot_2 28.6)."""
    turn_rate_correlation_s: Duration | None = None
    """Models that turn: time [s] for which a turn rate persists; none: 3."""
    straight_s: Duration | None = None
    """manoeuvring: mean time [s] straight ahead; none: 4."""
    turning_s: Duration | None = None
    """manoeuvring: mean time [s] in a turn; none: 2."""
    heading: bool = False
    """Whether the heading of the target's marker is estimated too, which helps the models that turn."""
    odometry: TargetOdometrySettings | None = None
    """The target's own odometry, if it is to be heard."""

    @model_validator(mode="before")
    @classmethod
    def _by_its_base(cls, given: Any) -> Any:
        """Fill in the limits of the base."""
        base = given.get("base", "turtlebot_2") if isinstance(given, dict) else None
        if base not in get_args(Base):
            return given
        means = dict(zip(_MEANS_KEYS, _MEANS[str(base)], strict=True))
        told = {**given, **{key: value for key, value in means.items() if given.get(key) is None}}
        steady = told["max_acceleration_m_s2"]
        if told.get("acceleration_std_m_s2") is None and isinstance(steady, float | int):
            told["acceleration_std_m_s2"] = _BRISK * steady
        return told

    @model_validator(mode="after")
    def _of_its_model(self) -> Self:
        foreign = [k for k, models in _BELONGS_TO.items() if getattr(self, k) is not None and self.model not in models]
        if foreign:
            details = [InitErrorDetails(type=_foreign(k), loc=(k,), input=getattr(self, k)) for k in foreign]
            raise ValidationError.from_exception_data("Target", details)
        return self


class TargetSettings(TrackedBody):
    """The one target."""

    name: Name
    """Name of the target on the bus, in reports and on the page."""


class OneOfTargets(TrackedBody):
    """One of several targets."""

    weight: Annotated[float, Field(gt=0, le=100)] = 1.0
    """Weight of this target's uncertainty in the planner's cost, relative to the other targets."""


def _foreign(key: str) -> PydanticCustomError:
    return PydanticCustomError("model", "{text}", {"text": f"belongs to model: {' or '.join(_BELONGS_TO[key])}"})
