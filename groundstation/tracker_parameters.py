"""The settings of a tracker, from those of a field."""

from dataclasses import dataclass

from groundstation.control.parameters import ControlParameters, SafetyParameters, control_from_field, safety_from_field
from groundstation.control.search_parameters import SearchParameters, search_from_field
from groundstation.estimation import parameters as estimation
from groundstation.field.resolved import ResolvedField
from groundstation.planning import parameters as planning
from groundstation.sensing.from_field import sensors_from_field
from groundstation.sensing.models import SensorSuite


@dataclass(frozen=True, slots=True)
class TrackerParameters:
    """Settings of the tracker; `string_first`: first topology has one robot per level."""

    estimator: estimation.EstimatorParameters
    planner: planning.PlannerParameters
    sensors: SensorSuite
    control: ControlParameters
    safety: SafetyParameters
    search: SearchParameters
    string_first: bool = False


def parameters_from_field(field: ResolvedField) -> TrackerParameters:
    """Return the settings of the tracker of a resolved field."""
    return TrackerParameters(
        estimation.parameters_from_field(field),
        planning.parameters_from_field(field),
        sensors_from_field(field),
        control_from_field(field),
        safety_from_field(field),
        search_from_field(field),
        field.planner.initial_topology == "string",
    )
