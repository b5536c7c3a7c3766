"""Settings of a marker: a checkerboard with its code, or a tag of an ArUco or AprilTag dictionary."""

import re
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationError, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from groundstation.geometry.board import Checkerboard
from groundstation.geometry.tag import SquareTag, tag_fault
from groundstation.settings.values import MarkerCode, SettingsSection, SquareSize

TagId = Annotated[int, Field(ge=0)]
TAGS_MM = (10.0, 1000.0)
TagSize = Annotated[float, Field(ge=TAGS_MM[0], le=TAGS_MM[1])]


class MarkerSettings(SettingsSection):
    """A flat marker: `code` and `square_mm` of a checkerboard, or `dictionary`, `id` and `size_mm` of a tag."""

    kind: Literal["checkerboard", "aruco"] = "checkerboard"
    """checkerboard: Skein's own marker, whose pose is ten times more accurate; aruco: a square tag of an ArUco or
    AprilTag dictionary, or of a plug-in's."""
    code: MarkerCode | None = None
    """Checkerboard: its number; each marker of a field its own."""
    square_mm: SquareSize = 44.0
    """Checkerboard: side [mm] of one square."""
    dictionary: str | None = None
    """Tag: OpenCV's name of its dictionary, such as DICT_APRILTAG_36H11, or that of a plug-in (entry point
    `skein.markers`)."""
    id: TagId | None = None
    """Tag: its number in the dictionary."""
    size_mm: TagSize | None = None
    """Tag: side [mm] of its black square."""

    @model_validator(mode="after")
    def _complete(self) -> Self:
        faults = self._checkerboard_faults() if self.kind == "checkerboard" else self._tag_faults()
        if faults:
            details = [InitErrorDetails(type=fault, loc=(key,), input=getattr(self, key)) for key, fault in faults]
            raise ValidationError.from_exception_data("Marker", details)
        return self

    def _checkerboard_faults(self) -> list[tuple[str, Any]]:
        foreign = [key for key in ("dictionary", "id", "size_mm") if getattr(self, key) is not None]
        faults: list[tuple[str, Any]] = [(key, _fault("belongs to kind: aruco")) for key in foreign]
        return faults or ([("code", "missing")] if self.code is None else [])

    def _tag_faults(self) -> list[tuple[str, Any]]:
        if self.code is not None:
            return [("code", _fault("belongs to kind: checkerboard; a tag has an id"))]
        missing = [key for key in ("dictionary", "id", "size_mm") if getattr(self, key) is None]
        if missing or self.dictionary is None or self.id is None:
            return [(key, "missing") for key in missing]
        fault = tag_fault(self.dictionary, self.id)
        place = fault.partition(" ")[0]
        return [(place, _fault(fault.removeprefix(f"{place} ").split(" (got")[0]))] if fault else []

    @property
    def pattern(self) -> str:
        """Return what a picture shows of it, which no two markers of a field may share.

        OpenCV's DICT_4X4_50 holds the first 50 tags of DICT_4X4_100, and so on.
        """
        return re.sub(r"^(DICT_\dX\d)_\d+ ", r"\1 ", self.identity)

    @property
    def identity(self) -> str:
        """Return its number, with its dictionary if it is a tag."""
        return str(self.code) if self.kind == "checkerboard" else f"{self.dictionary} {self.id}"

    @property
    def printed(self) -> Checkerboard | SquareTag:
        """Return the marker's layout."""
        if self.dictionary is not None and self.id is not None and self.size_mm is not None:
            return SquareTag(self.dictionary, self.id, self.size_mm)
        return Checkerboard(-1 if self.code is None else self.code, self.square_mm)


def _fault(text: str) -> PydanticCustomError:
    return PydanticCustomError("marker", "{text}", {"text": text})
