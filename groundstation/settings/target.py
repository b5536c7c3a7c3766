"""The targets: what is tracked, by which marker it is known, and how it moves."""

from typing import Annotated, Literal, Self

from pydantic import Field, ValidationError, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from groundstation.settings.marker import Marker
from groundstation.settings.values import Name, Section, Vector3

# Which of the models of motion each of these keys belongs to.
_TURNING, _SWITCHING = ("coordinated_turn", "manoeuvring"), ("manoeuvring",)
_BELONGS_TO = {
    "turn_rate_std_deg_s": _TURNING,
    "turn_rate_correlation_s": _TURNING,
    "straight_s": _SWITCHING,
    "turning_s": _SWITCHING,
}
Duration = Annotated[float, Field(ge=0.1, le=600)]


class TargetMarker(Marker):
    """The marker flat on top of the target, over its centre, `height_m` above the floor."""

    height_m: Annotated[float, Field(ge=0, le=3)] = 0.4

    @property
    def position_m(self) -> Vector3:
        """Return the centre of the board [base of the target, on the floor]."""
        return (0.0, 0.0, self.height_m)


class TrackedBody(Section):
    """A ground robot that is tracked: its marker, and how it is expected to move.

    acceleration_std_m_s2: how briskly it may manoeuvre; turn_rate_*: of the rate at which it turns; straight_s and
    turning_s: how long it does either on average; heading: the way that its marker points is a state.
    None: the model's own figure.
    """

    marker: TargetMarker
    model: Literal["constant_velocity", "coordinated_turn", "manoeuvring"] = "constant_velocity"
    acceleration_std_m_s2: Annotated[float, Field(gt=0, le=10)] = 0.3
    turn_rate_std_deg_s: Annotated[float, Field(gt=0, le=360)] | None = None
    turn_rate_correlation_s: Duration | None = None
    straight_s: Duration | None = None
    turning_s: Duration | None = None
    heading: bool = False

    @model_validator(mode="after")
    def _of_its_model(self) -> Self:
        foreign = [k for k, models in _BELONGS_TO.items() if getattr(self, k) is not None and self.model not in models]
        if foreign:
            details = [InitErrorDetails(type=_foreign(k), loc=(k,), input=getattr(self, k)) for k in foreign]
            raise ValidationError.from_exception_data("Target", details)
        return self


class Target(TrackedBody):
    """The one ground robot that is tracked."""

    name: Name


class OneOfTargets(TrackedBody):
    """One of several ground robots; weight: what its uncertainty counts beside that of the others."""

    weight: Annotated[float, Field(gt=0, le=100)] = 1.0


def _foreign(key: str) -> PydanticCustomError:
    return PydanticCustomError("model", "{text}", {"text": f"belongs to model: {' or '.join(_BELONGS_TO[key])}"})
