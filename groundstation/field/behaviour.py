"""Values of the settings of estimator, planner, safety, recorder, console and bus."""

from typing import Literal

import msgspec


class EstimatorValues(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The joint estimator."""

    rate_hz: int = 50
    max_lateness_s: float = 0.5
    gate_probability: float = 0.997
    lost_after_s: float = 3.0


PlannerMode = Literal["multistart", "paper", "certified"]
"""`certified` is what older recordings call `multistart`."""


class PlannerValues(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The search over topologies; row n of level_heights_m: its initial heights with n levels [m]."""

    rate_hz: int = 10
    mode: PlannerMode = "multistart"
    plug_in: str = ""
    horizon_steps: int = 10
    step_s: float = 0.2
    discount: float = 0.9
    hysteresis: float = 0.05
    initial_topology: Literal["flat", "string"] = "flat"
    level_heights_m: tuple[tuple[float, ...], ...]
    planned_range_m: float = 1.9
    separation_m: float = 1.0

    @property
    def max_plan_age_s(self) -> float:
        """Return for how long the controls of a plan are flown [s]."""
        return max(1.0, 3.0 / self.rate_hz)


class SafetyValues(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Safety limits and communication time-outs."""

    min_separation_m: float = 0.6
    setpoint_lifetime_ms: int = 300
    land_after_s: float = 3.0
    unseen_land_after_s: float = 10.0
    max_position_std_m: float = 0.6

    @property
    def obstacle_distance_m(self) -> float:
        """Return the least distance of a drone's centre from obstacles [m]: the separation is that of two bodies."""
        return 0.5 * self.min_separation_m

    @property
    def unseen_land_at_last_s(self) -> float:
        """Return the time unseen after which a drone lands even if its place is well known [s]."""
        return 3.0 * self.unseen_land_after_s


class RecordingValues(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Content and place of a run's recording."""

    enabled: bool = True
    directory: str = "runs"
    image_fps: float = 5.0
    pictures: Literal["none", "blurred", "full"] = "full"
    raw_datagrams: bool = True
    rotate_mb: float = 1000.0
    rotate_minutes: float = 60.0
    keep_gb: float = 0.0


class ConsoleValues(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The operator's web page."""

    enabled: bool = True
    port: int = 8765
    listen: str = ""


class BusValues(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The router of the run's messages."""

    port: int = 4717
    listen: str = ""
    name_refusals: bool = True
