"""What the tracker decided."""

import msgspec

from groundstation.bus.messages.base import Message, Vector3


class Alternative(msgspec.Struct, frozen=True):
    """A topology that was considered, with its cost, or its lower bound if it was dropped with proof."""

    topology: str
    cost: float
    bound_only: bool = False


class Control(msgspec.Struct, frozen=True):
    """Commanded velocity of one robot: (vx, vy, vz) [base_stabilized] and yaw rate, with what safety changed.

    wanted_m_s: the velocity before safety, where it is known.
    """

    robot: str
    velocity_m_s: Vector3
    yaw_rate_rad_s: float
    limited_by: tuple[str, ...] = ()
    wanted_m_s: Vector3 | None = None


class Edge(msgspec.Struct, frozen=True):
    """A permitted observation of the chosen topology and the information it is expected to bring [1/m^2]."""

    observer: str
    subject: str
    information: float


class SolverReport(msgspec.Struct, frozen=True):
    """What the optimiser did: status, cost evaluations, CPU seconds, topologies looked at and optimised."""

    status: str
    evaluations: int
    seconds: float
    topologies: int
    survivors: int


class Plan(Message, frozen=True, kw_only=True):
    """The chosen topology with its controls and cost [m^2], beside the alternatives."""

    topology: str
    cost: float
    controls: tuple[Control, ...]
    edges: tuple[Edge, ...]
    alternatives: tuple[Alternative, ...]
    solver: SolverReport
    mode: str
