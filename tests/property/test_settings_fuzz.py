"""Any content of a field file gives either a field or a list of problems that each name a place."""

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML

from groundstation.errors import SettingsError
from groundstation.settings.document import parse
from groundstation.settings.load import load_field
from groundstation.settings.schema import Field

FIXTURE = Path(__file__).parents[1] / "fixtures" / "field"
GOOD: dict[str, Any] = json.loads(json.dumps(YAML(typ="safe", pure=True).load(FIXTURE / "lab.yaml")))


def paths(tree: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    if path:
        yield path
    if isinstance(tree, dict):
        for key, value in tree.items():
            yield from paths(value, (*path, key))
    elif isinstance(tree, list):
        for index, value in enumerate(tree):
            yield from paths(value, (*path, index))


def replaced(tree: Any, path: tuple[Any, ...], value: Any) -> Any:
    if not path:
        return value
    copy = tree.copy()
    copy[path[0]] = replaced(tree[path[0]], path[1:], value)
    return copy


PATHS = sorted(paths(GOOD), key=str)
SCALARS = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=12)
VALUES = SCALARS | st.lists(SCALARS, max_size=4) | st.dictionaries(st.text(max_size=8), SCALARS, max_size=3)


def outcome(text: str, options: tuple[str, ...] = ()) -> Field | list[str]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "f.yaml"
        path.write_text(text, encoding="utf-8")
        for name in ("ceiling", "ardrone_front"):
            target = path.parent / "cameras" / f"{name}.yaml"
            target.parent.mkdir(exist_ok=True)
            target.symlink_to(FIXTURE / "cameras" / f"{name}.yaml")
        try:
            return load_field(path, options)
        except SettingsError as error:
            assert error.problems
            places = (str(path), "--set ", str(path.parent / "cameras"))
            assert all(problem.startswith(places) for problem in error.problems), error.problems
            assert all("\n" not in problem for problem in error.problems)
            return error.problems


def judge(result: Field | list[str]) -> None:
    if isinstance(result, Field):
        written = result.model_dump_json()
        assert Field.model_validate_json(written).model_dump_json() == written


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(PATHS), VALUES)
def test_any_value_anywhere(path: tuple[Any, ...], value: Any) -> None:
    # json.dumps writes Infinity and NaN, which YAML reads as words: those are tried as well.
    judge(outcome(json.dumps(replaced(GOOD, path, value))))


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(PATHS), st.text(min_size=1, max_size=10))
def test_any_option(path: tuple[Any, ...], value: str) -> None:
    judge(outcome(json.dumps(GOOD), (f"{'.'.join(map(str, path))}={value}",)))


@settings(max_examples=40, deadline=None)
@given(st.binary(max_size=60) | st.text(alphabet="ab:-[]{}&*!|>'\"#% \n\t0.", max_size=60).map(str.encode))
def test_any_text(content: bytes) -> None:
    try:
        text = content.decode()
    except UnicodeDecodeError:
        return
    try:
        parse(text, "f.yaml").plain()
    except SettingsError as error:
        assert error.problems and all(problem.startswith("f.yaml") for problem in error.problems)
