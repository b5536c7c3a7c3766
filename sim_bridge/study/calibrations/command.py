"""`python -m sim_bridge.study calibrations < order.json`: fly with wrong figures, and calibrate by that.

Its own keys: errors as [entity, part, true minus told]; stand_s: seconds on the pads; calibrate: whether settings are
asked for.
"""

from typing import Any

from sim_bridge.study.faults.flight_order import FlightOrder
from sim_bridge.study.wrong_figures import WrongFigures


def fly(order: FlightOrder, seed: int) -> dict[str, Any]:
    """Return the report of one seed, with the settings that its recording asks for if the order wants them."""
    from sim_bridge.study.calibrations.flight import CalibrationFlight
    from sim_bridge.study.scenarios.flight import as_drawn

    wrong = WrongFigures({(who, part): size for who, part, size in order.own["errors"]})
    drawn = as_drawn(order.field, order.scenario, seed)
    flight = CalibrationFlight(drawn, order.sections, order.seconds, wrong, order.own["stand_s"])
    report = flight.fly()
    return report | ({"settings": flight.settings()} if order.own["calibrate"] else {})
