"""How the team estimates, plans, stays safe, and what is kept of a run."""

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from groundstation.settings.values import Section

Height = Annotated[float, Field(ge=0.3, le=20)]


class Estimator(Section):
    """The joint EKF: its rate, how late a measurement may be, its gate, and when a target counts as lost."""

    rate_hz: Annotated[int, Field(ge=10, le=200)] = 50
    max_lateness_s: Annotated[float, Field(gt=0, le=5)] = 0.5
    gate_probability: Annotated[float, Field(ge=0.5, lt=1)] = 0.997
    lost_after_s: Annotated[float, Field(gt=0, le=60)] = 3.0


def _falling(levels: tuple[float, ...]) -> tuple[float, ...]:
    if any(upper <= lower for upper, lower in pairwise(levels)):
        raise PydanticCustomError("falling", "heights must fall from the top level to the lowest")
    return levels


def _one_row_more(rows: tuple[tuple[float, ...], ...]) -> tuple[tuple[float, ...], ...]:
    for number, row in enumerate(rows, start=1):
        if len(row) != number:
            raise PydanticCustomError(
                "rows", "row {n} must hold {n} heights, one for each level (got {m})", {"n": number, "m": len(row)}
            )
    return rows


LevelHeights = Annotated[
    tuple[Annotated[tuple[Height, ...], AfterValidator(_falling)], ...],
    Field(min_length=1),
    AfterValidator(_one_row_more),
]


class Planner(Section):
    """The search over sensing topologies and velocities.

    level_heights_m: row n holds the height slots of a topology with n levels, top level first.
    """

    rate_hz: Annotated[int, Field(ge=1, le=50)] = 10
    mode: Literal["certified", "paper"] = "certified"
    horizon_steps: Annotated[int, Field(ge=1, le=50)] = 10
    step_s: Annotated[float, Field(gt=0, le=2)] = 0.2
    discount: Annotated[float, Field(gt=0, le=1)] = 0.9
    hysteresis: Annotated[float, Field(ge=0, lt=1)] = 0.05
    initial_topology: Literal["flat", "string"] = "flat"
    level_heights_m: LevelHeights
    planned_range_m: Annotated[float, Field(gt=0, le=20)] = 1.9
    separation_m: Annotated[float, Field(gt=0, le=10)] = 1.0


class Safety(Section):
    """Limits of the last word, and how long silence is borne before a drone lands."""

    min_separation_m: Annotated[float, Field(ge=0.3, le=10)] = 0.6
    setpoint_lifetime_ms: Annotated[int, Field(ge=100, le=1000)] = 300
    land_after_s: Annotated[float, Field(ge=0.5, le=30)] = 3.0
    unseen_land_after_s: Annotated[float, Field(ge=1, le=60)] = 10.0
    max_position_std_m: Annotated[float, Field(gt=0, le=5)] = 0.6


class Recording(Section):
    """What is written of a run, and where (relative to the working directory)."""

    enabled: bool = True
    directory: Annotated[str, Field(min_length=1)] = "runs"
    image_fps: Annotated[float, Field(ge=0, le=5)] = 5.0
    raw_datagrams: bool = True
    rotate_mb: Annotated[float, Field(ge=0, le=100_000)] = 1000.0
    rotate_minutes: Annotated[float, Field(ge=0, le=1440)] = 60.0


class Console(Section):
    """The web page, on loopback."""

    enabled: bool = True
    port: Annotated[int, Field(ge=1024, le=65535)] = 8765
