"""The models that validate a field and the values used by the program have the same keys, types and defaults."""

import re
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import msgspec
import pytest
from pydantic import BaseModel

from groundstation.field.resolved import ResolvedField, field_from_json
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.settings.recorded import recorded_field
from groundstation.settings.resolved import resolved_field
from groundstation.settings.schema import Field
from groundstation.vehicles import all_kinds

ROOT = Path(__file__).parents[3]
OF_KINDS = sorted(key for kind in all_kinds().values() for key in kind.sections)


_BY_BASE = "max_speed_m_s|max_acceleration_m_s2|max_turn_rate_deg_s|acceleration_std_m_s2"


def facts(kind: Any, path: str = "field") -> Iterator[str]:
    """Yield a line for each key, type and default below a model of pydantic's or a struct of msgspec's."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Annotated:
        yield from facts(inner[0], path)
    elif isinstance(kind, type) and issubclass(kind, BaseModel):
        for key, field in kind.model_fields.items():
            default = "" if field.is_required() else in_words(field.get_default(call_default_factory=True))
            yield f"{path}.{key}: {default or 'required'}"
            yield from facts(field.annotation, f"{path}.{key}")
    elif isinstance(kind, type) and issubclass(kind, msgspec.Struct):
        for one in msgspec.structs.fields(kind):
            factory = None if one.default_factory is msgspec.NODEFAULT else one.default_factory
            default = "" if one.required else in_words(factory() if factory else one.default)
            yield f"{path}.{one.name}: {default or 'required'}"
            yield from facts(one.type, f"{path}.{one.name}")
    elif origin is None or origin is Literal:
        yield f"{path}: {kind}"
    else:
        yield f"{path}: {types.UnionType if origin is Union else origin}"
        for index, one in enumerate(inner):
            yield from facts(one, f"{path}[{index}]")


def in_words(default: Any) -> str:
    return f"default {as_json(default.model_dump(mode='json') if isinstance(default, BaseModel) else default)}"


def as_json(value: Any) -> Any:
    return msgspec.json.decode(msgspec.json.encode(value))


def test_both_sides_have_the_same_keys_types_and_defaults() -> None:
    judged, read = set(facts(Field)), set(facts(ResolvedField))
    # Values from a target's base may be absent in the file, and are always present for readers.
    differing = {line for line in judged ^ read if not re.search(rf"\.target(s\[1\]|\[0\])\.({_BY_BASE})\b", line)}
    # Settings of only one vehicle kind are in one group, and are read by its driver and its emulator.
    own = "|".join([*OF_KINDS, "sections"])
    differing = {line for line in differing if not re.match(rf"field\.drones\[1\]\.({own})\b", line)}
    # `certified` of older files is translated on reading; recordings keep it.
    differing = {line for line in differing if not line.startswith("field.planner.mode: ")}
    # Heights that the file leaves out follow from its room; readers always have them.
    differing = {
        line for line in differing if not line.startswith(("field.planner.level_heights_m: ", "field.planner: "))
    }
    assert not differing
    assert "field.drones[1].limits.max_speed_m_s: default 0.6" in read


@pytest.mark.parametrize("name", ["lab", "mixed-team", "two-targets", str(ROOT / "tests/fixtures/field/lab.yaml")])
def test_a_field_keeps_every_value(name: str) -> None:
    field = load_field(find_field(name))
    kept = field.model_dump(mode="json")
    for drone in kept["drones"].values():
        drone["sections"] = {key: drone.pop(key) for key in OF_KINDS}
    assert as_json(resolved_field(field)) == kept
    assert field_from_json(field.model_dump_json().encode()) == resolved_field(field)
    written = msgspec.json.encode(resolved_field(field))  # as a re-run records it
    assert field_from_json(written) == resolved_field(field)
    assert resolved_field(recorded_field(written)) == resolved_field(field)


def test_an_unknown_key_is_an_error() -> None:
    dump = load_field(find_field("lab")).model_dump(mode="json")
    dump["planner"]["horizon_step"] = 3
    with pytest.raises(msgspec.ValidationError, match=r"unknown field `horizon_step` - at `\$\.planner`"):
        field_from_json(msgspec.json.encode(dump))


@pytest.mark.parametrize("drones", [None, [], {"drone_1": 5}])
def test_drones_that_are_none_are_an_error(drones: Any) -> None:
    dump = load_field(find_field("lab")).model_dump(mode="json") | {"drones": drones}
    with pytest.raises(msgspec.ValidationError, match=r"at `\$\.drones"):
        field_from_json(msgspec.json.encode(dump))


def test_differences_are_found() -> None:
    class Judged(BaseModel):
        same: Annotated[tuple[float, ...], "of something"] = (1.0,)
        typed: Annotated[int, "of something"] | None = None
        judged_only: int = 1
        needed: int
        default: float = 1.0

    class Read(msgspec.Struct, kw_only=True):
        same: tuple[float, ...] = (1.0,)
        typed: str | None = None
        needed: int = 2
        default: float = 2.0

    found = {line.split(":")[0] for line in set(facts(Judged)) ^ set(facts(Read))}
    assert found == {"field.judged_only", "field.typed[0]", "field.needed", "field.default"}
