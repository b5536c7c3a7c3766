"""Plans of the fake tracker: a string and a star in turn, a single drone if only one is left."""

import math
from collections.abc import Callable, Sequence

from groundstation.bus import messages as m

TARGET = "turtlebot"
CONTROLS = {
    "drone_1": m.Control("drone_1", (0.35, 0.15, 0.0), 0.1, ()),
    "drone_2": m.Control("drone_2", (0.1, 0.15, 0.0), 0.1, ()),
}
AT_THE_FENCE = m.Control("drone_2", (0.1, 0.15, 0.0), 0.1, ("fence",), (0.55, 0.2, 0.0))


def plan_at(
    s: float,
    header: m.Header,
    flying: Sequence[str],
    cameras: Sequence[str],
    sees: Callable[[str, str], bool],
    fenced: bool = False,
) -> m.Plan:
    """Return the plan at this time [s]; fenced: drone_2 is slowed by the fence."""
    controls = CONTROLS | ({"drone_2": AT_THE_FENCE} if fenced else {})
    planned = [name for name in controls if name in flying]
    string = math.sin(0.3 * s) > 0
    cost = 0.0123 + 0.004 * math.sin(0.5 * s)
    names = (["drone_1/drone_2", "drone_1,drone_2"] if string else ["drone_1,drone_2", "drone_1/drone_2"]) + [
        "drone_2/drone_1"
    ]
    if len(planned) < len(controls):
        names = planned
    alternatives = tuple(
        m.Alternative(name, cost * factor, bound_only=factor > 1.5)
        for name, factor in zip(names, (1.0, 1.18, 1.7), strict=False)
    )
    return m.Plan(
        header=header,
        topology=names[0] if names else "",
        cost=cost,
        controls=tuple(controls[name] for name in planned),
        edges=tuple(edge for edge in _edges(planned, cameras, string) if sees(edge.observer, edge.subject)),
        alternatives=alternatives,
        solver=m.SolverReport("converged", 84, 0.018, 3, 2),
        mode="TRACK",
    )


def _edges(planned: list[str], cameras: Sequence[str], string: bool) -> list[m.Edge]:
    below = ("drone_1", 210.0) if string and "drone_1" in planned else (cameras[-1], 640.0)
    edges = {
        "drone_1": [m.Edge(cameras[0], "drone_1", 820.0), m.Edge("drone_1", TARGET, 145.0)],
        "drone_2": [m.Edge(below[0], "drone_2", below[1]), m.Edge("drone_2", TARGET, 380.0 if string else 330.0)],
    }
    return [edge for name in planned for edge in edges[name]]
