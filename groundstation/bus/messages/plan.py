"""The plan that the tracker adopted."""

import msgspec

from groundstation.bus.messages.base import Message
from groundstation.vectors import Vector3


class Alternative(msgspec.Struct, frozen=True):
    """A topology that was considered."""

    topology: str
    """Text form, such as `a,b/c`."""
    cost: float
    """Its cost [m^2], or its lower bound."""
    bound_only: bool = False
    """Whether `cost` is the lower bound by which it was ruled out."""


class Control(msgspec.Struct, frozen=True):
    """Commanded velocity of one robot, and the changes by safety limits."""

    robot: str
    """The robot."""
    velocity_m_s: Vector3
    """Velocity [m/s; base_stabilized]."""
    yaw_rate_rad_s: float
    """Yaw rate [rad/s], counter-clockwise."""
    limited_by: tuple[str, ...] = ()
    """Safety rules that changed it."""
    wanted_m_s: Vector3 | None = None
    """The velocity before the safety limits [m/s; base_stabilized], where it is known."""


class Edge(msgspec.Struct, frozen=True):
    """A permitted observation of the chosen topology."""

    observer: str
    """Entity that observes."""
    subject: str
    """Entity that is observed."""
    information: float
    """Information that the observation is expected to bring [1/m^2]."""


class SolverReport(msgspec.Struct, frozen=True):
    """What the optimiser did."""

    status: str
    """`complete`, or `stopped` when its time was over."""
    evaluations: int
    """Evaluations of the cost."""
    seconds: float
    """CPU time [s]."""
    topologies: int
    """Topologies that were considered."""
    survivors: int
    """Those of them that were optimised."""
    gap: float | None = None
    """Upper bound of the share of the plan's cost that the best of all plans could save; mostly far above the true one.
    """


class Plan(Message, frozen=True, kw_only=True):
    """The chosen topology with its controls, and the alternatives."""

    topology: str
    """Levels from the top, separated by /; robots of a level by commas."""
    cost: float
    """Cost of the plan [m^2]."""
    controls: tuple[Control, ...]
    """Velocity of each airborne robot."""
    edges: tuple[Edge, ...]
    """Observations that the topology permits."""
    alternatives: tuple[Alternative, ...]
    """The other topologies, with their costs."""
    solver: SolverReport
    """What the optimiser did."""
    mode: str
    """`multistart` or `paper`, or HOLD while drones wait to be found after the tracker's belief broke."""
