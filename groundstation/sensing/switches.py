"""A change of the sensing topology, and the planner's reason."""

from dataclasses import dataclass

from groundstation.bus.messages import Plan


@dataclass(frozen=True, slots=True)
class Switch:
    """A switch: its time, both topologies, the costs of both at that time [m^2], and the reason in words.

    stay_cost is None if the former topology was no longer possible (a robot came or went).
    """

    time_s: float
    before: str
    after: str
    cost: float
    stay_cost: float | None
    reason: str


def switch_between(before: Plan, now: Plan, time_s: float) -> Switch | None:
    """Return the switch between the plan before and the plan of this time; None if the topology is the same."""
    if before.topology == now.topology:
        return None
    costs = {other.topology: other.cost for other in now.alternatives}
    stay = costs.get(before.topology)
    return Switch(time_s, before.topology, now.topology, now.cost, stay, _reason(before, now, stay))


def _robots(topology: str) -> set[str]:
    return {name for name in topology.replace("/", ",").split(",") if name}


def _reason(before: Plan, now: Plan, stay: float | None) -> str:
    came, went = _robots(now.topology) - _robots(before.topology), _robots(before.topology) - _robots(now.topology)
    if came or went:
        parts = [
            f"{', '.join(sorted(names))} {what}"
            for names, what in ((came, "joined the team"), (went, "left the team"))
            if names
        ]
        return " and ".join(parts)
    if now.mode != before.mode:
        return f"mode {before.mode} to {now.mode}"
    if stay is None or stay <= 0.0:
        return "what went before was no longer possible"
    return f"the target's place should be known {100 * (1 - now.cost / stay):.0f} % better this way"
