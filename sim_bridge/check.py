"""`python -m sim_bridge.check < order.json`: judge a scenario without running it, by itself or for a field.

The order holds `scenario`, and for a field `field` (resolved), `cameras` (the emulated ones) and `real` (bodies).
Prints a JSON list with an object for each fault (type, loc, msg, ctx, input as pydantic has them; known: the keys that
exist where an unknown one was given; type "misfit": the field has no such thing). The ground station, which
knows the lines of the file, words them. Exit codes: 0 good, 2 faults.
"""

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from sim_bridge.scenario import Scenario
from sim_bridge.scenario_fit import misfits
from sim_bridge.site import parse_site

MISFIT = "misfit"


def faults_of(order: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the mistakes of a scenario (decoded JSON); empty without any."""
    try:
        scenario = Scenario.model_validate_json(json.dumps(order["scenario"]))
    except ValidationError as error:
        faults: list[dict[str, Any]] = json.loads(error.json(include_url=False))
        for fault in faults:
            if fault["type"] == "extra_forbidden":
                fault["known"] = _known(fault["loc"][:-1])
        return faults
    if "field" not in order:
        return []
    unfit = misfits(scenario, parse_site(order["field"]), order["cameras"], order["real"])
    return [{"type": MISFIT, "loc": one.path, "msg": one.text, "input": None} for one in unfit]


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
    """Judge the order on standard input."""
    faults = faults_of(json.load(sys.stdin))
    print(json.dumps(faults))
    return 2 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
