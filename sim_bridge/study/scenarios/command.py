"""`python -m sim_bridge.study scenarios < order.json`: fly some seeds of a scenario. Its own key: strategy."""

from typing import Any

from sim_bridge.study.faults.flight_order import FlightOrder, WrongOrder


def fly(order: FlightOrder, seed: int) -> dict[str, Any]:
    """Return the verdict on one seed; raises WrongOrder for an unknown strategy."""
    from sim_bridge.study.scenarios.flight import ScenarioFlight, as_drawn
    from sim_bridge.study.scenarios.strategies import STRATEGIES

    strategy = order.own["strategy"]
    if strategy not in STRATEGIES:
        raise WrongOrder(f"no strategy {strategy!r}; there are {', '.join(STRATEGIES)}")
    drawn = as_drawn(order.field, order.scenario, seed)
    return ScenarioFlight(drawn, order.sections, order.seconds, strategy).fly()
