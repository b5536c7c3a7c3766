"""`python -m sim_bridge.study missions < order.json`: fly some seeds to the floor.

Its own keys, each for every third flight: understated, the factor by which the covariance of sightings is too small;
drift_m_s, the error of each drone's reported velocity.
"""

from typing import Any

from sim_bridge.study.faults.flight_order import FlightOrder

_EVERY, _UNDERSTATES, _DRIFTS = 3, 0, 1


def fly(order: FlightOrder, seed: int) -> dict[str, Any]:
    """Return the verdict on one seed."""
    from sim_bridge.study.faults.vehicles import of_team
    from sim_bridge.study.missions.draw import draw_mission
    from sim_bridge.study.missions.flight import MissionFlight

    share = 1.0 / order.own["understated"] if seed % _EVERY == _UNDERSTATES else 1.0
    drift_m_s = order.own["drift_m_s"] if seed % _EVERY == _DRIFTS else 0.0
    drawn = draw_mission(order.field, order.scenario, seed, drift_m_s)
    sections = of_team(order.sections, drawn.field["drones"])
    report = MissionFlight(drawn, sections, order.seconds, share).fly()
    return {**report, "drones": len(drawn.field["drones"]), "drift_m_s": drift_m_s}
