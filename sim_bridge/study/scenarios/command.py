"""`python -m sim_bridge.study scenarios < order.json`: fly some seeds of a scenario. Its own key: strategy."""

from typing import Any

from sim_bridge.study.faults.flight_order import FlightOrder, WrongOrder, fly_seeds


def main() -> int:
    """Fly the order on standard input; WRONG_ORDER for an unknown strategy."""
    return fly_seeds(_fly)


def _fly(order: FlightOrder, seed: int) -> dict[str, Any]:
    from sim_bridge.study.scenarios.flight import ScenarioFlight, as_drawn
    from sim_bridge.study.scenarios.strategies import STRATEGIES

    strategy = order.own["strategy"]
    if strategy not in STRATEGIES:
        raise WrongOrder(f"no strategy {strategy!r}; there are {', '.join(STRATEGIES)}")
    drawn = as_drawn(order.field, order.scenario, seed)
    return ScenarioFlight(drawn, order.sections, order.seconds, strategy).fly()
