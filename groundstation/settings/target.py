"""Settings of the targets: marker and motion model."""

from typing import Annotated, Literal, Self

from pydantic import Field, ValidationError, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from groundstation.settings.marker import MarkerSettings
from groundstation.settings.values import Name, SettingsSection, Vector3

# Which of the models of motion each of these keys belongs to.
_TURNING, _SWITCHING = ("coordinated_turn", "manoeuvring"), ("manoeuvring",)
_BELONGS_TO = {
    "turn_rate_std_deg_s": _TURNING,
    "turn_rate_correlation_s": _TURNING,
    "straight_s": _SWITCHING,
    "turning_s": _SWITCHING,
}
Duration = Annotated[float, Field(ge=0.1, le=600)]


class TargetMarkerSettings(MarkerSettings):
    """The marker flat on top of the target, over its centre, `height_m` above the floor."""

    height_m: Annotated[float, Field(ge=0, le=3)] = 0.4
    """Height [m] of the marker above the floor."""

    @property
    def position_m(self) -> Vector3:
        """Return the centre of the board [base of the target, on the floor]."""
        return (0.0, 0.0, self.height_m)


class TrackedBody(SettingsSection):
    """A ground robot that is tracked: its marker and its motion model."""

    marker: TargetMarkerSettings
    """The marker on top of the target, over its centre."""
    model: Literal["constant_velocity", "coordinated_turn", "manoeuvring"] = "constant_velocity"
    """Motion model. constant_velocity: straight ahead with white accelerations; coordinated_turn: arcs; manoeuvring:
    switches between the two, with a belief for each."""
    acceleration_std_m_s2: Annotated[float, Field(gt=0, le=10)] = 1.2
    """Standard deviation [m/s^2] of each component of the target's acceleration while it manoeuvres, which is assumed
    for 7 % of the time and 0.12 s at a time. Rule: 2.5 times its steady acceleration: TurtleBot 1.2, person 5,
    RC car 10. Too small: turns are taken for errors and the target is lost; too large costs little."""
    turn_rate_std_deg_s: Annotated[float, Field(gt=0, le=360)] | None = None
    """Models that turn: standard deviation [deg/s] of the turn rate; none: 28.6."""
    turn_rate_correlation_s: Duration | None = None
    """Models that turn: time [s] for which a turn rate persists; none: 3."""
    straight_s: Duration | None = None
    """manoeuvring: mean time [s] straight ahead; none: 4."""
    turning_s: Duration | None = None
    """manoeuvring: mean time [s] in a turn; none: 2."""
    heading: bool = False
    """Whether the heading of the target's marker is estimated too, which helps the models that turn."""

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
