"""The target: what is tracked, and by which marker it is known."""

from typing import Annotated

from pydantic import Field

from groundstation.settings.marker import Marker
from groundstation.settings.values import Name, Section, Vector3


class TargetMarker(Marker):
    """The marker flat on top of the target, over its centre, `height_m` above the floor."""

    height_m: Annotated[float, Field(ge=0, le=3)] = 0.4

    @property
    def position_m(self) -> Vector3:
        """Return the centre of the board [base of the target, on the floor]."""
        return (0.0, 0.0, self.height_m)


class Target(Section):
    """The ground robot that is tracked; `acceleration_std_m_s2` says how briskly it may manoeuvre."""

    name: Name
    marker: TargetMarker
    acceleration_std_m_s2: Annotated[float, Field(gt=0, le=10)] = 0.3
