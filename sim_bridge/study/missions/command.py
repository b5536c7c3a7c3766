"""`python -m sim_bridge.study missions < order.json`: fly some seeds to the floor.

Its own key: understated, the factor by which the covariance of sightings is too small in every third flight.
"""

from typing import Any

from sim_bridge.study.faults.flight_order import FlightOrder

_EVERY = 3


def fly(order: FlightOrder, seed: int) -> dict[str, Any]:
    """Return the verdict on one seed."""
    from sim_bridge.study.missions.draw import draw_mission
    from sim_bridge.study.missions.flight import MissionFlight

    share = 1.0 / order.own["understated"] if seed % _EVERY == 0 else 1.0
    drawn = draw_mission(order.field, order.scenario, seed)
    return MissionFlight(drawn, order.sections, order.seconds, share).fly()
