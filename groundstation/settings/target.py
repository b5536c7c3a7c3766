"""The target: what is tracked, and by which marker it is known."""

from typing import Annotated

from pydantic import Field

from groundstation.settings.values import MarkerCode, Name, Section, SquareSize, Vector3


class TargetMarker(Section):
    """Checkerboard flat on top of the target, over its centre, `height_m` above the floor."""

    code: MarkerCode
    height_m: Annotated[float, Field(ge=0, le=3)] = 0.4
    square_mm: SquareSize = 44.0

    @property
    def position_m(self) -> Vector3:
        """Return the centre of the board [base of the target, on the floor]."""
        return (0.0, 0.0, self.height_m)

    @property
    def square_m(self) -> float:
        """Return the side of one square [m]."""
        return self.square_mm / 1000


class Target(Section):
    """The ground robot that is tracked; `acceleration_std_m_s2` says how briskly it may manoeuvre."""

    name: Name
    marker: TargetMarker
    acceleration_std_m_s2: Annotated[float, Field(gt=0, le=10)] = 0.3
