"""Judges what a planner returned, perhaps another package's, before anybody flies it. Pure."""

import math
from collections.abc import Collection
from typing import Any

import msgspec
import numpy as np

from groundstation.bus.messages import Alternative, Edge, Header, Plan, SolverReport
from groundstation.planning.records import HEIGHT
from groundstation.sensing.topology import Topology

_sent, _received = msgspec.json.Encoder(), msgspec.json.Decoder(Plan)


def check_answer(answer: Any, robots: Collection[str], stamp_ns: int) -> None:
    """Raise ValueError if a `PlanResult` cannot be flown or published.

    robots, stamp_ns: those of the request, and the time of its belief.
    """
    if not isinstance(answer.topology, Topology) or not answer.topology.robots.issuperset(answer.controls):
        raise ValueError(f"a plan needs a Topology with all robots that it controls, not {answer.topology!r}")
    if strangers := (answer.topology.robots | set(answer.controls) | set(answer.heights)).difference(robots):
        raise ValueError(f"a plan was asked for {sorted(robots)}, not for {sorted(strangers)}")
    if answer.stamp_ns != stamp_ns:
        raise ValueError(f"a plan has the time of the belief, {stamp_ns} ns, not {answer.stamp_ns!r}")
    for name, control in answer.controls.items():
        values = np.asarray(control, dtype=np.float64)
        if values.shape != (HEIGHT,) or not np.isfinite(values).all():
            raise ValueError(f"a plan has {HEIGHT} finite controls for {name}, not {control!r}")
        if name not in answer.heights:
            raise ValueError(f"a plan has no height for {name}")
    figures = {"cost": answer.cost, "uncertainty": answer.uncertainty, **answer.heights}
    if wrong := {
        name: one for name, one in figures.items() if not isinstance(one, int | float) or not math.isfinite(one)
    }:
        raise ValueError(f"a plan has finite figures, not {wrong}")
    for kind, parts in ((Edge, answer.edges), (Alternative, answer.alternatives), (SolverReport, (answer.solver,))):
        if not isinstance(parts, tuple) or not all(isinstance(part, kind) for part in parts):
            raise ValueError(f"a plan has a tuple of {kind.__name__}, not {parts!r}")


def check_message(answer: Any) -> None:
    """Raise ValueError if the message of a `PlanResult` could not be sent, or would be refused by those who get it.

    Types of Python are checked nowhere else: a number of numpy ends the process that sends it.
    """
    try:
        message = Plan(
            header=Header(answer.stamp_ns, "", "", "", 0),
            topology=str(answer.topology),
            cost=answer.cost,
            controls=(),
            edges=answer.edges,
            alternatives=answer.alternatives,
            solver=answer.solver,
            mode=answer.mode,
        )
        _received.decode(_sent.encode(message))
    except (TypeError, ValueError, msgspec.MsgspecError) as error:
        raise ValueError(f"a plan cannot be published: {error}") from error
