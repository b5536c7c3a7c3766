"""Kinds of values that a field file is made of, and the base of its sections."""

from collections.abc import Callable
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, PlainSerializer
from pydantic_core import PydanticCustomError

from drivers.camera.source_address import parse_source
from drivers.vehicle_settings import Address as Address
from drivers.vehicle_settings import Shape, is_address
from groundstation.errors import without_password

NAME_PATTERN = r"^[a-z][a-z0-9_]{0,47}$"


class SettingsSection(BaseModel):
    """Base of all settings: frozen, strict, finite, without unknown keys; the text below a key is its description."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, use_attribute_docstrings=True
    )


def of_length(length: int) -> BeforeValidator:
    """Return a check that a list has a length."""

    def check(value: Any) -> Any:
        if isinstance(value, list | tuple) and len(value) != length:
            raise PydanticCustomError("entries", "must hold {n} numbers (got {m})", {"n": length, "m": len(value)})
        return tuple(value) if isinstance(value, list) else value

    return BeforeValidator(check)


def _rising(value: tuple[float, float]) -> tuple[float, float]:
    if value[0] >= value[1]:
        raise PydanticCustomError("rising", "the first number must be smaller than the second")
    return value


def read_by(parse: Callable[[str], object]) -> AfterValidator:
    """Return a check that an address can be read, by a function that raises ValueError with the reason."""

    def check(value: str) -> str:
        try:
            parse(value)
        except ValueError as error:
            raise PydanticCustomError("source", "{why}", {"why": str(error)}) from None
        return value

    return AfterValidator(check)


_NAME_WORDS = "must be a name such as {} (a-z first, then a-z, 0-9, _)"
Name = Annotated[str, Shape(NAME_PATTERN, _NAME_WORDS.format("drone_1"))]
HostName = Annotated[str, Shape(r"^([a-z][a-z0-9_]{0,15})?$", f"{_NAME_WORDS.format('lab_2')} of 16 letters at most")]
Vector2 = Annotated[tuple[float, float], of_length(2)]
Vector3 = Annotated[tuple[float, float, float], of_length(3)]
_Offset = Annotated[float, Field(ge=-2, le=2)]
OnVehicle = Annotated[tuple[_Offset, _Offset, _Offset], of_length(3)]  # a typing error in a place spoils the estimate
Interval = Annotated[Vector2, AfterValidator(_rising)]
VideoDelay = Annotated[float, Field(ge=0, le=2000)]
Readout = Annotated[float, Field(ge=0, le=100)]
SQUARES_MM = (5.0, 200.0)
SquareSize = Annotated[float, Field(ge=SQUARES_MM[0], le=SQUARES_MM[1])]
MarkerCode = Annotated[int, Field(ge=0, le=15)]  # geometry.board.VALID_CODES
# Only the driver gets the password, from the attribute: written, recorded and shown fields are dumps.
Source = Annotated[str, read_by(parse_source), PlainSerializer(without_password)]
AddressOrNone = Annotated[str, AfterValidator(lambda value: value and is_address(value))]
