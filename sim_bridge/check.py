"""`python -m sim_bridge.check < scenario.json`: judge a scenario without running it.

Prints a JSON list with an object for each fault (type, loc, msg, ctx, input as pydantic has them; known: the keys that
exist where an unknown one was given). The ground station, which knows the lines of the file, words them.
Exit codes: 0 good, 2 faults.
"""

import json
import sys
from collections.abc import Iterator, Sequence
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from sim_bridge.scenario import Scenario


def faults_of(text: bytes) -> list[dict[str, Any]]:
    """Return the mistakes of a scenario in JSON; empty without any."""
    try:
        Scenario.model_validate_json(text)
    except ValidationError as error:
        faults: list[dict[str, Any]] = json.loads(error.json(include_url=False))
        for fault in faults:
            if fault["type"] == "extra_forbidden":
                fault["known"] = _known(fault["loc"][:-1])
        return faults
    return []


def _known(path: Sequence[str | int]) -> list[str]:
    """Return the keys of the section at a path, of all its variants where it has several."""
    models: list[type[BaseModel]] = [Scenario]
    for key in path:
        inner = [found for model in models for found in _sections(model, key)]
        models = inner or models  # the name of a variant is part of the path, but no key
    return sorted({name for model in models for name in model.model_fields})


def _sections(model: type[BaseModel], key: str | int) -> Iterator[type[BaseModel]]:
    info = model.model_fields.get(str(key))
    if info is not None:
        yield from _models_in(info.annotation)


def _models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from _models_in(argument)


def main() -> int:
    """Judge the scenario on standard input."""
    faults = faults_of(sys.stdin.buffer.read())
    print(json.dumps(faults))
    return 2 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
