"""`python -m sim_bridge.study culprits < order.json`: fly some seeds with wrong figures.

Its own keys: errors as [entity, part, true minus told], exchanged as [drone, owner of its marker], stand_s: seconds
on the pads; diagnosed_from_s: start of the diagnosis.
"""

from typing import Any

from sim_bridge.study.faults.flight_order import FlightOrder
from sim_bridge.study.wrong_figures import WrongFigures


def fly(order: FlightOrder, seed: int) -> dict[str, Any]:
    """Return the report of one seed with the wrong figures of the order."""
    from sim_bridge.study.culprits.flight import CulpritFlight
    from sim_bridge.study.scenarios.flight import as_drawn

    errors = {(who, part): size for who, part, size in order.own["errors"]}
    wrong = WrongFigures(errors, dict(order.own["exchanged"]))
    drawn = as_drawn(order.field, order.scenario, seed)
    times = order.own["stand_s"], order.own["diagnosed_from_s"]
    return CulpritFlight(drawn, order.sections, order.seconds, wrong, *times).fly()
